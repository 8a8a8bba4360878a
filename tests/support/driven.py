"""A whole bridge that drives a simulated robot over serial lines, with the commands to its wheels kept.

On a virtual host everything happens at its exact time, whatever else the computer does; on this computer, over real
pseudo-terminals. The loop runs in a thread of its own, the devices' threads in theirs. What counts is what the
simulated motors are commanded to do, when they hear it: neither the daemon's own word for it nor the test's look at it.
"""

import logging
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from typing import Any

from robosc.execution.runtime.event_log import MemoryLog
from robosc_bridge.assembly import Machine, assemble, safety_limits
from robosc_bridge.configuration import map_channels, parse
from robosc_bridge.daemon.states import State
from robosc_bridge.host import Host, Thread
from robosc_bridge.safety import SafetyLimits
from robosc_bridge.transport.system_host import SYSTEM_HOST, SystemHost
from robosc_simulated import SimulatedTurtleBot3
from robosc_simulated.line import Device, Sending
from robosc_simulated.virtual_host import VirtualHost
from support.daemons import supervisor_of
from support.real_time import Lateness

LIMIT_S = 15.0
"""Longer than anything takes that works."""

HANDOVERS = 4
"""Number of threads, each maybe late, that take part in a stop: test or loop, the drive's, the line's, and back."""

PATIENT = "{answer_limit_s: 0.3}"
"""Options of a drive whose answers come for certain, on a machine that may be busy."""

# Its supervisor always wants to move: whatever stops the wheels is not it.
MODEL = """
robot Runner {
    interface twist use Twist from geometry_msgs
    datatype object Vector { x: double z: double }
    datatype object Twist { linear: Vector angular: Vector }
    component Wheels {
        incoming message drive with identifier: "/cmd_vel", type: Twist links twist
        outgoing message lost with identifier: "/lost", type: string
        outgoing message back with identifier: "/back", type: string
        behaviour {
            initial marked state ready { on response from lost goto ready on response from back goto ready }
        }
    }
    provide drive with { linear: { x: LINEAR }, angular: { z: ANGULAR } }
}
"""
CHANNELS = """channels:
  /cmd_vel: {channel: drive}
  /lost: {channel: fault}
  /back: {channel: fault, event: back}
"""


class Recorded:
    """A device, and what the wheels' motors were commanded to do whenever something was heard or happened by itself.

    Args:
        device: The real one.
        robot: Robot with these wheels.

    Attributes:
        commanded: Time, and speeds of the left and the right wheel in m/s; each entry differs from the one before.
        heard_s: Times at which the host was heard.
        heard: Bytes that were heard at these times.
    """

    def __init__(self, device: Device, robot: SimulatedTurtleBot3) -> None:
        self._device = device
        self._robot = robot
        self.commanded: list[tuple[float, float, float]] = [(robot.time.now_s(), 0.0, 0.0)]
        self.heard_s: list[float] = []
        self.heard: list[bytes] = []

    @property
    def baud(self) -> int | None:
        return self._device.baud

    def receive(self, data: bytes, baud: int) -> Iterable[Sending]:
        self.heard_s.append(self._robot.time.now_s())
        self.heard.append(data)
        return self._watched(list(self._device.receive(data, baud)))

    def update(self) -> Iterable[Sending]:
        return self._watched(list(self._device.update()))

    def due_s(self) -> float:
        return self._device.due_s()

    def plug_in(self) -> None:
        self._device.plug_in()

    def look(self) -> None:
        """Note what the motors are commanded now."""
        with self._robot.time.lock:
            world = self._robot.world
            radius_m = world.body.wheel_radius_m
            speeds = [radius_m * wheel.goal_rad_s if wheel.is_driven else 0.0 for wheel in (world.left, world.right)]
            if tuple(speeds) != self.commanded[-1][1:]:
                self.commanded.append((self._robot.time.now_s(), speeds[0], speeds[1]))

    def _watched(self, sendings: list[Sending]) -> list[Sending]:
        self.look()
        return sendings


class HangingLog(MemoryLog):
    """An event log that a test lets hang: it is written by the loop's thread, from inside the executor.

    Args:
        host: Host on which it hangs.

    Attributes:
        hangs: True if the next entry waits.
    """

    def __init__(self, host: Host) -> None:
        super().__init__()
        self.hangs = False
        self._host = host

    def write(self, entry: dict[str, Any]) -> None:
        while self.hangs:
            self._host.sleep(0.001)
        super().write(entry)

    def events(self) -> list[str]:
        """Names of the model's events so far."""
        return [str(entry["event"]) for entry in tuple(self.entries) if entry["kind"] == "event"]


@dataclass
class Driven:
    """A bridge at work.

    Attributes:
        host: Host on which it runs.
        robot: The simulated robot.
        machine: The daemon and its devices' threads.
        limits: Limits of its safety layer.
        log: Event log of the executor.
        trace: Commands that the wheels were given.
        messages: Messages to a person, warnings and worse.
        thread: Thread of the loop.
        error: Error that has ended the loop.
        has_ended_well: True if it has ended, gave back all its devices, and nothing that was begun is left.
    """

    host: Host
    robot: SimulatedTurtleBot3
    machine: Machine
    limits: SafetyLimits
    log: HangingLog
    trace: Recorded
    messages: list[str]
    error: Exception | None = None
    has_ended_well: bool = False
    thread: Thread = field(init=False)

    def __post_init__(self) -> None:
        self.thread = self.host.thread(self._run, "loop")

    def _run(self) -> None:
        try:
            self.has_ended_well = self.machine.run()
        except Exception as error:
            self.error = error

    @property
    def state(self) -> State:
        return self.machine.daemon.state

    def until(self, condition: Callable[[], object], what: str, limit_s: float = LIMIT_S) -> None:
        """Wait for something."""
        end_s = self.host.monotonic() + limit_s
        while not condition():
            assert self.host.monotonic() < end_s, f"waited {limit_s} s in vain for {what}; received: {self.messages}"
            self.host.sleep(0.002)

    @property
    def wheels_m_s(self) -> tuple[float, float]:
        """Current commanded speeds of the motors, in m/s."""
        self.trace.look()
        return self.trace.commanded[-1][1:]

    def moves(self) -> None:
        """Wait until it moves."""
        self.until(lambda: self.wheels_m_s != (0.0, 0.0), "the wheels to be commanded to turn")

    def steady(self) -> None:
        """Wait until it moves with the velocity that is wanted: nothing changes any more."""
        self.until(
            lambda: self.wheels_m_s != (0.0, 0.0) and self.host.monotonic() - self.trace.commanded[-1][0] > 0.3,
            "a steady motion",
        )

    def stopped_after(self, cause: Callable[[], object], limit_s: float) -> float:
        """Let something happen to a moving robot; return the time until both wheels' commanded speed stays zero.

        Args:
            cause: Action that happens.
            limit_s: Time by which it must have been so, in seconds; in real time, a busy machine's lateness is added.
        """
        self.steady()
        with Lateness() if self.host is SYSTEM_HOST else nullcontext() as lateness:
            begin_s = self.robot.time.now_s()
            cause()
            self.until(lambda: self._is_still(begin_s), "the wheels to be commanded to stop")
        self.trace.look()
        commanded = self.trace.commanded
        assert commanded[-1][1:] == (0.0, 0.0)
        took_s = commanded[-1][0] - begin_s
        most_s = limit_s if lateness is None else limit_s + HANDOVERS * lateness.worst_s
        assert took_s <= most_s, f"{took_s:.3f} s instead of {limit_s:.3f} s, on this machine {most_s:.3f} s"
        return took_s

    def _is_still(self, begin_s: float) -> bool:
        """Return True if the wheels have been commanded to stand still, and nothing else since then."""
        at_s, *wheels = self.trace.commanded[-1]
        return at_s >= begin_s and wheels == [0.0, 0.0] and self.robot.time.now_s() - at_s > 0.15

    def stays(self, seconds: float) -> None:
        """See that nothing is set in motion for so long."""
        before = len(self.trace.commanded)
        assert self.wheels_m_s == (0.0, 0.0)
        self.host.sleep(seconds)
        self.trace.look()
        assert all(wheels == [0.0, 0.0] for _, *wheels in self.trace.commanded[before:])

    def reports(self, text: str) -> None:
        """See that a person received this text, once; waits for it."""
        self.until(lambda: any(text in message for message in self.messages), f"the message {text!r}")
        found = [message for message in self.messages if text in message]
        assert len(found) == 1, found

    def ended(self) -> str:
        """Wait for the end of the run; the problem that it ended with."""
        self.thread.join(LIMIT_S)
        assert not self.thread.is_alive()
        return self.machine.daemon.problem


class _Messages(logging.Handler):
    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.texts.append(record.getMessage())


def configured(robot: SimulatedTurtleBot3, base: str, lidar: str, sections: Mapping[str, str]) -> str:
    """A configuration for a simulated robot; sections in YAML by name add to it."""
    options = sections.get("options", PATIENT if base != "mavlink-rover" else "{}")
    rest = "".join(f"{key}: {text}\n" for key, text in {"robot": "burger", **sections}.items() if key != "options")
    # The obstacles of a rover come over its own line.
    scanner_path = robot.base_path if lidar == "mavlink-rover" else robot.scanner_path
    return (
        f"drive: {{driver: {base}, port: {robot.base_path}, options: {options}}}\n"
        f"scanner: {{driver: {lidar}, port: {scanner_path}}}\n{rest}{CHANNELS}"
    )


@contextmanager
def driven(
    base: str,
    lidar: str = "lds03",
    velocity: tuple[float, float] = (0.06, 1.0),
    *,
    host: VirtualHost | SystemHost | None = None,
    before: Callable[[SimulatedTurtleBot3], None] = lambda robot: None,
    **sections: str,
) -> Iterator[Driven]:
    """Run a bridge that begins to drive a Burger in a circle, until the block is left.

    Args:
        base: Driver of its drive base.
        lidar: Its LiDAR; `mavlink-rover`: what the rover reports of its surroundings.
        velocity: Velocity that its supervisor always wants.
        host: Host on which it runs; None: a virtual one.
        before: Action on the robot before the bridge starts.
        sections: Sections of the configuration, in YAML; `options`: those of the drive (default: `PATIENT` where it
            is asked).
    """
    supervisor = supervisor_of(MODEL.replace("LINEAR", str(velocity[0])).replace("ANGULAR", str(velocity[1])))
    handler = _Messages()
    logger = logging.getLogger("robosc_bridge")
    logger.addHandler(handler)
    host = VirtualHost() if host is None else host
    with (
        host if isinstance(host, VirtualHost) else nullcontext(),
        SimulatedTurtleBot3("burger", base, "lds03" if lidar == base else lidar, clock=host) as robot,
    ):
        trace = Recorded(robot.base_line.device, robot)
        robot.base_line.device = trace
        before(robot)
        configuration = parse(configured(robot, base, lidar, sections).encode(), "test.yaml").configuration
        log = HangingLog(host)
        mapping = map_channels(supervisor.model, configuration)
        machine = assemble(configuration, mapping, supervisor, log, starts_itself=True, host=host)
        found = Driven(host, robot, machine, safety_limits(configuration), log, trace, handler.texts)
        found.thread.start()
        try:
            yield found
        finally:
            log.hangs = False
            machine.quit()
            found.thread.join(LIMIT_S)
            logger.removeHandler(handler)
            assert not found.thread.is_alive()
