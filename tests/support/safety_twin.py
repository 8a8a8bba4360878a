"""The safety layer again, slow and obvious: it keeps everything that ever happened and looks it all up each time."""

import math
from dataclasses import dataclass, field
from typing import Any

from robosc_bridge.devices.interface import STANDSTILL, BatteryLevel, DriveReading, MotorFault, Velocity
from robosc_bridge.safety import LATCHING, Output, Reason, SafetyLimits

_FACTS = {"scan": Reason.SCAN_STALE, "loop": Reason.LOOP_OVERRUN, "operator": Reason.OPERATOR_LOST}


@dataclass
class Past:
    """One output of the past, or None of these values for anything else that happened."""

    name: str
    value: Any = None
    time_s: float = 0.0
    # Fields of an output: the clock, its reasons, and the time since which torque was wanted or to go.
    now_s: float = 0.0
    reasons: frozenset[Reason] = frozenset()
    velocity: Velocity = STANDSTILL
    torque_since_s: float | None = None
    letting_go_s: float | None = None
    latched: frozenset[Reason] = field(default_factory=frozenset)


class SafetyTwin:
    """Says what a safety layer should put out.

    Args:
        limits: Of the layer.
    """

    def __init__(self, limits: SafetyLimits) -> None:
        self.limits = limits
        self.past: list[Past] = []

    def happens(self, name: str, value: Any = None, time_s: float = 0.0) -> None:
        """Note an event for the layer."""
        self.past.append(Past(name, value, time_s))

    def loop_cycled(self, time_s: float) -> None:
        """The loop was at work then."""
        self._note_pause(time_s)
        self.happens("loop", None, time_s)

    def _note_pause(self, time_s: float) -> None:
        """Note a pause if neither an output nor the loop was there for too long before this time."""
        at_work_s = [each.time_s for each in self._since_last("output") if each.name == "loop"]
        last_s = max([self.past_now_s(), *filter(math.isfinite, at_work_s)])
        is_long = math.isfinite(time_s) and time_s - last_s > self.limits.pause_s
        if is_long and self._is_wanted() and self._torque_story()[0]:
            self.past.append(Past("pause", latched=frozenset({Reason.PAUSED})))

    def _since_last(self, *names: str) -> list[Past]:
        """Return everything that has happened from the last of these on, that one included; all if there was none."""
        for index in reversed(range(len(self.past))):
            if self.past[index].name in names:
                return self.past[index:]
        return self.past

    def _last(self, name: str) -> Past | None:
        return next((each for each in reversed(self.past) if each.name == name), None)

    def _is_stale(self, name: str, timeout_s: float | None, now_s: float) -> bool:
        if timeout_s is None:
            return False
        for index in reversed(range(len(self.past))):
            if self.past[index].name == "pause" and name != "operator":
                return True
            if self.past[index].name == name and math.isfinite(self.past[index].time_s):
                looked_s = [each.now_s for each in self.past[index:] if each.name == "output"]
                return now_s - min([self.past[index].time_s, *looked_s, now_s]) > timeout_s
        return True

    def past_now_s(self) -> float:
        """The clock at the last output."""
        last = self._last("output")
        return 0.0 if last is None else last.now_s

    def _readings(self) -> list[DriveReading]:
        return [each.value for each in self.past if each.name == "drive"]

    def is_empty(self) -> bool:
        """Return True if the battery is empty, by its voltage or by the last word of the drive base on it."""
        levels = [each.battery_level for each in self._readings() if each.battery_level is not None]
        is_low = self.limits.battery_stop_v is not None and self.mean_v() <= self.limits.battery_stop_v
        return is_low or levels[-1:] == [BatteryLevel.EMPTY]

    def mean_v(self) -> float:
        """Return the mean voltage of the last time that was long enough, in volts."""
        mean_v, window = math.inf, list[tuple[float, float]]()
        for reading in self._readings():
            if reading.battery_v is None or not math.isfinite(reading.battery_v + reading.time_s):
                continue
            if window and reading.time_s < window[0][1]:
                window = []
            window.append((reading.battery_v, reading.time_s))
            if reading.time_s - window[0][1] >= self.limits.battery_mean_s:
                mean_v, window = sum(voltage for voltage, _ in window) / len(window), []
        return mean_v

    def _torque_story(self) -> tuple[bool, DriveReading | None, list[tuple[tuple[float, float], DriveReading]]]:
        """Return whether the motors reported that they hold, the last reading if they had let go by then.

        The third part is what was read while they held.
        """
        began = [each for each in self.past if each.name in ("output", "drive", "pause")]
        for index in reversed(range(len(began))):
            if began[index].name == "output" and began[index].torque_since_s is None:
                began = began[index + 1 :]
                break
        is_seen, lost = False, None
        read: list[tuple[tuple[float, float], DriveReading]] = []
        since_s: float | None = None
        velocity = STANDSTILL
        for each in began:
            if each.name == "output":
                since_s, velocity = each.torque_since_s, each.velocity
            elif each.name == "pause":
                read = []
            elif since_s is not None and each.value.time_s > since_s:
                lost = each.value if is_seen and not each.value.is_torque_on else None
                is_seen = is_seen or each.value.is_torque_on
                if each.value.is_torque_on:
                    turn = velocity.angular_rad_s * self.limits.separation_m / 2
                    read.append(((velocity.linear_m_s - turn, velocity.linear_m_s + turn), each.value))
        return is_seen, lost, read

    def _is_astray(self, read: list[tuple[tuple[float, float], DriveReading]]) -> bool:
        """Return True if a wheel is off its goal, as its motor goes there, in all readings of too long a time."""
        found = False
        for wheel in (0, 1):
            off = list[float]()
            now, last_s = None, 0.0
            for goals, each in read:
                speed = each.wheels_m_s[wheel]
                if now is None:
                    now, last_s = speed if math.isfinite(speed) else 0.0, each.time_s
                passed_s, last_s = max(0.0, each.time_s - last_s), each.time_s
                now = self._moved_by(now, goals[wheel], each.acceleration_m_s2, passed_s)
                follows = abs(now - speed) <= self.limits.astray_m_s or abs(now - speed) <= abs(now) / 2
                off = [] if follows else [*off, each.time_s]
            found = found or bool(off and off[-1] - min(off) > self.limits.astray_s)
        return found

    @staticmethod
    def _moved_by(now: float, goal: float, acceleration: float | None, passed_s: float) -> float:
        if acceleration is None:
            return goal
        step = acceleration * passed_s
        return min(goal, now + step) if goal >= now else max(goal, now - step)

    def _is_unbidden(self, read: list[tuple[tuple[float, float], DriveReading]]) -> bool:
        """Return True if a wheel rotates in all readings of too long a time, nothing being asked since all stood."""
        begin = max([index + 1 for index, (goals, _) in enumerate(read) if goals != (0.0, 0.0)], default=0)
        fastest = [(self._fastest(each), each.time_s) for _, each in read[begin:]]
        still = [index for index, (speed, _) in enumerate(fastest) if speed <= self.limits.standstill_m_s]
        moving = list[float]()
        for speed, time_s in fastest[still[0] :] if still else []:
            moving = [] if speed <= self.limits.astray_m_s else [*moving, time_s]
        return bool(moving) and moving[-1] - min(moving) > self.limits.unbidden_s

    @staticmethod
    def _fastest(reading: DriveReading) -> float:
        speeds = [abs(speed) for speed in reading.wheels_m_s]
        return math.inf if any(map(math.isnan, speeds)) else max(speeds)

    def latched(self) -> set[Reason]:
        """Return the reasons that have arisen since the last reset that was allowed, and that hold until the next."""
        found = set[Reason]()
        begin = 0
        for index, each in enumerate(self.past):
            if each.name == "reset" and each.value:
                begin, found = index, set()
            found |= each.latched
        for each in self.past[begin:]:
            found |= {"stop": {Reason.OPERATOR_STOP}, "fault": {Reason.SUPERVISOR_FAULT}}.get(each.name, set())
            if each.name == "drive" and each.value.faults - {MotorFault.VOLTAGE, MotorFault.UNCOMMANDED}:
                found.add(Reason.MOTOR_FAULT)
            if each.name == "drive" and MotorFault.UNCOMMANDED in each.value.faults:
                found.add(Reason.UNBIDDEN_MOTION)
        return found

    def answers(self, reading: DriveReading) -> None:
        """The drive base has answered; what latches of it is noted at once."""
        self.happens("drive", reading, reading.time_s)
        _, lost, read = self._torque_story()
        last = self._last("output")
        is_judged = bool(read) and read[-1][1] is reading and self._is_wanted()
        latched = {
            Reason.BATTERY_LOW: self.is_empty(),
            # Torque that is to go off anyway is not lost.
            Reason.TORQUE_LOST: lost is reading
            and last is not None
            and last.letting_go_s is None
            and self._is_wanted(),
            Reason.WHEEL_ASTRAY: is_judged and self._is_astray(read),
            Reason.UNBIDDEN_MOTION: is_judged and self._is_unbidden(read),
        }
        self.past[-1].latched = frozenset(reason for reason, is_so in latched.items() if is_so)

    def _is_wanted(self) -> bool:
        last = self._last("output")
        return last is not None and last.torque_since_s is not None

    def _torque_off(self) -> set[Reason]:
        found = {Reason.MOTOR_FAULT, Reason.TORQUE_LOST, Reason.WHEEL_ASTRAY, Reason.UNBIDDEN_MOTION}
        return found | ({Reason.OPERATOR_STOP} if self.limits.is_torque_off_on_operator_stop else set())

    def reset(self) -> tuple[Reason, ...]:
        """Return the reasons that forbid a reset."""
        last, readings = self._last("output"), self._readings()
        remaining = set[Reason]()
        for reason in self.latched():
            if last is None or reason not in last.reasons:
                remaining.add(reason)
            if reason is Reason.MOTOR_FAULT and readings[-1].faults - {MotorFault.VOLTAGE, MotorFault.UNCOMMANDED}:
                remaining.add(reason)
            if reason is Reason.BATTERY_LOW and self.is_empty():
                remaining.add(reason)
            if reason in self._torque_off() and self._is_wanted():
                remaining.add(reason)
        self.happens("reset", not remaining)
        return tuple(reason for reason in LATCHING if reason in remaining)

    def _is_enabled(self) -> bool:
        switches = [
            each for each in self.past if each.name in ("enable", "disable") or (each.name == "reset" and each.value)
        ]
        return bool(switches) and switches[-1].name == "enable"

    def _command(self) -> Velocity:
        """The last one, if it was given after an output without reasons, and none nor any change came since."""
        is_found, velocity = False, STANDSTILL
        for each in reversed(self.past):
            if each.name in ("enable", "disable") or (each.name == "reset" and each.value):
                return STANDSTILL
            if each.name == "output":
                if each.reasons - {Reason.COMMAND_SILENT}:
                    return STANDSTILL
                if is_found:
                    return velocity
            if each.name == "command" and not is_found:
                is_found = True
                numbers = (each.value.linear_m_s, each.value.angular_rad_s, each.time_s)
                velocity = self._limited(*numbers[:2]) if all(map(math.isfinite, numbers)) else STANDSTILL
        return STANDSTILL

    def _is_held(self) -> bool:
        """Return True if there was a change or a reason since, or at, the last output."""
        since = self._since_last("output")
        if not since or since[0].name != "output" or since[0].reasons - {Reason.COMMAND_SILENT}:
            return True
        changes = ("enable", "disable", "pause")
        return any(each.name in changes or (each.name == "reset" and each.value) for each in since)

    def _limited(self, linear_m_s: float, angular_rad_s: float) -> Velocity:
        linear_m_s = sorted((-self.limits.linear_m_s, linear_m_s, self.limits.linear_m_s))[1]
        angular_rad_s = sorted((-self.limits.angular_rad_s, angular_rad_s, self.limits.angular_rad_s))[1]
        turn = angular_rad_s * self.limits.separation_m / 2
        factor = min(1.0, self.limits.wheel_m_s / (max(abs(linear_m_s - turn), abs(linear_m_s + turn)) or 1.0))
        return Velocity(linear_m_s * factor, angular_rad_s * factor)

    @staticmethod
    def _moved(present: float, wanted: float, up: float, down: float) -> float:
        # The product of the smallest numbers would be 0.
        if present < 0 < wanted or wanted < 0 < present:
            aim, most = 0.0, down
        elif abs(wanted) < abs(present):
            aim, most = wanted, down
        else:
            aim, most = wanted, up
        return aim if abs(aim - present) <= most else present + math.copysign(most, aim - present)

    def output(self, now_s: float) -> Output:
        """Return the output that the layer should give; its warnings are left out."""
        self._note_pause(now_s)
        limits = self.limits
        last = self._last("output") or Past("output")
        is_clock_wrong = not (math.isfinite(now_s) and now_s >= last.now_s)
        present, step_s = last.velocity, now_s - last.now_s
        if step_s > limits.motor_timeout_s:
            present, step_s = STANDSTILL, 0.0
        now_s = now_s if math.isfinite(now_s) else last.now_s
        is_seen, _, _ = self._torque_story()
        noted = set[Reason]()
        since_s = None if last.torque_since_s is None else min(last.torque_since_s, now_s)
        if since_s is not None and not is_seen and now_s - since_s > limits.torque_on_s:
            noted.add(Reason.TORQUE_LOST)
        latched = self.latched() | noted
        letting_go_s = None
        if self._is_enabled() and not latched & self._torque_off():
            if since_s is None:
                since_s, is_seen = now_s, False
        elif since_s is not None:
            letting_go_s = now_s if last.letting_go_s is None else min(last.letting_go_s, now_s)
            is_over = now_s - letting_go_s >= limits.torque_off_s or Reason.UNBIDDEN_MOTION in latched
            if is_over or self._is_still_since(letting_go_s, now_s):
                since_s = letting_go_s = None
        wanted = STANDSTILL if self._is_held() else self._command()
        failures = [each.name for each in self._since_last("drive") if each.name == "failure"]
        reasons = latched | {
            reason
            for name, reason in _FACTS.items()
            if self._is_stale(name, getattr(limits, f"{name}_timeout_s"), now_s)
        }
        if not self._is_enabled():
            reasons.add(Reason.STANDBY)
        if is_clock_wrong:
            reasons.add(Reason.CLOCK)
        if since_s is not None and not is_seen:
            reasons.add(Reason.TORQUE_AWAITED)
        if wanted != STANDSTILL and self._is_command_stale(now_s):
            reasons.add(Reason.COMMAND_SILENT)
        if self._is_stale("drive", limits.motor_timeout_s, now_s) or len(failures) >= limits.motor_failures:
            reasons.add(Reason.MOTOR_SILENT)
        if limits.is_stopped_when_blind and self._is_blind():
            reasons.add(Reason.SCAN_BLIND)
        if 0.0 in self._seen_ahead():
            reasons.add(Reason.SCAN_TOUCHING)
        velocity = STANDSTILL
        if not reasons and wanted != STANDSTILL:
            velocity = self._limited(
                self._moved(
                    present.linear_m_s,
                    wanted.linear_m_s,
                    limits.linear_acceleration_m_s2 * step_s,
                    limits.linear_deceleration_m_s2 * step_s,
                ),
                self._moved(
                    present.angular_rad_s,
                    wanted.angular_rad_s,
                    limits.angular_acceleration_rad_s2 * step_s,
                    limits.angular_deceleration_rad_s2 * step_s,
                ),
            )
        self.past.append(
            Past("output", None, 0.0, now_s, frozenset(reasons), velocity, since_s, letting_go_s, frozenset(noted))
        )
        return Output(velocity, since_s is not None, tuple(reason for reason in Reason if reason in reasons), ())

    def _is_blind(self) -> bool:
        """Return True if the last scan that reports ranges shows nothing where the last command leads to."""
        seen = self._seen_ahead()
        valid = [range_m for range_m in seen if math.isfinite(range_m)]
        return bool(seen) and len(valid) < self.limits.min_valid_share * 61

    def _seen_ahead(self) -> list[float]:
        """Return the ranges where the last command leads to; none for a rotation on the spot, or without a scan."""
        asked_m_s, scan = 0.0, list[float]()
        for each in self.past:
            if each.name == "disable" or (each.name == "reset" and each.value):
                asked_m_s = 0.0
            if each.name == "command":
                numbers = (each.value.linear_m_s, each.value.angular_rad_s, each.time_s)
                asked_m_s = each.value.linear_m_s if all(map(math.isfinite, numbers)) else 0.0
            if each.name == "scan" and each.value:
                scan = each.value
        middle = 0 if asked_m_s > 0 else 180
        return [scan[degree % 360] for degree in range(middle - 30, middle + 31)] if scan and asked_m_s != 0 else []

    def _is_command_stale(self, now_s: float) -> bool:
        # A command that was refused is no sign of life.
        heard = self._last("command")
        assert heard is not None
        index = next(i for i, each in enumerate(self.past) if each is heard)
        looked_s = [now_s]
        if not self._is_held():
            looked_s += [
                each.now_s
                for each in self.past[index:]
                if each.name == "output" and (each.velocity != STANDSTILL or Reason.COMMAND_SILENT in each.reasons)
            ]
        return now_s - min(heard.time_s, *looked_s) > self.limits.command_timeout_s

    def _is_still_since(self, time_s: float, now_s: float) -> bool:
        readings = [index for index, each in enumerate(self.past) if each.name == "drive"]
        if not readings:
            return False
        reading: DriveReading = self.past[readings[-1]].value
        looked_s = [
            each.now_s for each in self.past[readings[-1] :] if each.name == "output" and each.letting_go_s is not None
        ]
        is_still = all(abs(speed) <= self.limits.standstill_m_s for speed in reading.wheels_m_s)
        return is_still and min([reading.time_s, now_s, *looked_s]) > time_s
