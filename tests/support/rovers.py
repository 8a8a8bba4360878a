"""A simulated rover in a world, and a driver of it: on a virtual host, or over a pseudo-terminal or UDP."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from robosc_bridge.devices.interface import Velocity
from robosc_bridge.devices.mavlink_rover import MavlinkRover
from robosc_bridge.devices.robots import Body
from robosc_bridge.driver_registry import make_drive_base
from robosc_bridge.host import Host, Thread
from robosc_bridge.transport.system_host import SYSTEM_HOST
from robosc_simulated import BODIES, DatagramLine, Rover, SimulatedLine, Timebase, World, room
from robosc_simulated.virtual_host import VirtualHost
from support.drive import Driven

BODY = Body(0.5, 2.0, BODIES["burger"].wheel_separation_m)
FORWARD = Velocity(0.2)
POSE = (0.3, 0.2, 0.7)
KEY = bytes(range(32))


@dataclass
class Bench(Driven):
    """A simulated rover in a world, and drivers of it."""

    rover: Rover
    world: World
    time: Timebase
    line: SimulatedLine | DatagramLine
    base: MavlinkRover
    path: str
    host: Host

    def later(self, seconds: float, act: Callable[[], None]) -> Thread:
        """Let something happen in a thread of its own after a time."""

        def run() -> None:
            self.host.sleep(seconds)
            act()

        thread = self.host.thread(run, "later")
        thread.start()
        return thread

    @property
    def speed_m_s(self) -> float:
        """Speed that its motors are ordered to have, in m/s."""
        wheels = (self.world.left, self.world.right)
        return sum(wheel.goal_rad_s * 0.033 / 2 for wheel in wheels if wheel.is_driven)


@contextmanager
def rig(
    kind: str = "virtual", key: bytes | None = None, vehicle: tuple[int, int] = (10, 3), **arguments: Any
) -> Iterator[Bench]:
    virtual = VirtualHost()
    host: Host = virtual if kind == "virtual" else SYSTEM_HOST
    passing = Timebase(host)
    world = World(BODIES["burger"], room(4.0, 3.0), passing, POSE)
    rover = Rover(world, key=key, heartbeat_s=0.2)
    rover.kind, rover.autopilot = vehicle
    line: SimulatedLine | DatagramLine
    if kind in ("virtual", "pty"):
        line = SimulatedLine(rover, passing)
        path = line.path
    elif kind == "udpout":
        line = DatagramLine(rover, passing)
        path = f"udpout:127.0.0.1:{line.port}"
    else:
        with DatagramLine(rover, passing) as other:
            free = other.port
        line = DatagramLine(rover, passing, free)
        path = f"udpin:127.0.0.1:{free}"
    base = make_drive_base("mavlink-rover", path=path, robot=BODY, host=host, **arguments)
    assert isinstance(base, MavlinkRover)
    try:
        yield Bench(rover, world, passing, line, base, path, host)
    finally:
        base.close()
        line.close()
        virtual.close()
