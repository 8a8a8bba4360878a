"""The way of a model onto ROS 2, start to end: model -> gRPC service -> ROS 2 package -> running node -> moving robot.

Starts the synthesis server, lets the client send it the line follower, starts the generated controller
and a simulated robot as processes of their own on real ROS 2 topics, shows what happened and judges it.
Everything it writes lies in a temporary folder; nothing is left behind, also after Ctrl-C.

Usage: line_follower.py [--model FILE]
"""

import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from judge import judge_log, judge_motion, read_lines, table
from robosc_experiments.domains import own_domain

ROOT = Path(__file__).resolve().parents[2]
MODEL = ROOT / "examples" / "line_follower" / "line_follower.rscd"
MAINTAINER = "A Robot's Owner <owner@example.org>"
START_LIMIT_S = 30.0
RUN_LIMIT_S = 60.0
STOP_LIMIT_S = 5.0

# Fast DDS announces itself at once and often with this profile; its default finds peers seconds later now and then.
DISCOVERY_PROFILE = """<?xml version="1.0" encoding="UTF-8"?>
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <participant profile_name="demo" is_default_profile="true"><rtps><builtin><discovery_config>
    <initialAnnouncements><count>30</count><period><sec>0</sec><nanosec>50000000</nanosec></period></initialAnnouncements>
    <leaseAnnouncement><sec>0</sec><nanosec>250000000</nanosec></leaseAnnouncement>
  </discovery_config></builtin></rtps></participant>
</profiles>
"""


class DemoError(Exception):
    """A step of the demonstration that failed, in one sentence."""


def say(text: str) -> None:
    """A line for the user, at once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


@contextmanager
def process(
    name: str, command: Sequence[str], environment: dict[str, str], log: Path
) -> Iterator[subprocess.Popen[str]]:
    """A child in a session of its own, so that Ctrl-C reaches only us and we stop it in order."""
    with log.open("w", encoding="utf-8") as output:
        child = subprocess.Popen(
            command,
            env=environment,
            cwd=log.parent,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            text=True,
        )
    try:
        yield child
    finally:
        stop(name, child)


def stop(name: str, child: subprocess.Popen[str]) -> None:
    """End a child and whatever it started: first politely, so that a robot comes to rest."""
    if child.poll() is None:
        child.terminate()
        try:
            child.wait(STOP_LIMIT_S)
        except subprocess.TimeoutExpired:
            say(f"{name} did not stop when asked; killing it")
    with suppress(ProcessLookupError):
        os.killpg(child.pid, signal.SIGKILL)
    child.wait()


def ros_environment(folder: Path, domain: int) -> dict[str, str]:
    """ROS 2 on this machine only, in a domain of our own, with its logs in our folder."""
    profile = folder / "discovery.xml"
    profile.write_text(DISCOVERY_PROFILE, encoding="utf-8")
    return {
        **os.environ,
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": str(domain),
        "ROS_LOG_DIR": str(folder / "ros_log"),
        "FASTRTPS_DEFAULT_PROFILES_FILE": str(profile),
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONUNBUFFERED": "1",
    }


def tool(name: str) -> str:
    """A console script of the environment that runs this file."""
    path = shutil.which(name, path=str(Path(sys.executable).parent))
    if path is None:
        raise DemoError(f"{name} is not installed beside {sys.executable}; run `make environment`")
    return path


def wait_for_line(child: subprocess.Popen[str], log: Path, pattern: str, what: str) -> re.Match[str]:
    """Wait until a child has printed a line."""
    limit = time.monotonic() + START_LIMIT_S
    while time.monotonic() < limit:
        found = re.search(pattern, log.read_text(encoding="utf-8"), re.MULTILINE)
        if found:
            return found
        if child.poll() is not None:
            break
        time.sleep(0.05)
    raise DemoError(f"{what} did not start:\n{log.read_text(encoding='utf-8')}")


def run_client(arguments: Sequence[str], environment: dict[str, str]) -> None:
    """One call of the client, its output shown as it comes."""
    say(f"$ robosc-client {' '.join(arguments)}")
    result = subprocess.run(
        [tool("robosc-client"), *arguments], env=environment, stdin=subprocess.DEVNULL, timeout=RUN_LIMIT_S, check=False
    )
    if result.returncode != 0:
        raise DemoError(f"robosc-client ended with status {result.returncode}")


def run(folder: Path, model_path: Path) -> list[str]:
    """The whole demonstration with one model; returns what was wrong."""
    with ExitStack() as stack:
        environment = ros_environment(folder, stack.enter_context(own_domain()))
        server_log = folder / "server.log"
        server = stack.enter_context(
            process(
                "the server",
                [tool("robosc-server"), "--port", "0", "--state-dir", str(folder / "server")],
                environment,
                server_log,
            )
        )
        address = wait_for_line(server, server_log, r"listening on (\S+:\d+)$", "the server")[1]
        say(f"robosc-server listens on {address}")
        model = os.path.relpath(model_path)
        supervisor, package = folder / "line_follower.rsup", folder / "package"
        run_client(["synth", model, "--server", address, "-o", str(supervisor)], environment)
        generation = ["generate", model, "--server", address, "--target", "ros2", "-o", str(package)]
        run_client([*generation, "--maintainer", MAINTAINER], environment)
        (name,) = [path.parent.name for path in package.glob("*/node.py")]
        log, record = folder / "events", folder / "robot.jsonl"
        node = stack.enter_context(
            process(
                "the controller",
                [sys.executable, "-m", f"{name}.node", "--ros-args", "-p", "period:=0.05", "-p", f"log_folder:={log}"],
                {**environment, "PYTHONPATH": os.pathsep.join([str(package), environment.get("PYTHONPATH", "")])},
                folder / "node.log",
            )
        )
        robot = stack.enter_context(
            process(
                "the robot",
                [sys.executable, str(Path(__file__).with_name("simulated_robot.py")), str(record)],
                environment,
                folder / "robot.log",
            )
        )
        say("the generated controller and the simulated robot are running (about ten seconds)")
        wait_for_robot(robot, node, folder)
        stop("the controller", node)
        if node.returncode != 0:
            raise DemoError(f"the controller ended with status {node.returncode}:\n{(folder / 'node.log').read_text()}")
    return judge(next(log.glob("*.jsonl")), record)


def wait_for_robot(robot: subprocess.Popen[str], node: subprocess.Popen[str], folder: Path) -> None:
    """Wait for the end of the scenario, and for nothing if the controller has died."""
    limit = time.monotonic() + RUN_LIMIT_S
    while robot.poll() is None:
        if node.poll() is not None:
            raise DemoError(f"the controller ended by itself:\n{(folder / 'node.log').read_text()}")
        if time.monotonic() > limit:
            raise DemoError("the scenario did not end in time")
        time.sleep(0.05)
    if robot.returncode != 0:
        raise DemoError(f"the robot failed:\n{(folder / 'robot.log').read_text()}")


def judge(log: Path, record: Path) -> list[str]:
    """Show the sequence of events and say what was wrong."""
    entries = read_lines(log)
    say("")
    say(table(entries))
    say("")
    faults, remarks = judge_motion(read_lines(record))
    faults = judge_log(entries) + faults
    for remark in remarks:
        say(f"  {remark}")
    moves = sum(entry.get("event") == "move.request" for entry in entries)
    say(f"  move was requested {moves} times")
    return faults


def read_arguments() -> Path:
    """The model to run."""
    parser = argparse.ArgumentParser(
        description="Generate a line follower's controller, run it with a simulated robot, and judge what it did.",
        epilog="A model of your own needs the messages of examples/line_follower, with the same identifiers, and the "
        "states that its requirements name: the simulated robot and the checks know these.",
    )
    parser.add_argument("--model", type=Path, default=MODEL, metavar="FILE", help="the model (default: the example's)")
    model: Path = parser.parse_args().model
    if not model.is_file():
        parser.error(f"there is no file {model}")
    return model


def main() -> int:
    """Run the demonstration; 0 if the robot did what its requirements say."""
    model = read_arguments()
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.default_int_handler)
    try:
        with tempfile.TemporaryDirectory(prefix="robosc-line-follower-") as folder:
            faults = run(Path(folder), model)
    except KeyboardInterrupt:
        sys.stderr.write("interrupted; everything is stopped\n")
        return 130
    except (DemoError, subprocess.TimeoutExpired) as error:
        sys.stderr.write(f"line_follower: {error}\n")
        return 1
    for fault in faults:
        sys.stderr.write(f"FAULT: {fault}\n")
    if not faults:
        say("passed: it moved only with a line, a clear LiDAR and in service, and stood still in time")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
