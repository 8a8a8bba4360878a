"""Real ROS 2 in tests: nodes as processes, a peer that talks to them, isolated domains, no fixed sleeps."""

import contextlib
import os
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from robosc_experiments.domains import own_domain
from support.process import Process

__all__ = ["Peer", "RosProcess", "environment", "own_domain"]

PEER_NODE, SERVERS_NODE = "test_peer", "test_servers"
OWN_NODES = frozenset({PEER_NODE, SERVERS_NODE})
"""Nodes of the tests themselves."""

DISCOVERY_LIMIT_S = 60.0
ORDERLY_END_S = 3.0
_LAST_WORDS_S = 2.0

_PROFILE = """<?xml version="1.0" encoding="UTF-8"?>
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <participant profile_name="fast_discovery" is_default_profile="true"><rtps><builtin><discovery_config>
    <initialAnnouncements><count>30</count><period><sec>0</sec><nanosec>50000000</nanosec></period></initialAnnouncements>
    <leaseAnnouncement><sec>0</sec><nanosec>250000000</nanosec></leaseAnnouncement>
  </discovery_config></builtin></rtps></participant>
</profiles>
"""


def environment(domain: int, folder: Path) -> dict[str, str]:
    """Variables for a process that talks on a domain: this machine only, quick discovery, strict messages."""
    folder.mkdir(parents=True, exist_ok=True)
    profile = folder / "fastdds.xml"
    profile.write_text(_PROFILE)
    return {
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": str(domain),
        "ROS_LOG_DIR": str(folder / "log"),
        "ROS_PYTHON_CHECK_FIELDS": "1",
        "FASTRTPS_DEFAULT_PROFILES_FILE": str(profile),
        # The name that it has from Kilted on.
        "FASTDDS_DEFAULT_PROFILES_FILE": str(profile),
    }


class RosProcess(Process):
    """A program on ROS 2.

    Args:
        command: Command to run, after the interpreter.
        variables: Environment on top of this process's.
        folder: Folder for its output.
        python_path: Folders to import from.
        stdin: Its standard input: a file descriptor, or one of the constants of `subprocess`.
        program: The interpreter, or another program.
    """

    def __init__(
        self,
        command: Sequence[str],
        variables: Mapping[str, str],
        folder: Path,
        python_path: Sequence[Path] = (),
        stdin: int = subprocess.DEVNULL,
        program: str = sys.executable,
    ) -> None:
        path = os.pathsep.join([*map(str, python_path), os.environ.get("PYTHONPATH", "")]).rstrip(os.pathsep)
        super().__init__([program, *command], {**os.environ, **variables, "PYTHONPATH": path}, folder, stdin)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        # An orderly end leaves no shared memory behind; rclpy takes SIGTERM over, so only SIGKILL ends a hung node.
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.popen.terminate()
            self.popen.wait(ORDERLY_END_S)
        super().__exit__(kind, error, trace)


class Peer:
    """The other side of a node under test: publishes, receives, and spins only while it waits.

    Args:
        domain: Domain id.
        variables: As from `environment`; set in this process while the peer exists.
    """

    def __init__(self, domain: int, variables: Mapping[str, str]) -> None:
        with warnings.catch_warnings():
            # The parser of message definitions, which rclpy loads, uses a module that Python deprecates.
            warnings.simplefilter("ignore", DeprecationWarning)
            import rclpy
            import rosidl_generator_py  # type: ignore[import-untyped]  # noqa: F401
            from rclpy.executors import SingleThreadedExecutor

        self._before = {name: os.environ.get(name) for name in variables}
        os.environ.update(variables)
        self._context = rclpy.context.Context()
        rclpy.init(context=self._context, domain_id=domain)
        self.node = rclpy.create_node(PEER_NODE, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._publishers: dict[str, Any] = {}
        self._asking: Any = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        import rclpy

        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)
        for name, value in self._before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value

    def receive(self, message_class: Any, topic: str) -> list[Any]:
        """A list that grows with every message received on a topic."""
        received: list[Any] = []
        self.node.create_subscription(message_class, topic, received.append, 100)
        return received

    def publisher(self, message_class: Any, topic: str, qos: Any = 10) -> Any:
        """The publisher of a topic, made on first use."""
        if topic not in self._publishers:
            self._publishers[topic] = self.node.create_publisher(message_class, topic, qos)
        return self._publishers[topic]

    def publish(self, message: Any, topic: str, qos: Any = 10) -> None:
        """Send a message."""
        self.publisher(type(message), topic, qos).publish(message)

    def wait_for_peers(self, topics: Sequence[str]) -> None:
        """Wait until another node publishes on or subscribes to each topic, as seen from here."""
        own = self.node.get_name()

        def others(topic: str) -> bool:
            ends = self.node.get_publishers_info_by_topic(topic) + self.node.get_subscriptions_info_by_topic(topic)
            return any(end.node_name not in (own, "_NODE_NAME_UNKNOWN_") for end in ends)

        self.spin_until(lambda: all(others(topic) for topic in topics), DISCOVERY_LIMIT_S, f"peers on {topics}")

    def spin_until(
        self,
        condition: Callable[[], bool],
        limit_s: float,
        what: str,
        process: RosProcess | None = None,
        repeat: Callable[[], object] = lambda: None,
        repeat_every_s: float = 0.1,
    ) -> None:
        """Handle messages until a condition is true.

        Args:
            condition: Condition to wait for.
            limit_s: Time after which it is a failure, in seconds.
            what: Description of the condition in words, for the failure.
            process: Process whose early end is a failure, too.
            repeat: Function called now and again: the first messages of a new connection may be lost.
            repeat_every_s: Time between two calls of it, in seconds.

        Raises:
            AssertionError: It did not become true in time.
        """
        deadline = time.monotonic() + limit_s
        next_repeat = time.monotonic()
        has_ended = False
        while not condition():
            description = f"{what}\n{process.stderr if process else ''}"
            assert time.monotonic() < deadline, (
                f"the node ended before {description}" if has_ended else f"waited {limit_s} s in vain for {description}"
            )
            if process is not None and not process.is_running and not has_ended:
                has_ended = True
                # The last words of the process may be on their way still.
                deadline = min(deadline, time.monotonic() + _LAST_WORDS_S)
            if time.monotonic() >= next_repeat:
                repeat()
                next_repeat = time.monotonic() + repeat_every_s
            self._executor.spin_once(timeout_sec=0.02)

    def settle(self, process: RosProcess, limit_s: float) -> None:
        """Return when the one node that is no test's has looked at all that was sent to it.

        Two questions to it, one after the other: between the answers it has.

        Args:
            process: The node's.
            limit_s: For each part, after which it is a failure.
        """
        from rcl_interfaces.srv import GetParameters

        if self._asking is None:
            (name,) = set(self.node.get_node_names()) - OWN_NODES
            self._asking = self.node.create_client(GetParameters, f"/{name}/get_parameters")
            self.spin_until(self._asking.service_is_ready, limit_s, "the node's parameters", process)
        for _ in range(2):
            self.ask(self._asking, GetParameters.Request(names=["period"]), limit_s, process)

    def ask(self, client: Any, question: Any, limit_s: float, process: RosProcess | None = None) -> Any:
        """The answer to a question that may be asked again, and is: a server may lose the first answers.

        It has nobody to give them to until it has found the client, which the client cannot see.
        """
        futures: list[Any] = []
        self.spin_until(
            lambda: any(future.done() for future in futures),
            limit_s,
            "an answer of the node",
            process,
            lambda: futures.append(client.call_async(question)),
            repeat_every_s=1.0,
        )
        return next(future.result() for future in futures if future.done())

    def spin_for(self, duration_s: float) -> None:
        """Handle messages for a while: to show that nothing happens."""
        deadline = time.monotonic() + duration_s
        while time.monotonic() < deadline:
            self._executor.spin_once(timeout_sec=0.02)
