"""Generated rclcpp nodes among servers that are killed, doubled or silent, on a stand-in for rclcpp."""

from pathlib import Path

import pytest

from support import rclcpp_nodes
from support.node_logs import entries_of
from support.rclcpp_nodes import SANITIZERS, compiled_once, missing, run

pytestmark = [
    pytest.mark.skipif(
        missing("geometry_msgs", "sensor_msgs", "std_srvs", "test_msgs") is not None,
        reason=str(missing("geometry_msgs", "sensor_msgs", "std_srvs", "test_msgs")),
    ),
]

END = "signal 15"
STATUS, REPLY = "/count/_action/status", "rr/powerReply"
WATCHED = ("period:=0.025", "publish_state:=true")
SERVERS = [f"server {name} 1" for name in ("/power", "/wind", "/count", "/arm/reach")]
A_SECOND = ["wait publish /state"] * 40
ENDED = ["accept /count", "wait cancel /count", "refuse /count 0", "result /count 5"]
"""Answers that let a node with another goal under way end well."""


@pytest.fixture(scope="module")
def courier_node(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled_once(rclcpp_nodes.courier(), tmp_path_factory, *SANITIZERS)


def events_of(folder: Path) -> list[str]:
    return [entry["event"] for entry in entries_of(folder) if entry["kind"] == "event"]


def driving(*shown: str) -> list[str]:
    """A goal is under way at servers that are shown so."""
    return [
        *SERVERS,
        f"shown {STATUS} {' '.join(shown)}",
        "message /allowed 1",
        "message /order/count",
        "wait goal /count",
        "accept /count",
    ]


GONE = ["asked /count 1 1", f"shown {STATUS} 1:server 2:server", *A_SECOND, *A_SECOND, *A_SECOND]


def test_a_killed_server_is_lost_when_no_living_one_knows_the_goal(courier_node: Path, tmp_path: Path) -> None:
    # It is cancelled all the same: its server may be slow, and not dead.
    lines = [*driving("1:server"), *A_SECOND, *GONE, "wait cancel /count", "refuse /count 2", END]
    done = run(courier_node, lines, *WATCHED, f"log_folder:={tmp_path}")
    assert done.returncode == 0
    assert "[WARN] 2 servers of /count: /server, /server" in done.stderr
    assert events_of(tmp_path).count("count.error") == 1


@pytest.mark.parametrize("asked", ["2 1", "0 0", "0 1", "1 0"])
def test_a_goal_that_a_living_server_may_know_is_not_lost(courier_node: Path, tmp_path: Path, asked: str) -> None:
    shown = f"shown {STATUS} 1:server 2:another"
    lines = [*driving("1:server"), f"asked /count {asked}", shown, *A_SECOND * 3, END, *ENDED[1:]]
    done = run(courier_node, lines, *WATCHED, f"log_folder:={tmp_path}")
    assert done.returncode == 0
    assert "[WARN] 2 servers of /count: /another, /server" in done.stderr
    stop = next(k for k, entry in enumerate(entries_of(tmp_path)) if entry["kind"] == "stop")
    assert "count.error" not in [entry.get("event") for entry in entries_of(tmp_path)[:stop]]


def test_other_endpoints_in_the_place_of_a_servers_are_another_one(courier_node: Path, tmp_path: Path) -> None:
    lines = [
        *driving("1:server"),
        f"shown {STATUS} 2:server",
        *A_SECOND * 2,
        "wait cancel /count",
        "refuse /count 2",
        END,
    ]
    done = run(courier_node, lines, *WATCHED, f"log_folder:={tmp_path}")
    assert (done.returncode, done.stderr) == (0, "")
    assert events_of(tmp_path).count("count.error") == 1


@pytest.mark.parametrize(("other", "count"), [("2:server", 1), ("2:another", 0)])
def test_a_call_has_failed_when_another_process_has_the_name(
    courier_node: Path, tmp_path: Path, other: str, count: int
) -> None:
    lines = [
        *SERVERS,
        f"shown {REPLY} 1:server",
        "message /order/power",
        "wait call /power",
        f"shown {REPLY} 1:server {other}",
        *A_SECOND * 2,
        END,
    ]
    done = run(courier_node, lines, *WATCHED, "service_timeout:=0.0", f"log_folder:={tmp_path}")
    assert done.returncode == 0
    assert events_of(tmp_path).count("power.error") == count


@pytest.mark.parametrize("result", ["none", "unknown"])
def test_a_server_without_results_is_worth_a_warning(courier_node: Path, tmp_path: Path, result: str) -> None:
    ends = ["status /count 4", *A_SECOND * 6] if result == "none" else ["result /count 0", *A_SECOND * 2]
    done = run(courier_node, [*driving("1:server"), *ends, END], *WATCHED, f"log_folder:={tmp_path}")
    assert done.returncode == 0
    expected = {
        "none": [
            "[WARN] the server of /count gives no result of a goal that ended",
            "[WARN] the server of /count gave no result of a goal that ended",
        ],
        "unknown": ["[WARN] the server of /count did not know a goal that it had accepted"],
    }
    assert done.stderr.splitlines() == expected[result]
    assert events_of(tmp_path).count("count.error") == 1


def test_others_of_another_type_or_quality_are_worth_a_warning(courier_node: Path) -> None:
    lines = [
        *SERVERS,
        "shown /cmd_vel 1:base:geometry_msgs/msg/TwistStamped 2:log:geometry_msgs/msg/Twist "
        "5:late:geometry_msgs/msg/Twist:deadline 6:alive:geometry_msgs/msg/Twist:lease "
        "7:hand:geometry_msgs/msg/Twist:manual",
        "shown /allowed 3:button:std_msgs/msg/Bool:best_effort 4:_NODE_NAME_UNKNOWN_:std_msgs/msg/Bool",
        "offered /power std_srvs/srv/SetBool",
        "offered /power std_srvs/srv/Trigger",
        "offered /count/_action/send_goal test_msgs/action/NestedMessage_SendGoal",
        *A_SECOND * 2,
        END,
    ]
    done = run(courier_node, lines, *WATCHED)
    assert done.returncode == 0
    assert sorted(done.stderr.splitlines()) == [
        "[WARN] /allowed: /button sends and this node takes in vain: "
        "reliability best_effort is sent, reliable is taken",
        "[WARN] /cmd_vel: /alive takes and this node sends in vain: "
        "liveliness_lease_duration unlimited is sent, of 2 s is taken",
        "[WARN] /cmd_vel: /base takes geometry_msgs/msg/TwistStamped, this node sends geometry_msgs/msg/Twist",
        "[WARN] /cmd_vel: /hand takes and this node sends in vain: "
        "liveliness automatic is sent, manual_by_topic is taken",
        "[WARN] /cmd_vel: /late takes and this node sends in vain: deadline unlimited is sent, of 0.5 s is taken",
        "[WARN] /count: another node uses it as test_msgs/action/NestedMessage_SendGoal, this node as "
        "test_msgs/action/Fibonacci_SendGoal",
        "[WARN] /power: another node uses it as std_srvs/srv/Trigger, this node as std_srvs/srv/SetBool",
    ]


def test_simulated_time_that_does_not_come_or_stands_still_is_worth_a_warning(courier_node: Path) -> None:
    reports = ["wait publish /diagnostics"]
    lines = [*SERVERS, *reports * 2, "clock 100", *reports * 5, END]
    done = run(courier_node, lines, "use_sim_time:=true")
    assert done.returncode == 0
    assert done.stderr.splitlines() == [
        "[WARN] use_sim_time is true: no time passes before the first message on /clock",
        "[WARN] use_sim_time is true, and no time has come on /clock",
        "[WARN] use_sim_time is true, and the time of /clock stands still",
    ]


def test_a_goal_that_is_accepted_after_a_signal_is_cancelled(courier_node: Path) -> None:
    lines = [*driving("1:server")[:-1], END, *ENDED]
    done = run(courier_node, lines, *WATCHED)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(("accepts", "what"), [(False, "it"), (True, "its cancel")])
def test_a_goal_without_an_answer_at_a_stop_is_named_and_a_failure(
    courier_node: Path, accepts: bool, what: str
) -> None:
    lines = driving("1:server") if accepts else driving("1:server")[:-1]
    done = run(courier_node, [*lines, END], *WATCHED)
    assert done.returncode == 1
    text = f"a goal of /count may be running: its server has not answered {what}"
    assert text in done.stderr.splitlines()[-1]
