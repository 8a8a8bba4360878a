"""Drive bases on simulated robots, with what goes over their line kept."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field

from robosc_bridge.devices.dynamixel import DynamixelBase
from robosc_bridge.devices.dynamixel_bus import ANSWER_LIMIT_S, exchange_limit_s
from robosc_bridge.devices.interface import STANDSTILL, DriveReading, Velocity
from robosc_bridge.devices.mavlink_rover import MavlinkRover
from robosc_bridge.devices.opencr import OpenCrBase
from robosc_bridge.devices.robots import ROBOTS
from robosc_bridge.host import Host
from robosc_bridge.transport.system_host import SystemHost
from robosc_simulated import SimulatedTurtleBot3
from robosc_simulated.line import Device, Sending
from robosc_simulated.virtual_host import VirtualHost

# The simulator is a thread of this process, on a machine that may be busy; time-outs are for the tests of time-outs.
PATIENT_S = 0.5
PERIOD_S = 0.01


@dataclass
class Tap:
    """A device, and the packets that its host has sent.

    Attributes:
        device: The real one.
        packets: In order.
    """

    device: Device
    packets: list[str] = field(default_factory=list)
    _rest: bytes = b""

    @property
    def baud(self) -> int | None:
        return self.device.baud

    def receive(self, data: bytes, baud: int) -> Iterable[Sending]:
        # Zeros that fill what a device may wait for are dropped.
        self._rest = (self._rest + data).lstrip(b"\0")
        while len(self._rest) >= 7 and len(self._rest) >= (length := 7 + int.from_bytes(self._rest[5:7], "little")):
            self.packets.append(self._rest[:length].hex(" "))
            self._rest = self._rest[length:]
        return self.device.receive(data, baud)

    def update(self) -> Iterable[Sending]:
        return self.device.update()

    def due_s(self) -> float:
        return self.device.due_s()

    def plug_in(self) -> None:
        self._rest = b""
        self.device.plug_in()


class Driven:
    """A drive base on a host, for subclasses to say which."""

    base: OpenCrBase | DynamixelBase | MavlinkRover
    host: Host

    def start(self) -> None:
        """Open it and switch torque on."""
        self.base.open()
        self.base.set_torque(True)

    def drive(self, velocity: Velocity = STANDSTILL, seconds: float = 0.0) -> DriveReading:
        """Exchange for so long; the last reading."""
        end_s = self.host.monotonic() + seconds
        while True:
            reading = self.base.exchange(velocity)
            if self.host.monotonic() >= end_s:
                return reading
            self.host.sleep(PERIOD_S)

    def drive_until(
        self, is_so: Callable[[DriveReading], bool], velocity: Velocity = STANDSTILL, limit_s: float = 5.0
    ) -> DriveReading:
        """Exchange until a reading is as awaited; that reading."""
        end_s = self.host.monotonic() + limit_s
        while not is_so(reading := self.base.exchange(velocity)):
            assert self.host.monotonic() < end_s, f"not within {limit_s} s; the last reading is {reading}"
            self.host.sleep(PERIOD_S)
        return reading

    def until(self, condition: Callable[[], bool], limit_s: float = 5.0) -> None:
        """Wait for something, without anything being exchanged."""
        end_s = self.host.monotonic() + limit_s
        while not condition():
            assert self.host.monotonic() < end_s, f"not within {limit_s} s"
            self.host.sleep(0.001)


@dataclass
class Rig(Driven):
    """A simulated robot and the driver of its base.

    Attributes:
        robot: The simulated one.
        base: Its driver, of the kind `kind`.
        kind: `opencr`, `dynamixel` or `mavlink-rover`.
        tap: On its line; understands the packets of Dynamixel only.
        host: On which both run.
    """

    robot: SimulatedTurtleBot3
    base: OpenCrBase | DynamixelBase | MavlinkRover
    kind: str
    tap: Tap
    host: Host

    def hurry(self, answer_limit_s: float = ANSWER_LIMIT_S) -> None:
        """From now on, time-outs as on a robot, or as given; a MAVLink rover is not asked for anything."""
        assert not isinstance(self.base, MavlinkRover)
        bus = self.base._bus
        assert bus is not None
        bus._port.answer_limit_s = answer_limit_s
        self.base._exchange_limit_s = exchange_limit_s(answer_limit_s)

    def take_time(self) -> None:
        """From now on, time-outs that a busy machine does not meet."""
        self.hurry(PATIENT_S)

    def goals_rad_s(self) -> tuple[float, float]:
        """Return the commanded speeds of the wheels' motors in rad/s, forward positive; 0 without torque."""
        wheels = (self.robot.world.left, self.robot.world.right)
        left, right = (wheel.goal_rad_s if wheel.is_driven else 0.0 for wheel in wheels)
        return left, right

    def stops_within(self, seconds: float) -> bool:
        """Return True if the motors are commanded to stand still in time, without anything being exchanged."""
        end_s = self.host.monotonic() + seconds
        while self.goals_rad_s() != (0.0, 0.0):
            if self.host.monotonic() > end_s:
                return False
            self.host.sleep(0.002)
        return True


@contextmanager
def rig(
    kind: str,
    robot: str = "burger",
    answer_limit_s: float = PATIENT_S,
    host: VirtualHost | SystemHost | None = None,
    **arguments: object,
) -> Iterator[Rig]:
    """A simulated robot and its driver, not opened.

    Args:
        kind: `opencr`, `dynamixel` or `mavlink-rover`.
        robot: Its name.
        answer_limit_s: Of the driver, if it asks.
        host: On which both run; None: a virtual one.
        arguments: Further ones of the simulated robot.
    """
    host = VirtualHost() if host is None else host
    with (
        host if isinstance(host, VirtualHost) else nullcontext(),
        SimulatedTurtleBot3(robot, kind, **{"clock": host, **arguments}) as simulated,  # type: ignore[arg-type]
    ):
        tap = Tap(simulated.base_line.device)
        simulated.base_line.device = tap
        base: OpenCrBase | DynamixelBase | MavlinkRover
        if kind == "mavlink-rover":
            base = MavlinkRover(simulated.base_path, ROBOTS[robot].body, host=host)
        else:
            driver = OpenCrBase if kind == "opencr" else DynamixelBase
            base = driver(simulated.base_path, ROBOTS[robot], answer_limit_s=answer_limit_s, host=host)
        try:
            yield Rig(simulated, base, kind, tap, host)
        finally:
            base.close()
