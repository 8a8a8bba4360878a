"""Table of promises: for each drive base and each fault who stops the wheels, within which time, and runs that show it.

The page is docs/bridge-promises.md; `acceptance/bridge/daemon/measure_promises.py` writes its table.
"""

import errno
import io
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest import mock

from robosc.execution.runtime.event_log import JsonLinesLog
from robosc.execution.runtime.requests import PolicyDecisions
from robosc_bridge.daemon.states import State
from robosc_bridge.transport.system_host import SYSTEM_HOST, SystemHost
from robosc_simulated import SimulatedTurtleBot3, Walls
from robosc_simulated.virtual_host import VirtualHost
from support.driven import MODEL, Driven, Recorded, configured, driven
from support.robot_faults import empty, wires

PAGE = Path(__file__).parents[2] / "docs" / "bridge-promises.md"
HEAD = "| fault | drive | who stops the wheels | promised | virtual clock | real time |"
BASES = ("opencr", "dynamixel", "mavlink-rover")
GOES_ON_S = 1.5
"""Time for which a robot must go on where nothing is to stop it, in seconds."""

_HALT_S = 4.0
_TOO_LATE_S = 60.0
_STANDS_S = 1.0

Cause = Callable[[], object]
Prepare = Callable[[Driven, ExitStack], Cause]


class PromiseBrokenError(AssertionError):
    """A robot did not do what is promised."""


@dataclass(frozen=True)
class Promise:
    """One row of the table.

    Attributes:
        fault: Fault of a robot that moves.
        base: Driver of its drive base.
        by: Part that stops the wheels.
        promised_s: Time within which they are commanded to stand still for good; None: they go on.
        prepare: Function that prepares the fault, and returns what lets it happen.
        number: Signal that is the fault where the bridge is a process; None: there it is as on a virtual host.
        sections: Sections of the configuration, as of `driven`.
        velocity: Velocity that the supervisor wants.
    """

    fault: str
    base: str
    by: str
    promised_s: float | None
    prepare: Prepare
    number: signal.Signals | None = None
    sections: Mapping[str, str] = field(default_factory=dict)
    velocity: tuple[float, float] = (0.06, 1.0)


def measured_s(promise: Promise, chance: random.Random, host: VirtualHost | SystemHost | None = None) -> float:
    """Let a fault happen at any time to a robot that moves; return the time until its wheels are to stand still.

    Where nothing is to stop them, return the time for which they have gone on.

    Args:
        promise: Row of the table.
        chance: Source of the time at which it happens.
        host: Host on which the bridge runs; None: a virtual one.

    Raises:
        AssertionError: The promise was not kept.
    """
    if promise.number is not None and host is SYSTEM_HOST:
        return _of_a_process_s(promise, promise.number, chance)
    sections = dict(promise.sections)
    with ExitStack() as stack:
        made = driven(promise.base, "lds02", promise.velocity, host=host, before=lambda robot: None, **sections)
        bridge = stack.enter_context(made)
        cause = promise.prepare(bridge, stack)
        bridge.steady()
        bridge.host.sleep(chance.uniform(0.0, 0.3))
        if promise.promised_s is not None:
            return bridge.stopped_after(cause, promise.promised_s)
        cause()
        commanded = len(bridge.trace.commanded)
        bridge.host.sleep(GOES_ON_S)
        is_stopped = any(wheels == [0.0, 0.0] for _, *wheels in bridge.trace.commanded[commanded:])
        if is_stopped or bridge.state is not State.RUNNING or bridge.wheels_m_s == (0.0, 0.0):
            raise PromiseBrokenError(f"it did not go on: {bridge.messages}")
        return GOES_ON_S


def _of_a_process_s(promise: Promise, number: signal.Signals, chance: random.Random) -> float:
    """Measure in real time what happens to the wheels when the bridge's process gets a signal."""
    with TemporaryDirectory() as folder, SimulatedTurtleBot3("burger", promise.base, "lds02") as robot:
        trace = Recorded(robot.base_line.device, robot)
        robot.base_line.device = trace
        linear, angular = map(str, promise.velocity)
        model, file = Path(folder) / "runner.rscd", Path(folder) / "bridge.yaml"
        model.write_text(MODEL.replace("LINEAR", linear).replace("ANGULAR", angular), encoding="utf-8")
        file.write_text(configured(robot, promise.base, "lds02", promise.sections), encoding="utf-8")
        command = [sys.executable, "-m", "robosc_bridge.main", "run", "--model", str(model), "--config", str(file)]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            _wait(
                lambda: trace.commanded[-1][1:] != (0.0, 0.0) and robot.time.now_s() - trace.commanded[-1][0] > 0.3,
                process,
            )
            time.sleep(chance.uniform(0.0, 0.3))
            begin_s = robot.time.now_s()
            process.send_signal(number)
            _wait(lambda: _stands(trace, robot), None)
        finally:
            process.kill()
            process.wait()
        took_s = trace.commanded[-1][0] - begin_s
    if promise.promised_s is None or took_s > promise.promised_s:
        raise PromiseBrokenError(f"{took_s:.3f} s instead of {promise.promised_s} s")
    return took_s


def _stands(trace: Recorded, robot: SimulatedTurtleBot3) -> bool:
    trace.look()
    return trace.commanded[-1][1:] == (0.0, 0.0) and robot.time.now_s() - trace.commanded[-1][0] > _STANDS_S


def _wait(condition: Callable[[], bool], process: subprocess.Popen[bytes] | None) -> None:
    end_s = time.monotonic() + _TOO_LATE_S
    while not condition():
        if process is not None and process.poll() is not None:
            raise PromiseBrokenError("the bridge has ended by itself before anything happened")
        if time.monotonic() > end_s:
            raise PromiseBrokenError(f"waited {_TOO_LATE_S:g} s in vain")
        time.sleep(0.005)


# Functions that let the faults happen.


def _halt(bridge: Driven, _: ExitStack) -> Cause:
    """A process that is killed, halted or suspended: nothing of it goes on."""
    names = ("drive", "scanner", "loop", f"MAVLink {bridge.robot.base_path}")

    def suspend() -> None:
        assert isinstance(bridge.host, VirtualHost)
        bridge.host.suspend(_HALT_S, *names)

    return suspend


def _after(cause: Callable[[Driven], object]) -> Prepare:
    return lambda bridge, stack: lambda: cause(bridge)


def _dies(bridge: Driven, _: ExitStack) -> Cause:
    """A motor that is not there any more."""

    def dies() -> None:
        if bridge.robot.rover is None:
            bridge.robot.right.brown_out(0.0)
        else:
            bridge.robot.world.right.fastest_rad_s = 0.0

    return dies


def _is_held(bridge: Driven) -> None:
    # The faster one: of a rover, no wheel is watched that is commanded less than 0.04 m/s.
    bridge.robot.world.right.is_blocked = True


def _is_overloaded(bridge: Driven) -> None:
    if bridge.robot.rover is None:
        bridge.robot.left.overload()
    else:
        bridge.robot.rover.disarm()


def _sees_nothing_ahead(bridge: Driven) -> None:
    with bridge.robot.time.lock:
        bridge.robot.world.walls = Walls(((-2.0, -1.5, -2.0, 1.5),))


def _fails(bridge: Driven, stack: ExitStack) -> Cause:
    failing = mock.patch.object(PolicyDecisions, "decide", side_effect=RuntimeError("in a decision"))
    return lambda: stack.enter_context(failing)


def _operator_goes(bridge: Driven, stack: ExitStack) -> Cause:
    there = [True]

    def sees() -> None:
        while there and bridge.state is not State.OVER:
            bridge.machine.operations.operator_seen()
            bridge.host.sleep(0.02)

    operator = bridge.host.thread(sees, "operator")
    operator.start()
    # The operator's thread must end before the host does, whatever becomes of the run.
    stack.callback(lambda: operator.join(_TOO_LATE_S))
    stack.callback(bridge.machine.quit)
    return there.clear


def _view_goes(bridge: Driven, stack: ExitStack) -> Cause:
    """A page that watches everything, and then neither reads nor says that it is gone."""
    seen = bridge.machine.operations.feed.subscribe(lambda: None)
    stack.callback(seen.close)
    return seen.take


class _FullDisk(io.StringIO):
    def write(self, text: str) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")


def _disk_fills(bridge: Driven, stack: ExitStack) -> Cause:
    log = JsonLinesLog(_FullDisk())
    stack.callback(log.close)
    return lambda: setattr(bridge.log, "write", log.write)


def _clock_jumps(bridge: Driven, stack: ExitStack) -> Cause:
    """The clock on the wall is set back by an hour."""
    wall_s = time.time() - 3600.0
    return lambda: stack.enter_context(mock.patch("time.time", lambda: wall_s))


# The table.

LINE = {"options": "{}"}
ITSELF = {
    "opencr": "OpenCR, 0.5 s after its host's last heartbeat",
    "dynamixel": "the servos' bus watchdogs, after 0.5 s",
    "mavlink-rover": "the autopilot, when its velocity target is 3 s old",
}
LONE_S = {"opencr": 0.56, "dynamixel": 0.56, "mavlink-rover": 3.06}
LAYER = "the safety layer: "
Times = Mapping[str, float | None]


def _all(time_s: float | None) -> Times:
    return dict.fromkeys(BASES, time_s)


_ROWS: tuple[tuple[str, Mapping[str, str] | str, Times, Prepare, dict[str, object]], ...] = (
    ("`kill -9` of the bridge", ITSELF, LONE_S, _halt, {"number": signal.SIGKILL}),
    ("SIGSTOP of the bridge", ITSELF, LONE_S, _halt, {"number": signal.SIGSTOP}),
    ("suspend of the computer", ITSELF, LONE_S, _halt, {"number": signal.SIGSTOP}),
    ("the base is unplugged", ITSELF, LONE_S, _after(lambda bridge: bridge.robot.base_line.disconnect()),
     {"sections": LINE}),
    ("half-open line: the base hears nothing", ITSELF, LONE_S, _after(lambda bridge: wires(bridge, is_deaf=True)),
     {"sections": LINE}),
    ("half-open line: the bridge hears nothing", LAYER + "`MOTOR_SILENT`",
     {"opencr": 0.2, "dynamixel": 0.2, "mavlink-rover": 0.4},
     _after(lambda bridge: wires(bridge, drop_share=1.0)), {"sections": LINE}),
    ("a servo is mute, or a rover's motor is gone",
     {"opencr": "OpenCR, which carries out the host's last command (zero) late",
      "dynamixel": "the driver, which stops the other motor",
      "mavlink-rover": LAYER + "`WHEEL_ASTRAY`"},
     {"opencr": 1.1, "dynamixel": 0.2, "mavlink-rover": 2.3}, _dies, {"sections": LINE}),
    ("a motor is dead: its wheel is held", LAYER + "`MOTOR_FAULT`, `WHEEL_ASTRAY`",
     {"opencr": 0.9, "dynamixel": 0.9, "mavlink-rover": 2.3}, _after(_is_held), {}),
    ("the LiDAR stalls", LAYER + "`SCAN_STALE`", _all(0.56),
     _after(lambda bridge: setattr(bridge.robot.scanner, "is_stalled", True)), {}),
    ("the LiDAR is blind ahead", LAYER + "`SCAN_BLIND`", _all(0.4), _after(_sees_nothing_ahead),
     {"velocity": (0.06, 0.0)}),
    ("the battery is empty", LAYER + "`BATTERY_LOW`", {"opencr": 4.1, "dynamixel": 4.1, "mavlink-rover": 1.1},
     _after(empty), {}),
    ("overload: a motor shuts down",
     {"opencr": LAYER + "`MOTOR_FAULT`", "dynamixel": LAYER + "`MOTOR_FAULT`",
      "mavlink-rover": "the autopilot, which disarms"},
     {"opencr": 0.1, "dynamixel": 0.1, "mavlink-rover": 0.1}, _after(_is_overloaded), {}),
    ("the supervisor fails", LAYER + "`SUPERVISOR_FAULT`", _all(0.1), _fails, {}),
    ("the operator is gone (`operator_link_timeout_s: 0.3`)", LAYER + "`OPERATOR_LOST`", _all(0.36), _operator_goes,
     {"sections": {"safety": "{operator_link_timeout_s: 0.3}", "remote": "{grpc_address: '127.0.0.1:1'}"}}),
    ("the view is gone", "nobody: a page only watches; it is not the operator's link", _all(None), _view_goes, {}),
    ("the disk is full", "nobody: entries of the log are dropped and counted", _all(None), _disk_fills, {}),
    ("the clock jumps", "nobody: times come from a clock that cannot be set", _all(None), _clock_jumps, {}),
)  # fmt: skip

PROMISES: tuple[Promise, ...] = tuple(
    Promise(fault, base, by if isinstance(by, str) else by[base], times_s[base], prepare, **rest)  # type: ignore[arg-type]  # by name
    for fault, by, times_s, prepare, rest in _ROWS
    for base in BASES
)


def row(promise: Promise, virtual_s: float, real_s: float) -> str:
    """Return a row of the page in Markdown; where nothing stops the wheels, both times read 'continues'."""

    def shown(time_s: float) -> str:
        return "continues" if promise.promised_s is None else f"{time_s:.2f} s"

    promised = "continues" if promise.promised_s is None else f"{promise.promised_s:g} s"
    cells = (promise.fault, f"`{promise.base}`", promise.by, promised, shown(virtual_s), shown(real_s))
    return f"| {' | '.join(cells)} |"
