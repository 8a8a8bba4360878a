"""`robosc-bridge run` on a simulated robot, as a program that waits in standby for commands of its remote endpoint."""

import re
import subprocess
import sys
import threading
from pathlib import Path
from types import TracebackType
from typing import Self

from robosc_simulated import SimulatedTurtleBot3
from support.waiting import wait_until

START_LIMIT_S, LIMIT_S = 90.0, 30.0

RUNNER = """robot Runner {
    interface twist use Twist from geometry_msgs
    datatype object Vector { x: double z: double }
    datatype object Twist { linear: Vector angular: Vector }
    component Wheels {
        incoming message drive with identifier: "/cmd_vel", type: Twist links twist
        behaviour { initial marked state ready { on request to drive } }
    }
    provide drive with { linear: { x: 0.1 } }
}
"""


def configured(
    folder: Path,
    robot: SimulatedTurtleBot3,
    model: str,
    *grpc: str,
    operator: str = "null",
    address: str = "127.0.0.1:0",
    lidar: str = "",
) -> Path:
    """A configuration with its model beside it; the wheels are on `/cmd_vel`."""
    (folder / "robot.rscd").write_text(model)
    file = folder / "robot.yaml"
    file.write_text(
        f"robot: burger\ndrive: {{driver: opencr, port: {robot.base_path}}}\n"
        + (f"scanner: {{driver: {lidar}, port: {robot.scanner_path}}}\n" if lidar else "")
        # A machine on which tests run is not one for robots.
        + "safety: {overrun_s: 1.0, motor_timeout_s: 1.0, command_timeout_s: 1.0, scan_timeout_s: 2.0, "
        f"operator_link_timeout_s: {operator}}}\n"
        f"remote: {{grpc_address: '{address}'}}\n"
        "channels:\n  /cmd_vel: {channel: drive}\n" + "".join(f"  {name}: {{channel: grpc}}\n" for name in grpc)
    )
    return file


class Running:
    """Program that runs, and its errors.

    Args:
        configuration: File of the configuration.
        options: Further arguments of `run`.
        model: File of the model; None: the one beside the configuration.
    """

    def __init__(self, configuration: Path, *options: str, model: Path | None = None) -> None:
        line = [sys.executable, "-m", "robosc_bridge.main", "run", "--standby", *options]
        line += ["--model", str(model or configuration.with_suffix(".rscd")), "--config", str(configuration)]
        self.process = subprocess.Popen(line, stderr=subprocess.PIPE, text=True)
        self.written = ""
        self._thread = threading.Thread(target=self._read)
        self._thread.start()

    def _read(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.written += line

    def said(self, pattern: str) -> str:
        """Return the group of a pattern that occurs in the errors sooner or later."""

        def look() -> re.Match[str] | None:
            assert self.process.poll() is None, self.written
            return re.search(pattern, self.written)

        return wait_until(look, limit_s=START_LIMIT_S)[1]

    def address(self) -> str:
        """Return the address that its endpoint listens on."""
        return self.said(r"the remote endpoint listens on (\S+)\n")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.end()
        if error is not None:
            error.add_note(f"the bridge has written:\n{self.written}")

    def end(self) -> None:
        """Kill it."""
        self.process.kill()
        self.process.wait()
        self._thread.join(LIMIT_S)
        assert self.process.stderr is not None
        self.process.stderr.close()
