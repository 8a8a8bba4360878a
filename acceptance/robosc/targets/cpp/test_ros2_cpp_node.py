"""Generated rclcpp nodes, compiled against a stand-in for rclcpp with the real messages, and run event by event."""

import json
import re
import time
from itertools import groupby
from pathlib import Path
from typing import Any

import pytest

from robosc.automata.plants import PLANT_LOCATIONS
from robosc.certification import make_supervisor
from robosc.supervisor import Supervisor
from support import rclcpp_nodes
from support.models import EXAMPLES, bundle_of
from support.node_logs import comparable, entries_of, replayed
from support.rclcpp_nodes import SANITIZERS, compiled_once, missing, run, sent

END = "signal 15"
BY_EVENT = ("every:=event", "period:=3600")
PATIENT = "max_age:=[/scan=3600]"
"""No scan of the maze is ever too old, however slow the machine is."""

pytestmark = [
    pytest.mark.skipif(
        missing("geometry_msgs", "sensor_msgs", "std_srvs", "test_msgs") is not None,
        reason=str(missing("geometry_msgs", "sensor_msgs", "std_srvs", "test_msgs")),
    ),
]


def supervisor_of(text: str) -> Supervisor:
    made = make_supervisor(bundle_of(text))
    assert made.supervisor is not None, made.reason
    return made.supervisor


@pytest.fixture(scope="module")
def maze() -> Supervisor:
    return supervisor_of((EXAMPLES / "maze_solver" / "maze_solver.rscd").read_text())


@pytest.fixture(scope="module")
def maze_node(maze: Supervisor, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled_once(maze, tmp_path_factory)


@pytest.fixture(scope="module")
def courier() -> Supervisor:
    return rclcpp_nodes.courier()


@pytest.fixture(scope="module")
def courier_node(courier: Supervisor, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled_once(courier, tmp_path_factory, *SANITIZERS)


def numbers_of(yaml: str) -> list[float]:
    numbers = (float(item) for item in re.findall(r": (-?[0-9.e+-]+)", yaml))
    return sorted(number for number in numbers if number)


def test_nothing_is_decided_before_all_that_has_come_is_taken_in(maze_node: Path, tmp_path: Path) -> None:
    # They fit into a pipe at once, and by then a decision is due at every moment.
    burst = ["message /scan " + " ".join(distance * 360) for distance in "3131"]
    lines = [line for scan in burst for line in (scan, "message /rotate_done")]
    lines = ["wait publish /state", *lines, "wait publish /state", "wait publish /state", END]
    assert len("\n".join(lines)) < 4000
    done = run(maze_node, lines, "period:=0.0001", PATIENT, "publish_state:=true", f"log_folder:={tmp_path}")
    assert (done.returncode, done.stderr) == (0, "")
    kinds = [
        "request" if entry["controllable"] else "message" for entry in entries_of(tmp_path) if entry["kind"] == "event"
    ]
    first, last = kinds.index("message"), len(kinds) - kinds[::-1].index("message")
    assert kinds[first:last] == ["message"] * (last - first)
    assert last - first > len(burst)
    assert "request" in kinds[last:]


def test_the_other_way_of_comparing_can_fail(maze: Supervisor, maze_node: Path, tmp_path: Path) -> None:
    lines = [f"message /scan {' '.join(['3.0'] * 360)}", "message /rotate_done", END]
    run(maze_node, lines, *BY_EVENT, PATIENT, f"log_folder:={tmp_path}")
    entries = entries_of(tmp_path)
    assert comparable(entries) == comparable(replayed(maze, entries).entries)
    del entries[0]
    assert comparable(entries) != comparable(replayed(maze, entries).entries)


def test_orders_of_the_courier_end_in_every_way(courier: Supervisor, courier_node: Path, tmp_path: Path) -> None:
    lines = [
        # No server runs.
        "message /order/power",
        "message /order/count",
        "message /allowed 1",
        # Now there is.
        "server /power 1",
        "server /count 1",
        "message /order/power",
        "answer /power 1 fine",
        "message /order/count",
        "accept /count",
        "feedback /count 0 1 1",
        "feedback /count 3 5",
        "result /count 4 0 1 1 2 3",
        "message /order/count",
        "reject /count",
        "message /order/count",
        "accept /count",
        "result /count 6",
        "message /order/count",
        "accept /count",
        # Not allowed any more: it is cancelled.
        "message /allowed 0",
        "refuse /count 0",
        "result /count 5",
        END,
    ]
    done = run(courier_node, lines, *BY_EVENT, "server_wait:=0", f"log_folder:={tmp_path}")
    assert (done.returncode, done.stderr.count("\n")) == (0, 1)
    assert "[WARN] starting without a server of /power, /wind, /count, /arm/reach" in done.stderr
    entries = entries_of(tmp_path)
    assert comparable(entries) == comparable(replayed(courier, entries).entries)
    events = [entry["event"] for entry in entries if entry["kind"] == "event"]
    assert events.count("power.error") == 1
    assert events.count("power.response") == 1
    assert events.count("count.error") == 3
    assert events.count("count.cancel") == 1
    assert events.count("count.response") == 1
    assert events.count("count.feedback") == 2
    goals = [(word, data) for word, name, data in sent(done.stdout) if name == "/count"]
    assert goals == [("goal", "{order: 5}")] * 4 + [("cancel", "")]
    assert ("call", "/power", "{data: true}") in sent(done.stdout)
    (count,) = [entry for entry in entries if entry.get("event") == "count.response"]
    assert count["data"] == {"sequence": [0, 1, 1, 2, 3]}
    assert count["state"]["Counter"]["variables"] == {"seen": 3, "total": 5}


SERVERS = [f"server {name} 1" for name in ("/power", "/wind", "/count", "/arm/reach")]


def test_what_comes_before_the_start_is_held_and_goals_are_cancelled_at_the_end(
    courier: Supervisor, courier_node: Path, tmp_path: Path
) -> None:
    # The server is not there while the orders come; each topic holds as many as its depth.
    early = ["message /order/count", "message /allowed 0", *["message /allowed 1"] * 10]
    late = ["wait goal /count", "accept /count", "wait publish /cmd_vel", END]
    end = ["wait cancel /count", "refuse /count 0", "result /count 5"]
    done = run(courier_node, [*early, *SERVERS, *late, *end], "period:=0.01", f"log_folder:={tmp_path}")
    assert (done.returncode, done.stderr) == (0, "")
    entries = entries_of(tmp_path)
    events = [entry["event"] for entry in entries if entry["kind"] == "event"]
    assert events[0] == "order_count.response"
    assert events.count("allowed.response") == 10
    requested = [event for event in events if event.endswith(".request")]
    assert requested[0] == "count.request"
    assert {"kind": "stop", "what": "SIGTERM"}.items() <= next(e for e in entries if e["kind"] == "stop").items()
    doings = [(word, name) for word, name, _ in sent(done.stdout)]
    # The wheels stop before the goal is cancelled, and nothing follows.
    assert doings[-2:] == [("publish", "/cmd_vel"), ("cancel", "/count")]
    assert numbers_of(sent(done.stdout)[-2][2]) == []


def test_a_fault_stops_the_robot_and_is_reported_at_the_end(maze_node: Path, tmp_path: Path) -> None:
    lines = ["message /scan nan", END]
    done = run(maze_node, lines, *BY_EVENT, "on_unknown:=fault", f"log_folder:={tmp_path}")
    assert done.returncode == 1
    assert done.stderr == "maze_solver_controller: something was unknown\n"
    name, last = sent(done.stdout)[-1][1:]
    assert (name, numbers_of(last)) == ("/cmd_vel", [])
    assert "fault" in {entry["kind"] for entry in entries_of(tmp_path)}


def test_a_server_that_is_lost_fails_its_calls(courier_node: Path, tmp_path: Path) -> None:
    lines = [*SERVERS, "message /order/wind", "wait call /wind", "server /wind 0"]
    waited = ["wait publish /state"] * 60
    done = run(courier_node, [*lines, *waited, END], "period:=0.025", "publish_state:=true", f"log_folder:={tmp_path}")
    assert done.returncode == 0, done.stderr
    events = [entry["event"] for entry in entries_of(tmp_path) if entry["kind"] == "event"]
    assert events[-2:] == ["wind.error", "wind.reset"]


STATES = ["wait publish /state"] * 40
"""Waits for so many states that the last ones follow earlier input: states that come during other waits count."""


def test_the_state_reports_where_services_and_actions_are(courier: Supervisor, courier_node: Path) -> None:
    lines = [
        *SERVERS,
        *STATES,
        *("message /order/power", "wait call /power", *STATES, "answer /power 1 fine", *STATES),
        *("message /allowed 1", "message /order/count", "wait goal /count", "accept /count", *STATES),
        *("result /count 4 0 1 1 2 3", *STATES, END),
    ]
    done = run(courier_node, lines, "period:=0.005", "publish_state:=true")
    assert done.returncode == 0, done.stderr
    states = [states_of(data) for _, name, data in sent(done.stdout) if name == "/state"]
    keys = ["current", "communications", "transitions", "cancelling", "definition"]
    assert all(list(state) == keys for state in states)
    found = [state["communications"] for state in states]
    called = [item for item in courier.model.communications if item.kind in PLANT_LOCATIONS]
    assert all(list(places) == [item.name for item in called] for places in found)
    assert {place for places in found for place in places.values()} == {"idle", "waiting", "executing"}
    busy = [tuple(name for name, place in places.items() if place != "idle") for places in found]
    # Each in its turn; the rest of them are always idle.
    assert [names for names, _ in groupby(busy)] == [(), ("power",), (), ("count",), ()]


def states_of(text: str) -> Any:
    """Return the content of a message of `/state`, as the stand-in prints it."""
    inner = re.fullmatch(r'\{data: "(.*)"\}', text)
    assert inner is not None
    return json.loads(inner[1].replace('\\"', '"'))


DRIVING = [*SERVERS, "message /allowed 1", "message /order/count", "wait goal /count"]
A_WHILE = ["wait publish /state"] * 60
WATCHED = ("period:=0.025", "publish_state:=true")


def test_a_lost_goal_is_cancelled_when_its_server_is_seen_again(courier_node: Path, tmp_path: Path) -> None:
    lines = [*DRIVING, "accept /count", "server /count 0", *A_WHILE, "server /count 1", "wait cancel /count"]
    # Acceptance of another one becomes known only later.
    lines += ["refuse /count 3", "result /count 5", "message /order/count", "wait goal /count", "server /count 0"]
    lines += [*A_WHILE, "accept /count", "wait cancel /count", "refuse /count 0", END]
    done = run(courier_node, lines, *WATCHED, f"log_folder:={tmp_path}")
    assert (done.returncode, done.stderr) == (0, "")
    events = [entry["event"] for entry in entries_of(tmp_path) if entry["kind"] == "event"]
    assert events.count("count.error") == 2
    assert events.count("count.cancel") == 0


@pytest.mark.parametrize(
    ("end", "event"),
    [("5", "count.cancel"), ("4 0 1 1 2 3", "count.response"), ("6", "count.error"), (None, None)],
)
def test_a_cancelled_goal_is_executed_until_its_server_ends_it(
    courier_node: Path, tmp_path: Path, end: str | None, event: str | None
) -> None:
    """A robot brakes for longer than the parameter allows, and then ends in one way or another, or never."""
    braking = ["message /allowed 0", "wait cancel /count", "refuse /count 0", *A_WHILE]
    # The goal alone is in the way of another one.
    braking += ["message /allowed 1", "feedback /count 3 5", "message /order/count", *STATES]
    # The cancel is allowed only where the requirement does not hold.
    ending = [] if end is None else ["message /allowed 0", f"result /count {end}", *STATES]
    lines = [*DRIVING, "accept /count", *braking, *ending, END]
    done = run(courier_node, lines, *WATCHED, "cancel_timeout:=0.5", f"log_folder:={tmp_path}")
    assert done.returncode == 0, done.stderr
    entries = entries_of(tmp_path)
    names = [(entry["kind"], entry["event"] if entry["kind"] == "event" else entry.get("action")) for entry in entries]
    begin = names.index(("cancelling", "count"))
    assert entries[begin]["why"] == "requirement 1 no longer holds"
    overdue = names.index(("cancel_overdue", "count"))
    assert 0.5 <= entries[overdue]["asked_s"] < 60.0
    fed = names.index(("event", "count.feedback"))
    assert begin < overdue < fed
    ends = [
        name for kind, name in names if kind == "event" and name in ("count.cancel", "count.response", "count.error")
    ]
    assert ends == ([] if event is None else [event])
    assert names.count(("event", "count.request")) == 1
    states = [states_of(data) for _, name, data in sent(done.stdout) if name == "/state"]
    found = [cancelling for cancelling, _ in groupby(state["cancelling"] for state in states)]
    assert found == ([[], ["count"]] if event is None else [[], ["count"], []])
    reports = [data for _, name, data in sent(done.stdout, but="") if name == "/diagnostics"]
    assert any("the goal of count has not ended although its cancel was asked for" in data for data in reports)


@pytest.mark.parametrize(("code", "status"), [(1, 1), (2, 0)])
def test_a_running_goal_whose_cancel_is_refused_is_a_fault(courier_node: Path, code: int, status: int) -> None:
    # Unless the server does not know the goal: then it is lost, and nothing runs.
    lines = [
        *DRIVING,
        "accept /count",
        "message /allowed 0",
        "wait cancel /count",
        f"refuse /count {code}",
        *A_WHILE,
        END,
    ]
    done = run(courier_node, lines, *WATCHED)
    assert done.returncode == status
    warning = "courier_controller: the cancel of a running goal was refused\n"
    assert done.stderr == (warning if status else "")


@pytest.mark.parametrize(
    ("parameter", "expected"),
    [
        ("period:=0", "parameter 'period' is 0; it must be 0.0001 seconds or more"),
        ("period:=1e9", "parameter 'period' is 1000000000.0; it must be 0.0001 seconds or more, and at most 3600"),
        ("service_timeout:=-0.5", "parameter 'service_timeout' is -0.5; it must be a number of seconds, 0 or more"),
        ("period:=fast", "parameter 'period' is 'fast'; it must be"),
        ("policy:=quick", "parameter 'policy' is 'quick'; it must be one of fair, priority, random"),
        ("priority:=[jump]", "parameter 'priority': 'jump' is not a request; there is rotate_left, rotate_right, "),
        ("seed:=0.5", "parameter 'seed' is 0.5; it must be an integer"),
        ("max_age:=[/scan]", "parameter 'max_age' is '/scan'; it must be topic=seconds, such as /scan=0.5"),
        ("max_age:=[/scan=-1]", "parameter 'max_age' is '/scan=-1'; it must be topic=seconds"),
        ("max_age:=[/scam=1]", "parameter 'max_age': '/scam' is not the identifier of an outgoing message"),
        ("release_identifiers:=[/scan]", "parameter 'release_identifiers': '/scan' is not the identifier of an inc"),
        ("topic_prefix:=robot1", "parameter 'topic_prefix' is 'robot1'; it must be empty or the beginning"),
        ("topic_prefix:=/1", "parameter 'topic_prefix' is '/1'; it must be empty or the beginning"),
        ("publish_state:=1", "parameter 'publish_state' is 1; it must be true or false"),
        ("state_message:=xml", "parameter 'state_message' is 'xml'; it must be one of json, typed, both"),
        ("service_timeout:=-1", "parameter 'service_timeout' is -1; it must be a number of seconds, 0 or more"),
        ("log_folder:=/proc/none", "parameter 'log_folder': /proc/none: "),
    ],
)
def test_a_wrong_parameter_is_one_clear_error(maze_node: Path, parameter: str, expected: str) -> None:
    done = run(maze_node, [END], parameter)
    assert done.returncode == 2
    assert done.stderr.startswith(f"maze_solver_controller: {expected}")
    assert done.stderr.count("\n") == 1


def test_states_and_prefix(maze_node: Path) -> None:
    lines = [f"message /robot1/scan {' '.join(['3.0'] * 360)}", *["wait publish /robot1/state"] * 40, END]
    done = run(maze_node, lines, "topic_prefix:=/robot1/", "publish_state:=true", "period:=0.001")
    assert done.returncode == 0, done.stderr
    found = sent(done.stdout)
    assert {name for _, name, _ in found} <= {f"/robot1/{name}" for name in ("cmd_vel", "state", *ROTATIONS)}
    texts = [data for _, name, data in found if name == "/robot1/state"]
    taken = []
    for text in texts:
        state = states_of(text)
        assert state["definition"]["name"] == "MazeSolver"
        assert state["current"]["LidarSensor"]["variables"].keys() == {"front", "right", "back_right"}
        assert state["communications"] == {}
        taken += state["transitions"]
    numbers = {
        transition["id"]
        for component in state["definition"]["components"]
        for item in component.get("behaviour", {}).get("states", ())
        for transition in item["transitions"]
    }
    assert taken
    assert set(taken) <= numbers


ROTATIONS = ("rotate_left", "rotate_right")


def drives(sent_by_node: list[tuple[str, str, str]]) -> list[bool]:
    """Return for each command to the wheels whether they turn."""
    return [bool(numbers_of(data)) for word, name, data in sent_by_node if (word, name) == ("publish", "/cmd_vel")]


CONFIGURED = ["change configure", *SERVERS]
COUNTING = ["message /allowed 1", "message /order/count", "wait goal /count", "accept /count"]
CANCELLED = ["wait cancel /count", "refuse /count 0", "result /count 5"]
MANAGED = ("period:=0.01", "autostart:=false")


def test_others_manage_the_node(courier_node: Path, tmp_path: Path) -> None:
    lines = [
        *CONFIGURED,
        # It is held.
        "message /order/power",
        "change activate",
        "wait call /power",
        "answer /power 1 fine",
        *COUNTING,
        "wait publish /cmd_vel",
        "change deactivate",
        *CANCELLED,
        "change activate",
        "message /order/wind",
        "wait call /wind",
        "change deactivate",
        "change cleanup",
        "set period 0.02",
        "change configure",
        "change shutdown",
    ]
    done = run(courier_node, lines, *MANAGED, f"log_folder:={tmp_path}")
    assert done.returncode == 0, done.stderr
    found = sent(done.stdout)
    states = [(name, data) for word, name, data in found if word == "state"]
    asked = ["configure 2", "activate 3", "deactivate 2", "activate 3", "deactivate 2", "cleanup 1", "configure 2"]
    assert [" ".join(item) for item in states] == [*asked, "shutdown 4"]
    doings = [(word, name) for word, name, _ in found]
    assert doings.index(("state", "activate")) < doings.index(("call", "/power"))
    assert drives(found)[-1] is False
    # The wheels stop before the goal is cancelled, and both before the answer to the node's manager.
    place = doings.index(("state", "deactivate"))
    assert doings[place - 2 : place] == [("publish", "/cmd_vel"), ("cancel", "/count")]
    # Each configuration begins a log.
    logs = [[json.loads(line)["kind"] for line in file.read_text().splitlines()] for file in tmp_path.iterdir()]
    inactive, active = sorted(logs, key=len)
    assert "event" not in inactive
    assert (active.count("stop"), active.count("restart")) == (2, 1)


def test_parameters_are_taken_when_the_node_is_configured(courier_node: Path) -> None:
    lines = ["set period fast", "change configure", "set period 0.05", *CONFIGURED, "set period 0.1", "change activate"]
    done = run(courier_node, [*lines, "set autostart true", "change shutdown"], *MANAGED)
    assert done.returncode == 0
    refused = "a node takes its parameters when it is configured"
    found = [data for word, _, data in sent(done.stdout) if word == "set"]
    assert found == ["done", "done", refused, "parameter 'autostart' cannot be set because it is read-only"]
    states = [data for word, name, data in sent(done.stdout) if (word, name) == ("state", "configure")]
    assert states == ["1", "2"]
    assert "[ERROR] parameter 'period' is 'fast'; it must be" in done.stderr
    # A node that starts itself has taken them.
    done = run(courier_node, ["set period 0.1", END])
    assert [data for word, _, data in sent(done.stdout) if word == "set"] == [
        "parameter 'period' cannot be set because it is read-only"
    ]


def test_a_fault_of_a_managed_node_leaves_it_at_rest(courier_node: Path) -> None:
    fault = [*COUNTING, "message /allowed 0", "wait cancel /count", "refuse /count 1", *A_WHILE]
    again = ["result /count 5", "change deactivate", "change activate", "message /order/power", "wait call /power"]
    parameters = (*WATCHED, "autostart:=false")
    done = run(courier_node, [*CONFIGURED, "change activate", *fault, *again, "change shutdown"], *parameters)
    assert done.returncode == 0
    assert "[ERROR] stopped: the cancel of a running goal was refused" in done.stderr
    assert ("call", "/power", "{data: true}") in sent(done.stdout)
    # Left in that state, it says so.
    done = run(courier_node, [*CONFIGURED, "change activate", *fault, "change shutdown"], *parameters)
    assert done.returncode == 1
    assert done.stderr.endswith("courier_controller: the cancel of a running goal was refused\n")


def test_the_end_of_a_container_stops_the_robot(courier_node: Path) -> None:
    done = run(courier_node, [*DRIVING, "accept /count", "wait publish /cmd_vel", "end"], "period:=0.01")
    found = sent(done.stdout)
    # The zero goes out again: the cancel is not answered here, which is a fault.
    assert drives(found) == [True, False, False]
    assert [word for word, name, _ in found if name == "/count"] == ["goal", "cancel"]


def test_names_without_a_slash_are_found_in_the_namespace(maze_node: Path) -> None:
    lines = [f"message /scan {' '.join(['3.0'] * 360)}", *["wait publish /robot1/state"] * 3, END]
    done = run(maze_node, lines, "publish_state:=true", "period:=0.001", namespace="/robot1")
    assert done.returncode == 0, done.stderr
    # The model's own names are absolute.
    assert {name for _, name, _ in sent(done.stdout)} <= {"/robot1/state", "/cmd_vel", *(f"/{n}" for n in ROTATIONS)}


def test_it_says_what_it_is_and_what_it_waits_for(courier_node: Path, maze_node: Path) -> None:
    done = run(
        courier_node,
        ["server /wind 1", *["wait publish /diagnostics"], *SERVERS, *A_WHILE, END],
        *WATCHED,
        level="info",
    )
    lines = done.stderr.splitlines()
    assert re.fullmatch(
        r"\[INFO\] controller of the robot Courier: courier_controller \S+, generated by RoboSC \S+", lines[0]
    )
    assert lines[1:5] == [
        "[INFO] waiting for the servers of /power, /wind, /count, /arm/reach",
        "[INFO] waiting for the servers of /power, /count, /arm/reach",
        "[INFO] every server is there",
        "[INFO] running",
    ]
    scan = f"message /scan {' '.join(['3.0'] * 360)}"
    done = run(maze_node, ["wait publish /state", scan, "wait publish /state", END], *WATCHED, PATIENT, level="info")
    assert done.stderr.splitlines()[1:3] == ["[INFO] waiting for the first message of /scan", "[INFO] running"]


def test_simulated_time_may_stand_and_go_back(maze_node: Path, tmp_path: Path) -> None:
    scan = f"message /scan {' '.join(['3.0'] * 360)}"
    # A report each second of the steady clock: far longer than the scan may be old.
    paused = ["wait publish /diagnostics"] * 2
    lines = ["clock 100", scan, *paused, "clock 100.25", "wait publish /state", "clock 50", scan, END]
    parameters = ("use_sim_time:=true", "period:=0.1", "publish_state:=true", f"log_folder:={tmp_path}")
    done = run(maze_node, lines, *parameters)
    assert done.returncode == 0
    assert done.stderr.splitlines() == [
        "[WARN] use_sim_time is true: no time passes before the first message on /clock",
        "[WARN] time has gone back by 50.250 s: beginning anew",
    ]
    kinds = [(entry["kind"], entry.get("what")) for entry in entries_of(tmp_path) if entry["kind"] != "event"]
    assert ("stop", "time has gone back by 50.250 s") in kinds
    assert ("restart", "") in kinds


def test_where_nothing_is_acknowledged_the_last_messages_get_time(maze_node: Path) -> None:
    lines = ["wait publish /state", END]
    began_s = time.monotonic()
    done = run(maze_node, lines, "publish_state:=true", PATIENT, middleware="rmw_zenoh_cpp")
    assert (done.returncode, done.stderr) == (0, "")
    assert time.monotonic() - began_s >= 0.3
