"""The robot Driver on ROS 1: its generated node in Python or in C++, its buttons and servers, on a real rosmaster."""

import signal
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from robosc.targets import generate, write_files
from support.node_logs import Entry, entries_of
from support.process import Process
from support.ros1 import Master, Peer, start_node, until
from support.ros1_cpp import built_once, missing, node_command, supervisor_of

MODEL = Path(__file__).parents[1] / "models" / "driver_ros1" / "model.rscd"
LANGUAGES = [
    "python",
    pytest.param("cpp", marks=pytest.mark.skipif(missing() is not None, reason=str(missing()))),
]

Start = Callable[[Master, Path, tuple[str, ...]], Process]
"""Starts the node with parameters, in a folder."""


def start_of(language: str, folder: Path, factory: pytest.TempPathFactory, **variables: str) -> Start:
    """Return what starts the node of a language.

    Args:
        language: `python` or `cpp`.
        folder: Folder for a package in Python.
        factory: Factory of the folder in which C++ is built once.
        variables: More variables of its environment.
    """
    supervisor = supervisor_of(MODEL)
    if language == "cpp":
        workspace = built_once(supervisor, factory)
        return lambda master, run, given: Process(
            node_command(workspace, *given), {**master.variables, **variables}, run
        )
    package = folder / "package"
    write_files(generate(supervisor, "ros1"), package)
    return lambda master, run, given: start_node(
        master, run, package, "driver_controller.node", [f"_{item}" for item in given], **variables
    )


class Driver:
    """A node, its buttons, its log and its health.

    Args:
        start: Starts the node with parameters, in a folder.
        folder: Folder for all output.
    """

    node: Process

    def __init__(self, start: Start, folder: Path) -> None:
        self.ends = ExitStack()
        self.folder = folder
        self.master = self.ends.enter_context(Master(folder))
        self.peer = self.ends.enter_context(Peer(self.master, folder))
        self._start = start

    def start(self, *parameters: str, waits_s: float = 0.0) -> None:
        """Start the node; unless it waits for them, it need not have found its servers when it begins."""
        given = (f"log_folder:={self.folder / 'log'}", f"server_wait:={waits_s}", "period:=0.02", *parameters)
        self.node = self.ends.enter_context(self._start(self.master, self.folder / "node", given))
        self.peer.subscribe("/diagnostics", "diagnostic_msgs/DiagnosticArray")
        for topic in ("/pressed", "/wanted"):
            self.peer.advertise(topic, "std_msgs/Bool")
        topics = ("/diagnostics", "/pressed", "/wanted")
        self.until(lambda: all(self.peer.ends(topic) for topic in topics), "the connections")

    def server(self, name: str = "server", **options: Any) -> Peer:
        """Another process with both servers."""
        made = self.ends.enter_context(Peer(self.master, self.folder / "servers", name))
        made.act("/go", "actionlib/Test", **options)
        made.serve("/reach", "std_srvs/SetBool")
        return made

    def until(
        self,
        condition: Callable[[], bool],
        what: str,
        press: str = "",
        repeat: Callable[[], object] = lambda: None,
    ) -> None:
        """Wait for a condition, with a button down meanwhile, or something else that is repeated."""

        def again() -> None:
            repeat()
            if press:
                self.peer.publish(f"/{press}", "std_msgs/Bool", data=True)

        until(condition, what, self.node, again)

    @property
    def entries(self) -> list[Entry]:
        return entries_of(self.folder / "log")

    def events(self, name: str) -> list[Entry]:
        return [entry for entry in self.entries if entry.get("event") == name and entry["kind"] == "event"]

    def health(self) -> tuple[int, str]:
        """Level and message of the last report."""
        reports = self.peer.values("/diagnostics")
        if not reports:
            return -1, ""
        (status,) = reports[-1]["status"]
        return status["level"], status["message"]

    def warns(self, text: str) -> bool:
        level, message = self.health()
        return level == 1 and text in message

    def drive(self, server: Peer) -> None:
        """Get it so far that a goal is under way, and no other one will follow."""
        before = len(server.goals["/go"])
        self.until(lambda: len(server.goals["/go"]) > before, "a goal", press="pressed")
        server.do("feedback", name="/go", message={"feedback": 1})
        self.until(lambda: bool(self.events("go.feedback")), "feedback")

    def stops(self, status: int, number: signal.Signals = signal.SIGINT) -> None:
        """The node ends after a signal."""
        self.node.signal(number)
        assert self.node.wait() == status, self.node.stderr
