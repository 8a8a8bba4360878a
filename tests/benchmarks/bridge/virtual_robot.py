"""A bridge on a simulated robot in one thread and in a time of its own: hours pass in minutes.

Configuration, assembly, loop, executor, safety layer, the steps of the devices' threads, drivers, decoders, simulated
devices and the bytes between them are the real ones. Two things are not: a line hands its bytes over at once instead of
through a pseudo-terminal, and the steps of the threads follow one another.

`time.monotonic` and `time.sleep` are those of the virtual clock: a process that imports this module is for this alone.
Whoever wants them must import it before the bridge.
"""

import math
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import ClassVar

ROOT = Path(__file__).parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "bridge"), str(ROOT / "client"), str(ROOT / "proto"), str(ROOT / "tests")]

real_monotonic = time.monotonic


class VirtualClock:
    """The time of everything in this process; nothing of the project is imported before it has taken its place."""

    def __init__(self) -> None:
        self.now_s = 1000.0
        # What happens while somebody sleeps until a time.
        self.meanwhile: Callable[[float], None] | None = None

    def monotonic(self) -> float:
        """Seconds."""
        return self.now_s

    def wall(self) -> float:
        """The same."""
        return self.now_s

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        end_s = self.now_s + seconds
        if self.meanwhile is not None:
            self.meanwhile(end_s)
        self.now_s = end_s


CLOCK = VirtualClock()
time.monotonic = CLOCK.monotonic
time.sleep = CLOCK.sleep  # type: ignore[assignment]

from robosc.execution.event_log import NullLog  # noqa: E402  # found through the path above
from robosc.model.structure import Deployment  # noqa: E402
from robosc_bridge.configuration import parse, tie  # noqa: E402
from robosc_bridge.daemon import assembly  # noqa: E402
from robosc_bridge.daemon.states import State  # noqa: E402
from robosc_bridge.daemon.supervisors import Source, obtain  # noqa: E402
from robosc_bridge.daemon.workers import Worker  # noqa: E402
from robosc_bridge.devices import dynamixel, lidar, opencr  # noqa: E402
from robosc_bridge.simulated.lidar import LIDARS  # noqa: E402
from robosc_bridge.simulated.line import Device, Sending  # noqa: E402
from robosc_bridge.simulated.opencr import OpenCr  # noqa: E402
from robosc_bridge.simulated.robots import BODIES  # noqa: E402
from robosc_bridge.simulated.servo_bus import ServoBus  # noqa: E402
from robosc_bridge.simulated.timebase import Timebase  # noqa: E402
from robosc_bridge.simulated.turtlebot3 import wheel_servos  # noqa: E402
from robosc_bridge.simulated.walls import Walls  # noqa: E402
from robosc_bridge.simulated.world import World  # noqa: E402

SCANNER_S = 0.02
"""How often the bridge is given what the LiDAR has sent."""


class VirtualLine:
    """What a driver takes for a serial line: its device hears at once, and answers at once."""

    devices: ClassVar[dict[str, Device]] = {}

    def __init__(self, path: str, baud: int) -> None:
        self.path = path
        self.baud = baud
        self._device = self.devices[path]
        self._found = b""
        self._is_woken = False
        # What it told before nobody heard.
        self._device.live()

    def _take(self, sendings: "list[Sending] | tuple[Sending, ...]") -> None:
        self._found += b"".join([sending.data for sending in sendings])

    def read(self, limit_s: float) -> bytes:
        """What has come; else time passes until something does."""
        end_s = CLOCK.now_s + max(limit_s, 0.0)
        self._take(list(self._device.live()))
        while not self._found and not self._is_woken and CLOCK.now_s < end_s:
            CLOCK.now_s = max(min(end_s, self._device.due_s()), CLOCK.now_s)
            self._take(list(self._device.live()))
        self._is_woken = False
        found, self._found = self._found, b""
        return found

    def write(self, data: bytes, limit_s: float = 0.1) -> None:
        """The device hears it."""
        self._take(list(self._device.receive(data, self.baud)))

    def discard_input(self) -> None:
        """Forget what has come."""
        self._found = b""

    def set_baud(self, baud: int) -> None:
        """Speak at another speed."""
        self.baud = baud

    def set_dtr(self, is_on: bool) -> None:
        """It has no modem lines."""

    def wake(self) -> None:
        """Let the next `read` return at once."""
        self._is_woken = True

    def close(self) -> None:
        """Nothing is held."""


class VirtualThread:
    """What the assembly takes for a device's thread: its steps are taken by whoever lets time pass."""

    is_alive = True

    def __init__(self, worker: Worker, clock: Callable[[], float]) -> None:
        self.worker = worker
        self.is_hurried = False

    def hurry(self) -> None:
        """The next step is due."""
        self.is_hurried = True


for module in (dynamixel, opencr, lidar):
    module.SerialLine = VirtualLine  # type: ignore[attr-defined]
assembly.DeviceThread = VirtualThread  # type: ignore[assignment,attr-defined]


def _virtual(thread: object) -> VirtualThread:
    assert isinstance(thread, VirtualThread)
    return thread


class VirtualRobot:
    """A bridge and its robot.

    Args:
        model: File of the model.
        configuration: Text of the configuration; the ports are `base` and `scanner`.
        base: `opencr` or `dynamixel`.
        scanner: Which LiDAR.
        walls: Around the robot.

    Attributes:
        world: Walls, pose, collisions.
        machine: The bridge.
        period_s: Of its decisions.
        exchanges: Steps with the drive base.
    """

    def __init__(self, model: Path, configuration: str, base: str, scanner: str, walls: Walls) -> None:
        body = BODIES["burger"]
        timebase = Timebase(CLOCK)
        self.world = World(body, walls, timebase)
        left, right = wheel_servos(self.world)
        device: Device = OpenCr(self.world, left, right) if base == "opencr" else ServoBus((left, right))
        self._laser = LIDARS[scanner](self.world)
        VirtualLine.devices = {"base": device, "scanner": self._laser}
        self._base = device
        loaded = parse(configuration.encode(), "virtual.yaml")
        supervisor = obtain(Source(model, Deployment.CONTROLLER, None, None), lambda text: None)
        ties = tie(supervisor.model, loaded.configuration, loaded.document)
        self.machine = assembly.assemble(loaded.configuration, ties, supervisor, NullLog(), starts_itself=True)
        self.period_s = loaded.configuration.execution.period_s
        self._drive, self._scanner = _virtual(self.machine.drive), _virtual(self.machine.scanner)
        self._drive_due_s = CLOCK.now_s
        self.exchanges = 0
        # The servos by themselves do nothing while there are exchanges, the board has its cycle.
        self._base_due_s = device.due_s() if base == "opencr" else math.inf
        self._scanner_due_s = CLOCK.now_s
        # It is opened.
        self._scanner.worker.step(CLOCK.now_s)

    def live(self, until_s: float, each: Callable[[], None] = lambda: None) -> None:
        """Let time pass, and do what is due when it is.

        Args:
            until_s: Of the virtual clock.
            each: Called after each step.
        """
        CLOCK.meanwhile = self._live_without_drive
        while until_s > CLOCK.now_s and self.machine.daemon.state is not State.OVER:
            self._pass(min(self._due_s(), self._drive_due_s, until_s))
            if self._drive.is_hurried or CLOCK.now_s >= self._drive_due_s:
                self._drive.is_hurried = False
                self._drive_due_s = self._drive.worker.step(CLOCK.now_s)
                self.exchanges += 1
            self._step()
            each()
        CLOCK.meanwhile = None

    def _live_without_drive(self, until_s: float) -> None:
        """The drive base's thread sleeps in the middle of a step; the others do not."""
        while until_s > CLOCK.now_s:
            self._pass(min(self._due_s(), until_s))
            self._step()

    def _due_s(self) -> float:
        return min(self.machine.daemon._execution.due_s, self._scanner_due_s, self._base_due_s)

    def _pass(self, due_s: float) -> None:
        CLOCK.now_s = max(CLOCK.now_s, due_s)

    def _step(self) -> None:
        """What is due of scanner, loop and board."""
        daemon = self.machine.daemon
        if CLOCK.now_s >= self._scanner_due_s:
            # It reads once, and does not wait for what the others must do first.
            self._scanner.worker.wake()
            self._scanner.worker.step(CLOCK.now_s)
            self._scanner_due_s += SCANNER_S
        if CLOCK.now_s >= daemon._execution.due_s or daemon._inbox.qsize():
            daemon.turn()
        if CLOCK.now_s >= self._base_due_s:
            self._base.live()
            self._base_due_s = self._base.due_s()
