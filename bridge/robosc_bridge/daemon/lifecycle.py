"""State of the bridge, and its transitions: operators' commands, devices, the safety layer, the supervisor.

The effect of each command in each state is described in docs/bridge-daemon.md.
"""

import logging
from collections.abc import Callable
from typing import assert_never

from robosc.execution.runtime.clock import Clock
from robosc_bridge.daemon.execution import Execution, Job
from robosc_bridge.daemon.orders import Latches, Orders, Until, answer
from robosc_bridge.daemon.readiness import Readiness
from robosc_bridge.daemon.robot.adapter import RobotAdapter
from robosc_bridge.daemon.robot.motion import MotionTarget
from robosc_bridge.daemon.robot.stop_switch import STOP_HELD, StopSwitch
from robosc_bridge.daemon.states import OperatorCommand, Order, State
from robosc_bridge.daemon.threads.reports import Device, DeviceDown, SafetyNotice
from robosc_bridge.safety import Reason, SafetyLayer

_log = logging.getLogger(__name__)

STOP_LIMIT_S = 3.0
"""Time that the motors may take to let go, in seconds."""

RESET_LIMIT_S = 15.0
"""Time that a reset of the motors may take, in seconds."""

OVER = "the bridge has ended"

# They end by themselves, and belong to every start and stop.
_ORDINARY = frozenset({Reason.STANDBY, Reason.TORQUE_AWAITED, Reason.COMMAND_SILENT})


class Lifecycle:
    """The state of the bridge; used by the loop's thread.

    Args:
        job: Job that is executed.
        safety: Safety layer through which all motion passes.
        readiness: Knowledge about the devices.
        orders: Orders without an answer.
        clock: The only source of time.

    Attributes:
        state: State of the bridge.
        problem: The fault that has stopped the robot; empty: none.
    """

    def __init__(self, job: Job, safety: SafetyLayer, readiness: Readiness, orders: Orders, clock: Clock) -> None:
        self.state = State.STARTING
        self.problem = ""
        self._latches = Latches(safety, orders)
        self._stays_after_fault = job.stays_after_fault
        self._starts_itself = job.starts_itself
        self._safety = safety
        self._readiness = readiness
        self._orders = orders
        self._clock = clock
        self._stop_end_s = self._reset_end_s = 0.0
        self._after_stop = State.STANDBY
        self._is_drive_lost = False
        self._failed_rotation = self._missing = ""
        self._hurry: Callable[[], None] = lambda: None
        self._reset_drive: Callable[[], None] = lambda: None
        self._are_alive: Callable[[], bool] = lambda: True

    def attach(
        self,
        execution: Execution,
        robot: RobotAdapter,
        motion: MotionTarget,
        switch: StopSwitch,
        note: Callable[[str, str], None],
    ) -> None:
        """Set the parts that it starts and stops, and the function that records events for watchers."""
        self._execution = execution
        self._robot = robot
        self._motion = motion
        self._switch = switch
        self._note = note

    @property
    def notice(self) -> SafetyNotice:
        """Notice of the safety layer."""
        return self._latches.notice

    def connect(
        self, hurry: Callable[[], None], reset_drive: Callable[[], None], are_alive: Callable[[], bool]
    ) -> None:
        """Set the functions that wake the drive base's thread, reset its motors, and check that all threads live."""
        self._hurry = hurry
        self._reset_drive = reset_drive
        self._are_alive = are_alive

    # Devices and the safety layer.

    def device_up(self, device: Device) -> None:
        """Handle the report that a device works."""
        _log.info("the %s is there", device)
        is_news = self._readiness.device_up(device)
        executor = self._execution.executor
        if is_news:
            self._note("device", f"the {device} is there")
        if executor is not None and is_news:
            self._robot.on_device_change(device, f"the {device} is back", executor, is_lost=False)

    def device_down(self, report: DeviceDown) -> None:
        """Handle the report that a device does not work."""
        is_news = self._readiness.device_down(report.device)
        if report.is_first:
            _log.error("%s: %s", report.device, report.problem)
            self._note("device", f"{report.device}: {report.problem}")
        executor = self._execution.executor
        if executor is None or not is_news:
            return
        self._robot.on_device_change(report.device, report.problem, executor, is_lost=True)
        if report.device is Device.DRIVE:
            # A fault that was there before does not end with the drive base's return.
            self._is_drive_lost = not self.problem
            self._fault(f"the drive base is lost: {report.problem}")

    def safety_changed(self, notice: SafetyNotice) -> None:
        """Log the reasons why nothing moves; a reason that only a person can clear ends the run."""
        known, self._latches.notice = self.notice.warnings, notice
        for warning in notice.warnings:
            if warning not in known:
                _log.warning("%s", warning)
        for reason in notice.reasons:
            # Before the start, no device has reported anything yet.
            is_news = self.state is State.RUNNING and reason not in _ORDINARY
            _log.log(logging.WARNING if is_news else logging.DEBUG, "%s", reason)
        latched = self._latches.latched
        if latched and self.state is State.RUNNING:
            self._fault(" ".join(latched))

    # Commands.

    def execute(self, order: Order) -> None:
        """Carry out an order, or answer it with the reason why not."""
        self._orders.arrived(order)
        command = order.command
        text = f"{command} ({order.by})" if order.by else str(command)
        _log.info("%s", text)
        self._note("order", text)
        if self.state is State.OVER:
            answer(order, OVER)
            return
        match command:
            case OperatorCommand.START:
                self._order_start(order)
            case OperatorCommand.STOP:
                # A reset that is under way would forget this stop, which came after it.
                self._orders.resolve(Until.RESET, str(Reason.OPERATOR_STOP))
                self._switch.stop(self._execution.executor)
                self._deliver_pending()
                answer(order, "")
            case OperatorCommand.STANDBY:
                self._order_standby(order)
            case OperatorCommand.RESUME:
                why = self._switch.resume(self._execution.executor)
                self._deliver_pending()
                answer(order, why)
            case OperatorCommand.RESET:
                self._order_reset(order)
            case OperatorCommand.QUIT:
                if self.state is State.FAULT:
                    # It was reported when it came; whoever wanted the end gets an orderly one.
                    self.problem = ""
                self._orders.wait(Until.RESTING, order)
                if self.state is not State.STOPPING:
                    self._end("the bridge ends", State.OVER)
                self._after_stop = State.OVER
            case _:
                assert_never(command)

    def _deliver_pending(self) -> None:
        if self._execution.executor is not None:
            self._robot.deliver_pending(self._execution.executor)

    def _order_start(self, order: Order) -> None:
        self._look_for_devices()
        why = self._why_not_start()
        if why:
            answer(order, why)
            return
        if self.state is State.STANDBY:
            self._begin()
        # The supervisor's first steps have their result at the end of this cycle.
        self._orders.wait(Until.STARTED, order)

    def _why_not_start(self) -> str:
        if self.state is State.STARTING:
            return f"the robot is starting: {self._readiness.missing()}"
        if self.state is State.STOPPING:
            return "the robot is being stopped"
        if self.state is State.FAULT:
            return f"the robot is in fault: {self.problem}; reset it first"
        if self._orders.is_halt_coming:
            return "a stop was requested meanwhile"
        if self._orders.is_waiting(Until.RESET):
            return "the motors are being reset"
        latched = self._latches.held(is_stopped=self._switch.is_stopped)
        if latched:
            return f"{latched} Resume or reset it first."
        if self.state is State.STANDBY and self._robot.left_goals:
            return f"goals of the last run have not ended: {', '.join(self._robot.left_goals)}"
        return "" if self.state is State.RUNNING else self._readiness.missing() or self._dead_thread()

    def _dead_thread(self) -> str:
        return (
            ""
            if self._are_alive()
            else "a thread of a device or a remote endpoint has ended; the bridge must be restarted"
        )

    def _order_standby(self, order: Order) -> None:
        match self.state:
            case State.STARTING:
                self._starts_itself = False
                answer(order, "")
            case State.STANDBY:
                answer(order, "")
            case State.RUNNING:
                self._orders.wait(Until.RESTING, order)
                self._end("standby", State.STANDBY)
            case State.STOPPING:
                self._orders.wait(Until.RESTING, order)
            case _:
                answer(order, f"the robot is in fault: {self.problem}; reset it first")

    def _order_reset(self, order: Order) -> None:
        if self.state is State.STOPPING and not self._orders.is_waiting(Until.RESET):
            answer(order, "the robot is being stopped")
            return
        self._orders.wait(Until.RESET, order)
        if self.state is State.RUNNING:
            # First to standby: motors that move are not reset.
            self._end("reset", State.STANDBY)
        elif self.state is not State.STOPPING:
            self._reset()

    def _reset(self) -> None:
        """Let the drive base reset its motors: the fault of one that has switched itself off ends with that alone."""
        why = "" if self._readiness.is_drive_there else "the drive base is not there"
        why = why or (STOP_HELD if self._switch.is_held else "")
        if why:
            _log.error("reset: %s", why)
            self._orders.resolve(Until.RESET, why)
            return
        self._reset_end_s = self._clock.monotonic() + RESET_LIMIT_S
        self._reset_drive()

    def reset_done(self, problem: str) -> None:
        """Clear what has latched, if the drive base has reset its motors and reports no problem."""
        if self._orders.is_waiting(Until.RESET):
            problem = problem or self._latches.release()
            if not problem:
                self._switch.reset()
            if not problem and self.state is State.FAULT:
                self.state, self.problem = State.STANDBY, ""
        _log.log(logging.ERROR if problem else logging.INFO, "reset: %s", problem or "done")
        self._orders.resolve(Until.RESET, problem)

    # Runs.

    def _begin(self) -> None:
        executor = self._execution.begin()
        self.problem = ""
        self.state = State.RUNNING
        self._enable()
        executor.start()
        self._switch.begin(executor)
        if self._readiness.scan is not None:
            # It must not decide on nothing while the last one is at hand.
            self._robot.on_scan(self._readiness.scan, executor)
        _log.info("running")

    def _enable(self) -> None:
        """Let the safety layer leave standby, unless it is to stay there."""
        self._safety.enable()
        if self._orders.is_halt_coming:
            # Its own word to the layer may have come just before this one.
            self._safety.disable()

    def _end(self, reason: str, then: State) -> None:
        """Bring the robot to rest; `then` follows once the motors have let go."""
        if self._execution.executor is not None:
            self._execution.executor.stop(reason)
        self._motion.stop(self._clock.monotonic(), reason)
        self._safety.disable()
        self._hurry()
        if self.state is not State.STOPPING or self._after_stop is not State.OVER:
            # A wish to end the bridge holds, whatever fails on the way.
            self._after_stop = then
        self.state = State.STOPPING
        self._stop_end_s = self._clock.monotonic() + STOP_LIMIT_S

    def _fault(self, problem: str) -> None:
        _log.error("%s", problem)
        self._end(problem, State.FAULT if self._stays_after_fault else State.OVER)
        self.problem = f"{self.problem}; {problem}" if self.problem else problem

    def poll(self, now_s: float) -> None:
        """Check at the end of a cycle whether the state must change, and change it."""
        if self.state is State.RUNNING and not self._are_alive():
            self._fault("a thread of a device or a remote endpoint has ended")
        if self._failed_rotation and self.state is State.RUNNING:
            self._fault(f"a rotation has failed, and the model has no message for that: {self._failed_rotation}")
        self._failed_rotation = ""
        executor = self._execution.executor
        if self.state is State.RUNNING and executor is not None and executor.is_faulty:
            self._safety.supervisor_fault()
            self._fault("; ".join(executor.reasons))
        self._orders.resolve(Until.STARTED, "" if self.state is State.RUNNING else self.problem or "it was stopped")
        match self.state:
            case State.STARTING if self._look_for_devices() and self._starts_itself:
                if not self._orders.is_waiting(Until.RESET):
                    self._begin()
            case State.STOPPING if not self._readiness.has_torque or now_s >= self._stop_end_s:
                self._come_to_rest()
            case State.FAULT if self._is_drive_lost and self._readiness.is_drive_there:
                # The robot stands still until an operator resumes it.
                self._is_drive_lost = False
                self.problem = ""
                self.state = State.STANDBY
        if self._orders.is_waiting(Until.RESET) and self.state is not State.STOPPING and now_s >= self._reset_end_s:
            self._orders.resolve(Until.RESET, f"the motors were not reset within {RESET_LIMIT_S:g} s")

    def _look_for_devices(self) -> bool:
        """Leave the start once all devices are there; whether it does now."""
        missing = self._readiness.missing() if self.state is State.STARTING else ""
        if missing and missing != self._missing:
            _log.info("waiting: %s", missing)
        self._missing = missing
        are_there = self.state is State.STARTING and not missing
        if are_there:
            self.state = State.STANDBY
            _log.info("standby")
        return are_there

    def _come_to_rest(self) -> None:
        """Finish a stop: what was executed is at rest, or will not come to rest."""
        has_let_go = not self._readiness.has_torque
        if not has_let_go:
            self.problem = self.problem or f"the motors have not let go within {STOP_LIMIT_S:g} s"
            _log.error("%s", self.problem)
        self._execution.end()
        self.state = self._after_stop
        if self.state is State.STANDBY and not has_let_go:
            self.state = State.FAULT
        _log.info("%s", self.state)
        self._orders.resolve(Until.RESTING, "" if has_let_go and self.state is not State.FAULT else self.problem)
        if self._orders.is_waiting(Until.RESET) and self.state is not State.OVER:
            self._reset()

    def operator_stop(self) -> None:
        """Stop the robot on behalf of the operator."""
        self._orders.resolve(Until.RESET, str(Reason.OPERATOR_STOP))
        self._safety.operator_stop()
        self._hurry()
        # Earlier motions do not move the robot after the stop.
        self._robot.stop("the operator has stopped the robot")

    def operator_resume(self) -> str:
        """Let the robot continue after an operator's stop; return why it cannot, or an empty text."""
        if self.state in (State.STOPPING, State.OVER):
            return "the robot is being stopped"
        if self.state is State.FAULT:
            return f"the robot is in fault: {self.problem}; reset it first"
        latched = self._latches.latched
        why = f"{' '.join(latched)} Reset it first." if latched else self._latches.release()
        if why:
            _log.error("the robot cannot go on: %s", why)
        elif self.state is State.RUNNING:
            # Motions that were commanded meanwhile do not move it either.
            self._robot.stop("the operator had stopped the robot")
            self._enable()
        return why

    def rotation_failed(self, reason: str) -> None:
        """Record the failure of a rotation for which the model has no message."""
        self._failed_rotation = reason or "it was ended"
