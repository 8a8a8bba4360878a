"""Example robots in tests: their generated controllers and helper nodes as processes around a small robot."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from robosc.certification import make_supervisor
from robosc.language import load_bundle
from robosc.model.structure import Deployment
from robosc.targets import generate, write_files
from support.kinematic_robot import KinematicRobot
from support.models import EXAMPLES
from support.ros2 import Peer, RosProcess, environment, own_domain

LIMIT_S = 20.0
HELPERS = EXAMPLES / "robosc_examples"


def generated_package(model: str, folder: Path, deployment: Deployment = Deployment.CONTROLLER) -> Path:
    """Generate the ROS 2 package of an example robot.

    Args:
        model: Its name, which is that of its folder; that of a layer has `_layer` at its end.
        folder: Folder to put it in.
        deployment: Deployment of its supervisor.
    """
    made = make_supervisor(
        load_bundle(EXAMPLES / model.removesuffix("_layer") / f"{model}.rscd"), deployment=deployment
    )
    assert made.supervisor is not None, made.reason
    write_files(generate(made.supervisor, "ros2"), folder)
    return folder


class Stage:
    """Stage of an example robot: a domain of its own, its processes, and the test's side.

    Args:
        folder: Folder for everything that the processes write.
        domain: Domain id.
        stack: Exit stack that ends the processes.
    """

    def __init__(self, folder: Path, domain: int, stack: ExitStack) -> None:
        self._folder = folder
        self._stack = stack
        self._processes: list[RosProcess] = []
        self.variables = environment(domain, folder)
        self.peer = stack.enter_context(Peer(domain, self.variables))
        self.robot: KinematicRobot | None = None

    def run(
        self,
        command: list[str],
        python_path: list[Path],
        stdin: int = subprocess.DEVNULL,
        program: str = sys.executable,
    ) -> RosProcess:
        """Start a program."""
        folder = self._folder / str(len(self._processes))
        process = RosProcess(command, self.variables, folder, python_path, stdin, program)
        self._processes.append(self._stack.enter_context(process))
        return process

    def helper(self, node: str, *arguments: str, stdin: int = subprocess.DEVNULL) -> RosProcess:
        """Start a helper node; arguments with := are parameters, others are ROS arguments such as remappings."""
        given = [
            word for item in arguments for word in (["-r", item] if item.startswith(("/", "__")) else ["-p", item])
        ]
        return self.run(["-m", f"robosc_examples.{node}", "--ros-args", *given], [HELPERS], stdin)

    def controller(self, model: str, *parameters: str) -> RosProcess:
        """Start the controller of an example robot, deciding every 50 ms."""
        package = generated_package(model, self._folder / model)
        given = [word for item in ("period:=0.05", *parameters) for word in ("-p", item)]
        return self.run(["-m", f"{model}_controller.start", "--ros-args", *given], [package])

    def supervised(self, model: str, node: str) -> RosProcess:
        """Start the supervision layer of an example robot with a helper node as the existing controller behind it."""
        package = generated_package(model, self._folder / model, Deployment.LAYER)
        controller = ["--controller", sys.executable, "-m", f"robosc_examples.{node}"]
        return self.run(["-m", f"{model}_layer.start", *controller], [package, HELPERS])

    def end(self) -> None:
        """Ask all programs to end, so that they do so at the same time."""
        for process in self._processes:
            if process.is_running:
                process.signal(signal.SIGTERM)

    def until(self, condition: Callable[[], bool], what: str, node: RosProcess | None = None) -> None:
        """Let the robot go on until something holds."""
        step = self.robot.step if self.robot is not None else lambda: None
        self.peer.spin_until(condition, LIMIT_S, what, node, step, repeat_every_s=0.02)

    def go_on(self, duration_s: float) -> None:
        """Let the robot go on for a while: to show that nothing happens."""
        assert self.robot is not None
        end_s = time.monotonic() + duration_s
        self.until(lambda: time.monotonic() > end_s, "time to go by")


@contextmanager
def stage(folder: Path) -> Iterator[Stage]:
    """A stage; everything that was started on it ends with it."""
    with own_domain() as domain, ExitStack() as stack:
        made = Stage(folder, domain, stack)
        yield made
        made.end()
