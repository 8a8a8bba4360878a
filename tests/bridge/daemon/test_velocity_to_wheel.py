"""Times from a velocity that is let through to its bytes on the line, at all moments of an exchange."""

from collections.abc import Iterable

import pytest

from robosc_bridge.daemon.threads.device_thread import DeviceThread
from robosc_bridge.daemon.threads.workers import DriveWorker
from robosc_bridge.daemon.timing import Latency, Timing
from robosc_bridge.devices.interface import STANDSTILL, Velocity
from robosc_bridge.devices.robots import ROBOTS
from robosc_bridge.driver_registry import make_drive_base
from robosc_bridge.safety import SafetyLayer, SafetyLimits
from robosc_simulated import SimulatedTurtleBot3, VirtualHost
from robosc_simulated.line import Device, Sending
from robosc_simulated.profile import PROFILES

PERIOD_S = 0.02
COMMANDS = 60
LIMITS = SafetyLimits(
    linear_m_s=0.2,
    angular_rad_s=2.0,
    wheel_m_s=0.2,
    separation_m=0.16,
    scan_timeout_s=None,
    command_timeout_s=1.0,
    loop_timeout_s=1.0,
)

BIT_S = 1e-6
"""Time of a bit on a servo bus at 1 Mbps; a byte has ten."""

# Bytes of the goals of two servos, of the request for what they measure, and of an answer to it, which comes 500 us
# after what is before it on the bus.
_GOALS, _REQUEST, _ANSWER, _RETURN_S = 24, 16, 32, 500e-6
READ_S = (_GOALS + _REQUEST + 2 * _ANSWER) * 10 * BIT_S + 2 * _RETURN_S
"""Longest time in which the bus of two servos is not free for a command."""


class _Line:
    """A device, and the times at which it hears commands that are other than the one before."""

    def __init__(self, device: Device, host: VirtualHost) -> None:
        self._device = device
        self._host = host
        self._command = b""
        self.heard_s: list[float] = []

    @property
    def baud(self) -> int | None:
        return self._device.baud

    def receive(self, data: bytes, baud: int) -> Iterable[Sending]:
        # A write at 150 of the board, a synchronised write at 104 of the servos.
        for mark, length in ((b"\x03\x96\x00", 24), (b"\x83\x68\x00", 12)):
            _, found, behind = data.partition(mark)
            if found and behind[:length] != self._command:
                self._command = behind[:length]
                self.heard_s.append(self._host.monotonic())
        return self._device.receive(data, baud)

    def update(self) -> Iterable[Sending]:
        return self._device.update()

    def due_s(self) -> float:
        return self._device.due_s()

    def plug_in(self) -> None:
        self._device.plug_in()


def _measured(base: str, profile: str) -> tuple[list[float], Latency]:
    """Return how long commands at all moments of an exchange take: stops as the line sees it, all as the bridge does.

    A velocity begins with a ramp, whose first step may be none for a device; a stop passes as it is.
    """
    found: list[float] = []
    with (
        VirtualHost() as host,
        SimulatedTurtleBot3("burger", base, "lds01", clock=host, profile=profile, seed=3) as robot,
    ):
        line = robot.base_line.device = _Line(robot.base_line.device, host)
        body = ROBOTS["burger"].body if base == "mavlink-rover" else ROBOTS["burger"]
        safety, timing = SafetyLayer(LIMITS), Timing(host.monotonic)
        driver = make_drive_base(base, path=robot.base_path, robot=body, host=host)
        worker = DriveWorker(driver, safety, lambda report: None, PERIOD_S, host.monotonic, timing=timing)
        thread = DeviceThread(worker, host)
        thread.start()

        def command(velocity: Velocity, seconds: float) -> None:
            """Want a velocity that was decided on a scan of this moment."""
            now_s = host.monotonic()
            timing.scan_taken(now_s)
            timing.commanding()
            safety.loop_cycled(now_s)
            safety.command(velocity, now_s)
            thread.hurry()
            host.sleep(seconds)
            if velocity == STANDSTILL:
                found.extend(heard_s - now_s for heard_s in line.heard_s if heard_s >= now_s)

        command(STANDSTILL, 3.0)
        safety.enable()
        for _ in range(20):
            command(STANDSTILL, 0.1)
        # Its motors hold now; what came before does not count.
        timing = worker._timing = Timing(host.monotonic)
        found.clear()
        for number in range(COMMANDS):
            command(Velocity(0.0, 0.5), 0.3 + number * 0.00037)
            command(STANDSTILL, 0.2)
        (reported,) = [one for one in timing.figures().latencies if one.name == "scan_to_wheel"]
        thread.stop(5.0)
    return found, reported


@pytest.mark.parametrize("profile", ["ideal", "typical"])
def test_a_command_reaches_opencr_at_once_also_during_an_exchange(profile: str) -> None:
    found, reported = _measured("opencr", profile)
    assert (len(found), reported.count) == (COMMANDS, 2 * COMMANDS)
    assert max(found) == pytest.approx(0.0, abs=1e-9)
    assert reported.max_s == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("profile", ["ideal", "typical"])
def test_a_command_to_servos_waits_for_the_answers_that_are_on_the_bus(profile: str) -> None:
    limit_s = READ_S + PROFILES[profile].ftdi_s
    found, reported = _measured("dynamixel", profile)
    assert (len(found), reported.count) == (COMMANDS, 2 * COMMANDS)
    # It is not the end of the exchange, which comes later.
    assert limit_s / 3 < max(found) <= limit_s + 1e-6
    assert max(found) <= reported.max_s + 1e-6 <= limit_s + 2e-6


def test_a_target_is_sent_to_a_rover_at_once() -> None:
    _, reported = _measured("mavlink-rover", "ideal")
    assert reported.count == 2 * COMMANDS
    assert reported.max_s == pytest.approx(0.0, abs=1e-9)
