"""Servers of generated ROS 1 nodes, in Python and C++, that are killed, doubled or silent; and what health says."""

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from support.driver_ros1 import LANGUAGES, Driver, start_of
from support.ros1 import Peer, missing, until
from support.waiting import wait_until

pytestmark = [
    pytest.mark.ros1,
    pytest.mark.skipif(missing() is not None, reason=str(missing())),
]


@pytest.fixture(params=LANGUAGES)
def driver(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, tmp_path: Path
) -> Iterator[Driver]:
    made = Driver(start_of(request.param, tmp_path, tmp_path_factory), tmp_path)
    with made.ends:
        yield made


@pytest.mark.parametrize("name", ["server", "another"])
@pytest.mark.parametrize("is_named", [True, False])
def test_a_killed_server_is_lost_when_another_one_takes_its_place(driver: Driver, name: str, is_named: bool) -> None:
    server = driver.server()
    driver.start()
    if is_named:
        driver.drive(server)
    else:
        # A goal that the server has not named, and no longer will.
        driver.until(lambda: bool(driver.events("pressed.response")), "the button", press="pressed")
        driver.until(
            lambda: bool(server.goals["/go"]) or bool(driver.events("go.request")), "a request", press="pressed"
        )
        server.stop()
    failed = len(driver.events("go.error"))
    server._process.kill()
    server._process.wait()
    other = driver.server(name)
    driver.until(lambda: len(driver.events("go.error")) > failed, "the loss")
    assert driver.events("go.error")[-1]["data"] in ("lost", None)
    driver.until(lambda: bool(other.goals["/go"]), "a goal of the new one", press="pressed")


def test_a_call_of_a_killed_service_has_failed(driver: Driver) -> None:
    server = driver.server()
    driver.start("service_timeout:=1000.0")
    driver.until(lambda: bool(server.requests["/reach"]), "a call", press="wanted")
    failed = len(driver.events("reach.error"))
    server.die()
    driver.until(lambda: len(driver.events("reach.error")) > failed, "the failure")
    other = driver.server()
    driver.until(lambda: bool(other.requests["/reach"]), "a call of the new one", press="wanted")


def test_two_servers_at_work_are_worth_a_warning_and_lose_no_goal(driver: Driver) -> None:
    server = driver.server()
    driver.start()
    driver.drive(server)
    failed = len(driver.events("go.error"))
    second = driver.server("second")
    driver.until(lambda: driver.warns("2 servers of /go: /second, /server"), "a warning")
    count = len(driver.peer.values("/diagnostics"))
    driver.until(lambda: len(driver.peer.values("/diagnostics")) > count + 3, "more reports")
    assert len(driver.events("go.error")) == failed
    assert not server.cancels["/go"] and not second.goals["/go"]
    # The one that has the goal ends it.
    server.do("end", name="/go", how="succeeded", message={"result": 1})
    driver.until(lambda: bool(driver.events("go.response")), "the end")


def test_a_server_without_results_is_worth_a_warning(driver: Driver) -> None:
    server = driver.server(gives_results=False)
    driver.start()
    driver.drive(server)
    failed = len(driver.events("go.error"))
    server.do("end", name="/go", how="succeeded", message={"result": 1})
    driver.until(lambda: driver.warns("the server of /go gives no result of a goal that ended"), "a warning")
    driver.until(lambda: len(driver.events("go.error")) > failed, "the error")
    driver.until(lambda: driver.warns("the server of /go gave no result of a goal that ended"), "another warning")


def test_a_receiver_and_a_sender_of_another_type_are_worth_a_warning(driver: Driver) -> None:
    other = driver.ends.enter_context(Peer(driver.master, driver.folder / "other", "base"))
    other.subscribe("/cmd_vel", "geometry_msgs/TwistStamped")
    other.advertise("/wanted", "std_msgs/String")
    driver.start()
    for text in (
        "/cmd_vel: /base takes geometry_msgs/TwistStamped, this node sends geometry_msgs/Twist",
        "/wanted: /base sends std_msgs/String, this node takes std_msgs/Bool",
    ):
        driver.until(lambda text=text: driver.warns(text), "a warning")  # type: ignore[misc]


def test_simulated_time_that_does_not_come_is_worth_a_warning(driver: Driver) -> None:
    driver.server()
    driver.master.set_parameter("/use_sim_time", True)
    driver.start()
    driver.until(lambda: driver.warns("no time has come on /clock"), "a warning")
    passed = [0]

    def pass_time() -> None:
        passed[0] += 1
        driver.peer.publish("/clock", "rosgraph_msgs/Clock", clock={"secs": passed[0], "nsecs": 0})

    until(lambda: driver.health() == (0, "running"), "all well", driver.node, pass_time)
    driver.until(lambda: driver.warns("the time of /clock stands still"), "a warning")
    driver.stops(0)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_goal_that_is_accepted_after_a_signal_is_cancelled(driver: Driver, number: signal.Signals) -> None:
    server = driver.server()
    driver.start(waits_s=60.0)
    driver.until(lambda: driver.health() == (0, "running"), "the node to run")
    server.stop()
    driver.until(lambda: bool(driver.events("go.request")), "a request", press="pressed")
    driver.node.signal(number)
    wait_until(lambda: any(entry["kind"] == "stop" for entry in driver.entries), "the stop")
    server.go_on()
    assert driver.node.wait() == 0, driver.node.stderr
    wait_until(lambda: server.cancels["/go"] > 0, "the cancel")
    assert len(server.goals["/go"]) == 1


def test_a_goal_that_is_not_accepted_in_time_is_named_and_its_cancel_left(driver: Driver) -> None:
    server = driver.server()
    driver.start(waits_s=60.0)
    driver.until(lambda: driver.health() == (0, "running"), "the node to run")
    server.stop()
    driver.until(lambda: bool(driver.events("go.request")), "a request", press="pressed")
    driver.stops(1)
    text = "a goal of /go may be running: its server has not answered it"
    assert text in driver.node.stderr.splitlines()[-1]
    server.go_on()
    wait_until(lambda: server.cancels["/go"] > 0, "the cancel")


def test_a_goal_whose_server_hangs_is_named_at_a_stop(driver: Driver) -> None:
    server = driver.server()
    driver.start()
    driver.drive(server)
    server.stop()
    driver.stops(1)
    text = "a goal of /go may be running: its server has not answered its cancel"
    assert text in driver.node.stderr.splitlines()[-1]
    server.go_on()
