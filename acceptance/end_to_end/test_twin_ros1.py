"""The twin as a ROS 1 node, and both scenarios of the paper on it: generated nodes and helper nodes on rospy."""

import json
import math
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from robosc_experiments.ros1 import run_line, run_maze
from robosc_experiments.scenario import Outcome
from support.process import Process
from support.ros1 import Master, Peer, clean_environment, missing, until
from support.waiting import wait_until

pytestmark = [pytest.mark.ros1, pytest.mark.skipif(missing() is not None, reason=str(missing())), pytest.mark.real_time]

TWIN = (sys.executable, "-m", "robosc_simulated.ros.ros1")
TWIST = "geometry_msgs/Twist"
TYPES = {
    "/clock": "rosgraph_msgs/Clock",
    "/scan": "sensor_msgs/LaserScan",
    "/odom": "nav_msgs/Odometry",
    "/battery_state": "sensor_msgs/BatteryState",
    "/camera/image_raw": "sensor_msgs/Image",
}


@pytest.fixture(scope="module")
def master(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Master]:
    with Master(tmp_path_factory.mktemp("master")) as made:
        yield made


@pytest.fixture
def peer(master: Master, tmp_path: Path) -> Iterator[Peer]:
    with Peer(master, tmp_path / "peer", f"peer_{os.getpid()}") as made:
        yield made


@pytest.fixture
def serve(master: Master, tmp_path: Path) -> Iterator[Callable[..., tuple[Process, int]]]:
    """Starts a twin: the process, and where to write its commands."""
    with ExitStack() as stack:

        def start(*arguments: str, **variables: str) -> tuple[Process, int]:
            read, write = os.pipe()
            stack.callback(os.close, write)
            # It is of this interpreter, unlike the other nodes.
            ours = {**os.environ, **{name: value for name, value in master.variables.items() if "ROS" in name}}
            try:
                process = Process([*TWIN, *arguments], {**ours, **variables}, tmp_path / "twin", read)
            finally:
                os.close(read)
            return stack.enter_context(process), write

        yield start


@pytest.mark.smoke
def test_other_nodes_see_a_turtlebot(serve: Callable[..., tuple[Process, int]], peer: Peer, tmp_path: Path) -> None:
    motion = tmp_path / "motion.jsonl"
    twin, commands = serve("--scene", "line-oval", "--speed", "5", "--motion", str(motion))
    for topic, kind in TYPES.items():
        peer.subscribe(topic, kind)
    until(lambda: all(peer.received[topic] for topic in TYPES), "a message of each kind", twin)
    scan, picture = peer.values("/scan")[0], peer.values("/camera/image_raw")[0]
    assert len(scan["ranges"]) == 360
    assert scan["header"]["frame_id"] == "base_scan"
    assert (scan["angle_min"], scan["angle_increment"]) == pytest.approx((0.0, math.tau / 360))
    assert (scan["range_min"], scan["range_max"]) == pytest.approx((0.12, 3.5))
    assert scan["ranges"][0] == pytest.approx(2.0 + 0.032, abs=0.01)
    assert (picture["encoding"], picture["width"], picture["height"], picture["step"]) == ("mono8", 160, 120, 160)
    assert peer.values("/battery_state")[0]["voltage"] == pytest.approx(12.0)

    def odometry() -> Any:
        return peer.values("/odom")[-1]

    peer.advertise("/cmd_vel", TWIST)
    until(
        lambda: odometry()["pose"]["pose"]["position"]["x"] > 0.4,
        "the robot to drive",
        twin,
        lambda: peer.publish("/cmd_vel", TWIST, linear={"x": 0.2}),
    )
    until(lambda: odometry()["twist"]["twist"]["linear"]["x"] == 0.0, "a velocity to end that nobody repeats", twin)

    behind_m = peer.values("/scan")[-1]["ranges"][0]
    os.write(commands, b"obstacle box 1.2 0.0\ncollisions\n")
    until(lambda: peer.values("/scan")[-1]["ranges"][0] < behind_m - 0.3, "the box to be seen", twin)
    until(lambda: "collisions 0" in twin.stdout, "an answer", twin)

    twin.signal(signal.SIGTERM)
    assert twin.wait() == 0
    # The master has forgotten its node.
    wait_until(lambda: "/turtlebot3_twin" not in str(peer.names()), "the node to be gone")
    last = [json.loads(line) for line in motion.read_text().splitlines() if '"happening"' not in line][-1]
    assert last["x_m"] == pytest.approx(odometry()["pose"]["pose"]["position"]["x"], abs=0.1)


def test_it_takes_other_names_as_every_node_does(serve: Callable[..., tuple[Process, int]], peer: Peer) -> None:
    twin, _ = serve("__name:=front", "/scan:=/front/scan", "--scene", "room")
    peer.subscribe("/front/scan", TYPES["/scan"])
    until(lambda: bool(peer.received["/front/scan"]), "a scan under its other name", twin)
    assert "/front" in str(peer.names())
    assert peer.ends("/front/scan") == ["/front"]


@pytest.fixture
def tf_messages(tmp_path: Path) -> Path:
    """The package tf2_msgs, made of its definition as ROS 1's own build does: where to import it from."""
    maker, definitions = Path("/usr/lib/genpy/genmsg_py.py"), Path("/usr/share/geometry_msgs/msg")
    if not (maker.exists() and definitions.exists()):
        pytest.skip("genpy, or the definitions of geometry_msgs, are not installed")
    definition = tmp_path / "TFMessage.msg"
    definition.write_text("geometry_msgs/TransformStamped[] transforms\n")
    package = tmp_path / "python" / "tf2_msgs" / "msg"
    package.mkdir(parents=True)
    (package.parent / "__init__.py").touch()
    includes = [f"-I{name}:/usr/share/{name}/msg" for name in ("geometry_msgs", "std_msgs")]
    command = ["/usr/bin/python3", str(maker), "-p", "tf2_msgs", *includes, "-o", str(package)]
    subprocess.run([*command, str(definition)], env=clean_environment(), check=True, capture_output=True)
    subprocess.run([*command, "--initpy"], env=clean_environment(), check=True, capture_output=True)
    return tmp_path / "python"


def test_transforms_say_where_the_robot_and_its_parts_are(
    serve: Callable[..., tuple[Process, int]], master: Master, tf_messages: Path, tmp_path: Path
) -> None:
    paths = os.pathsep.join((str(tf_messages), os.environ.get("PYTHONPATH", "")))
    twin, _ = serve("--scene", "line-oval", PYTHONPATH=paths)
    code = (
        "import rospy, sys\n"
        "from tf2_msgs.msg import TFMessage\n"
        "rospy.init_node('listener')\n"
        "for topic in ('/tf_static', '/tf'):\n"
        "    found = rospy.wait_for_message(topic, TFMessage, 20)\n"
        "    print(' '.join(f'{each.header.frame_id}>{each.child_frame_id}' for each in found.transforms))\n"
    )
    found = subprocess.run(
        ["/usr/bin/python3", "-c", code],
        env={**master.variables, "PYTHONPATH": str(tf_messages)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert found.stdout.splitlines() == [
        "base_footprint>base_link base_link>base_scan base_link>camera_link",
        "odom>base_footprint",
    ], found.stderr + twin.stderr


def test_the_rospy_side_ends_with_a_twin_that_was_killed(serve: Callable[..., tuple[Process, int]], peer: Peer) -> None:
    twin, _ = serve()
    until(lambda: "ready" in twin.stdout, "the twin", twin)
    assert "/turtlebot3_twin" in str(peer.names())
    twin.popen.kill()
    wait_until(lambda: "/turtlebot3_twin" not in str(peer.names()), "the node to be gone")


def test_a_twin_whose_rospy_side_is_gone_says_so(serve: Callable[..., tuple[Process, int]]) -> None:
    twin, _ = serve()
    until(lambda: "ready" in twin.stdout, "the twin", twin)
    children = Path(f"/proc/{twin.popen.pid}/task/{twin.popen.pid}/children").read_text().split()
    (side,) = (int(child) for child in children)
    os.kill(side, signal.SIGKILL)
    assert twin.wait() == 1
    assert "its rospy side has ended with status -9" in twin.stderr


def test_it_waits_for_a_master_until_it_is_interrupted(serve: Callable[..., tuple[Process, int]]) -> None:
    twin, _ = serve(ROS_MASTER_URI="http://127.0.0.1:9")
    wait_until(lambda: "master" in twin.stderr, "a word about the master")
    assert twin.is_running
    assert "ready" not in twin.stdout
    twin.signal(signal.SIGINT)
    assert twin.wait() == 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--scene", "nowhere"], "there is no scene and no file 'nowhere'"),
        (["--python", "/nowhere/python"], "there is no Python of ROS 1 at /nowhere/python"),
        # This interpreter has no rospy.
        (["--python", sys.executable], "ROS 1 is not there (No module named 'rospy')"),
    ],
)
def test_what_cannot_be_served_is_one_clear_line(
    serve: Callable[..., tuple[Process, int]], arguments: list[str], said: str
) -> None:
    twin, _ = serve(*arguments)
    assert twin.wait() == 1
    (line,) = twin.stderr.splitlines()
    assert said in line


def test_a_helper_says_in_one_line_what_is_wrong_with_a_parameter(master: Master, tmp_path: Path) -> None:
    package = Path(__file__).parents[2] / "examples" / "robosc_examples"
    command = ["/usr/bin/python3", "-m", "robosc_examples.ros1.rotator", "_tolerance:=-1"]
    found = subprocess.run(
        command, env={**master.variables, "PYTHONPATH": str(package)}, capture_output=True, text=True, check=False
    )
    assert (found.returncode, found.stderr) == (
        2,
        "rotator: parameter 'tolerance' is -1; it must be a number from 0.05 to 45\n",
    )


def test_the_maze_solver_gets_out_of_the_spiral(tmp_path: Path, record_property: Callable[[str, object], None]) -> None:
    outcome = run_maze(tmp_path / "run", "maze-spiral", speed=6.0, say=lambda line: None)
    assert outcome.faults == ()
    assert outcome.figures["collisions"] == 0.0
    assert outcome.connection == "ros1"
    assert all(path.is_file() for path in (outcome.event_log, outcome.motion, outcome.supervisor))
    record_property("maze over ROS 1", f"{outcome.figures['speed']:.1f} times real time")


def blocked(outcome: Outcome) -> int:
    """Return the number of velocities that were held back."""
    return sum('"kind":"blocked"' in line for line in outcome.event_log.read_text().splitlines())


def test_a_careless_line_follower_keeps_the_line_and_stands_when_it_must(
    tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    outcome = run_line(tmp_path / "run", "line-oval", speed=5.0, say=lambda line: None)
    assert outcome.faults == ()
    assert outcome.figures["aside_most_m"] < 0.03
    assert outcome.figures["collisions"] == 0.0
    assert blocked(outcome) > 5
    record_property("lateral error over ROS 1", f"{1000 * outcome.figures['aside_rms_m']:.1f} mm (RMS)")
