"""A daemon turn by turn, on a clock that the test sets, with devices that the test plays."""

import functools
import math
from collections.abc import Callable
from typing import Any

from robosc.certification import make_supervisor
from robosc.execution.runtime.clock import ManualClock
from robosc.execution.runtime.event_log import MemoryLog
from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc_bridge.configuration import map_channels, parse
from robosc_bridge.daemon.execution import Job
from robosc_bridge.daemon.feed import Feed
from robosc_bridge.daemon.loop import Daemon
from robosc_bridge.daemon.programs.items import Attached, Detached, FromProgram, Program, ToProgram
from robosc_bridge.daemon.threads.reports import Device, DeviceUp, ResetDone
from robosc_bridge.devices.interface import BINS, STANDSTILL, DriveReading, Pose, RawScan, Scan, Velocity
from robosc_bridge.safety import SafetyLayer, SafetyLimits
from robosc_bridge.skills import EmergencyStop, Rotate
from support.models import bundle_of

MODEL = """
robot Patrol {
    interface twist use Twist from geometry_msgs
    interface laser use LaserScan from sensor_msgs
    datatype object Vector { x: double z: double }
    datatype object Twist { linear: Vector angular: Vector }
    datatype object Scan { ranges: array(double) }
    datatype enum Way from Scan to { value.ranges[0] > 0.5 -> free default -> blocked }
    component Eyes {
        outgoing message scan with identifier: "/scan", type: Way, max_age: 0.8 links laser
        outgoing message lost with identifier: "/lost", type: string
        outgoing message stop with identifier: "/stop", type: none
        outgoing message resume with identifier: "/resume", type: none
        outgoing message button with identifier: "/button", type: boolean
        behaviour {
            variable way: Way = blocked
            variable pressed: boolean
            on response from scan do way := value
            on response from button do pressed := value
            initial marked state calm { on response from stop goto stopped }
            marked state stopped { on response from resume goto calm }
        }
    }
    component Wheels {
        incoming message drive with identifier: "/cmd_vel", type: Twist links twist
        incoming message turn with identifier: "/turn", type: integer
        outgoing message turned with identifier: "/turned", type: none
        behaviour {
            initial marked state ready {
                on request to drive
                on request to turn goto turning
            }
            marked state turning { on response from turned goto ready }
        }
    }
    requirement drive needs Eyes.way = free and Eyes.calm and Wheels.ready
    requirement turn needs Eyes.way = blocked and Eyes.calm and Wheels.ready
    provide drive with { linear: { x: 0.1 } }
    provide turn with 90
}
"""
CONFIGURATION = """
robot: burger
drive: {driver: opencr, port: /dev/base}
scanner: {driver: lds01, port: /dev/scanner}
execution: {period_s: 0.02}
skills: {emergency_stop: {stop_buttons: [button_1], resume_buttons: [button_2]}}
channels:
  /scan: {channel: scanner}
  /lost: {channel: fault}
  /stop: {channel: emergency_stop, event: stop}
  /resume: {channel: emergency_stop, event: resume}
  /button: {channel: button, name: button_2, on: change}
  /cmd_vel: {channel: drive}
  /turn: {channel: rotate, unit: degrees}
  /turned: {channel: rotated, outcome: any}
"""
LIMITS = SafetyLimits(
    linear_m_s=0.2, angular_rad_s=2.0, wheel_m_s=0.2, separation_m=0.16, scan_timeout_s=0.6, loop_timeout_s=0.2
)
PERIOD_S = 0.02


@functools.cache
def supervisor_of(text: str, deployment: Deployment = Deployment.CONTROLLER) -> Supervisor:
    """The supervisor of a model's text."""
    made = make_supervisor(bundle_of(text), deployment=deployment)
    assert made.supervisor is not None, (made.reason, made.diagnostics)
    return made.supervisor


class Scene:
    """A daemon, and devices that a test plays."""

    def __init__(
        self,
        *,
        starts_itself: bool = True,
        stays: bool = False,
        text: str = CONFIGURATION,
        model: str = MODEL,
        is_layer: bool = False,
        needs_scanner: bool = True,
    ) -> None:
        supervisor = supervisor_of(model, Deployment.LAYER if is_layer else Deployment.CONTROLLER)
        configuration = parse(text.encode(), "test.yaml").configuration
        mapping = map_channels(supervisor.model, configuration)
        self.clock = ManualClock(now_s=50.0)
        self.log = MemoryLog()
        self.safety = SafetyLayer(LIMITS)
        job = Job(
            supervisor,
            mapping,
            mapping.settings(configuration.execution, supervisor.deployment),
            needs_scanner,
            starts_itself,
            stays,
            is_layer,
        )
        stop = EmergencyStop(configuration.skills.emergency_stop)
        self.feed = Feed()
        self.daemon = Daemon(
            job, self.safety, Rotate(configuration.skills.rotate), stop, self.clock, self.log, self.feed
        )
        self.hurries = self.resets = 0
        self.is_alive = self.answers_reset = True
        self.daemon.connect(self._hurry, self._reset, lambda: self.is_alive)
        self.torque = False
        self.out = STANDSTILL
        self.heading_rad = 0.0
        self.buttons = {"button_1": False, "button_2": False}

    def _hurry(self) -> None:
        self.hurries += 1

    def _reset(self) -> None:
        self.resets += 1
        if self.answers_reset:
            self.daemon.post(ResetDone())

    def exchange(self) -> None:
        """Do what the drive base's thread does: the robot moves as commanded."""
        output = self.safety.output(self.clock.monotonic())
        self.torque, self.out = output.is_torque_wanted, output.velocity
        self.heading_rad = math.remainder(self.heading_rad + self.out.angular_rad_s * PERIOD_S, math.tau)
        pose, now_s = Pose(0.0, 0.0, self.heading_rad), self.clock.monotonic()
        wheels = (
            self.out.linear_m_s - self.out.angular_rad_s * 0.08,
            self.out.linear_m_s + self.out.angular_rad_s * 0.08,
        )
        reading = DriveReading(now_s, pose, self.measured(), wheels, self.torque, buttons=dict(self.buttons))
        self.safety.on_drive_reading(reading)
        self.daemon.post(reading)

    def measured(self) -> Velocity:
        """The velocity that the wheels measure: the commanded one."""
        return self.out

    def scan(self, distance_m: float) -> None:
        now_s = self.clock.monotonic()
        self.safety.on_scan(now_s)
        self.daemon.post(Scan(now_s, (distance_m,) * BINS, RawScan((), (), ()), 5.0))

    def live(self, seconds: float, distance_m: float | None = None) -> None:
        """Let time pass, an exchange and a turn each period, a scan every fifth of a second."""
        for number in range(round(seconds / PERIOD_S)):
            if distance_m is not None and number % 10 == 0:
                self.scan(distance_m)
            self.exchange()
            self.daemon.cycle()
            self.clock.advance(PERIOD_S)

    def up(self, distance_m: float = 2.0) -> None:
        self.daemon.post(DeviceUp(Device.SCANNER))
        self.daemon.post(DeviceUp(Device.DRIVE))
        self.live(1.0, distance_m)

    def events(self) -> list[str]:
        return [entry["event"] for entry in self.log.entries if entry["kind"] == "event"]

    def component(self, name: str) -> Any:
        return self.log.entries[-1]["state"][name]


class Connected:
    """A program that notes what it receives.

    Args:
        scene: Scene with the daemon that it is connected to.
        name: Its name.
        serves: Parts of the model that it answers.
        may_request: True if it may be the caller of a layer.
    """

    def __init__(self, scene: Scene, name: str, serves: tuple[str, ...] = (), *, may_request: bool = True) -> None:
        self.scene = scene
        self.received: list[ToProgram] = []
        self.program = Program(name, self.received.append, frozenset(serves), may_request)
        scene.daemon.post(Attached(self.program))

    def say(self, make: Callable[..., FromProgram], *arguments: Any) -> list[ToProgram]:
        """Send the daemon a message: what the program receives in the same turn."""
        self.scene.daemon.post(make(self.program, *arguments))
        return self.cycle()

    def cycle(self) -> list[ToProgram]:
        """Run a turn of the loop, and return the messages to the program."""
        self.received.clear()
        self.scene.daemon.cycle()
        return list(self.received)

    def of[Kind](self, kind: type[Kind]) -> list[Kind]:
        """Return the messages of a kind among those to the program since its last message."""
        return [item for item in self.received if isinstance(item, kind)]

    def leave(self) -> None:
        """The connection ends."""
        self.scene.daemon.post(Detached(self.program))
        self.scene.daemon.cycle()
