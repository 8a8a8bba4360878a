"""A wheel servo: its registers, its motor and its protections.

After the ROBOTIS e-Manual, pages XL430-W250 and XM430-W210. Where it is silent, the choice that a driver must be most
careful with is taken:

- a goal velocity that is written while torque is off is kept, and drives the wheel when torque comes on;
- a bus watchdog that trips stops the wheel and leaves the goals, which drive it again once the watchdog is cleared;
- only packets for this servo (its ID, or broadcast) feed its bus watchdog;
- torque cannot be switched on with a hardware error that has shut it off (error 1), nor is that error forgotten.

The motor follows goals in the velocity mode (1) and the PWM mode (16); in any other it holds its wheel.
"""

import math
from enum import IntFlag

from robosc_simulated.battery import Battery
from robosc_simulated.control_table import MODELS, ControlTable, Item
from robosc_simulated.packets import ALERT, Error
from robosc_simulated.world import Wheel, World

RAW_RAD_S = 0.229 * 2 * math.pi / 60
TICKS = 4096
_ACCELERATION_RAD_S2 = 214.577 * 2 * math.pi / 3600
_WATCHDOG_S = 0.020
# From which load on a motor that cannot rotate is protected, and below which voltage its processor stops: not stated by
# the e-Manual.
OVERLOAD_S = 1.0
_PROCESSOR_V = 5.5
# Silence after a reboot: not stated, "allow 0.5 s".
REBOOT_S = 0.35
_VOLTAGE_STEP_V = 0.02
# A small motor in a closed case: minutes; the e-Manual says only that it must cool for 20 minutes after overheating.
_AMBIENT_C, _WARMING_S, _WARMING_STEP_S = 33.0, 300.0, 0.1

_REVERSE, _TIME_BASED, _TORQUE_BY_GOAL = 0x01, 0x04, 0x08
_RESET_BY_MODE = frozenset(
    name
    for group in ("velocity i gain|velocity p gain|position d gain|position i gain|position p gain",
                  "feedforward 2nd gain|feedforward 1st gain|profile acceleration|profile velocity|goal velocity")
    for name in group.split("|")
)  # fmt: skip


class HardwareError(IntFlag):
    """Bits of Hardware Error Status (70), and of Shutdown (63), which chooses those that switch torque off."""

    VOLTAGE = 0x01
    OVERHEATING = 0x04
    ENCODER = 0x08
    SHOCK = 0x10
    OVERLOAD = 0x20


class Servo:
    """One servo and its wheel.

    Args:
        model: Key of `MODELS`.
        world: World that the wheel moves in.
        wheel: Wheel that it drives.
        device_id: Its ID.
        is_mirrored: True if it is mounted so that its own positive direction is backward.
        settings: Other items of the EEPROM that differ from the factory's, by name.
        battery: Battery that it lives from, until `brown_out` says otherwise; None: 12 V.

    Attributes:
        table: Its registers.
        voltage_v: Voltage at its input; see `brown_out`.
        temperature_c: Temperature of the motor; see `overheat`.
        time: Time that it lives by.
    """

    def __init__(
        self,
        model: str,
        world: World,
        wheel: Wheel,
        device_id: int,
        *,
        is_mirrored: bool = False,
        settings: dict[str, int] | None = None,
        battery: Battery | None = None,
    ) -> None:
        self.table = ControlTable(MODELS[model])
        self.voltage_v = 12.0
        self.temperature_c = 33.0
        self._battery = battery
        self._warmed_s = world.lived_s
        self._world = world
        self.time = world.time
        self._wheel = wheel
        self._direction = -1 if is_mirrored else 1
        self._gear = world.body.gear_ratio
        self._has_power = True
        self._silent_until_s = -math.inf
        self._heard_s = self.time.now_s()
        self._blocked_s: float | None = None
        self._registered: tuple[int, bytes] | None = None
        self._base_ticks = 0
        self.table["id"] = device_id
        for name, value in (settings or {}).items():
            self.table[name] = value
        self._boot()

    # Acts of tests.

    def overheat(self, temperature_c: float | None = None) -> None:
        """Make the motor hot: by default 5 degrees above its limit."""
        with self.time.lock:
            self.catch_up()
            self.temperature_c = self.table["temperature limit"] + 5.0 if temperature_c is None else temperature_c
            self._protect()

    def cool_down(self, temperature_c: float = 33.0) -> None:
        """Let it cool; what it has shut off stays off."""
        with self.time.lock:
            self.catch_up()
            self.temperature_c = temperature_c

    def overload(self) -> None:
        """Trip the protection against overload at once."""
        self.trip(HardwareError.OVERLOAD)

    def trip(self, error: HardwareError) -> None:
        """Let it find an error of its hardware."""
        with self.time.lock:
            self.catch_up()
            self._fail(error)

    def brown_out(self, voltage_v: float) -> None:
        """Set the voltage at its input: beyond its limits it flags an error, below 5.5 V it is off."""
        with self.time.lock:
            self.catch_up()
            self._battery = None
            self.voltage_v = voltage_v
            if voltage_v < _PROCESSOR_V:
                self._has_power = False
                self._release()
            elif not self._has_power:
                self._has_power = True
                self._restart()
            self._protect()
            self._drive()

    def block_wheel(self, is_blocked: bool = True) -> None:
        """Hold the wheel, or let it go; held against torque for a second, the motor is overloaded."""
        with self.time.lock:
            self.catch_up()
            self._wheel.is_blocked = is_blocked
            self.catch_up()

    def set_position(self, ticks: int) -> None:
        """Let the wheel's position be counted from here, as if it had turned so far: a wrap at 2^31 can come soon."""
        with self.time.lock:
            self.catch_up()
            self._base_ticks += ticks - self._position()

    # Methods for its bus.

    @property
    def device_id(self) -> int:
        """At present."""
        return self.table["id"]

    @property
    def answers(self) -> bool:
        """True if it has power and has started."""
        return self._has_power and self.time.now_s() >= self._silent_until_s

    @property
    def error(self) -> int:
        """The alert bit, which is part of every status."""
        return ALERT if self.table["hardware error status"] else Error.NONE

    def instruction_received(self) -> None:
        """An instruction for it has come: its bus watchdog begins anew."""
        self._heard_s = self.time.now_s()

    def catch_up(self) -> None:
        """Live until now."""
        self._world.catch_up()
        now_s = self.time.now_s()
        self._age()
        is_driven = self._has_power and bool(self.table["torque enable"])
        periods = self.table["bus watchdog"]
        if is_driven and 0 < periods < 0xFF and now_s - self._heard_s > periods * _WATCHDOG_S:
            self.table["bus watchdog"] = 0xFF
            self.table["profile acceleration"] = self.table["profile velocity"] = 0
            self._drive()
        if not (is_driven and self._wheel.is_blocked and self._wheel.goal_rad_s):
            self._blocked_s = None
        elif self._blocked_s is None:
            self._blocked_s = now_s
        elif now_s - self._blocked_s >= OVERLOAD_S:
            self._fail(HardwareError.OVERLOAD)

    def _age(self) -> None:
        """Let supply and temperature be what came of the time that has passed."""
        if self._battery is not None:
            voltage_v = self._battery.voltage_v()
            if abs(voltage_v - self.voltage_v) > _VOLTAGE_STEP_V:
                self.voltage_v = voltage_v
                self._protect()
                self._drive()
        warming_c = self._world.profile.warming_c
        passed_s = self._world.lived_s - self._warmed_s
        if warming_c and passed_s >= _WARMING_STEP_S:
            self._warmed_s = self._world.lived_s
            wheel = self._wheel
            is_held = wheel.is_blocked and wheel.goal_rad_s
            load = (1.0 if is_held else abs(wheel.speed_rad_s) / wheel.fastest_rad_s) if wheel.is_driven else 0.0
            end_c = _AMBIENT_C + warming_c * load
            self.temperature_c += (end_c - self.temperature_c) * (1.0 - math.exp(-passed_s / _WARMING_S))
            self._protect()

    def due_s(self) -> float:
        """Return the time when something will happen by itself."""
        found = math.inf
        if self._has_power and self.table["torque enable"]:
            if 0 < (periods := self.table["bus watchdog"]) < 0xFF:
                found = self._heard_s + periods * _WATCHDOG_S + 1e-4
            if self._blocked_s is not None:
                found = min(found, self._blocked_s + OVERLOAD_S)
        return found

    def read(self, address: int, length: int) -> tuple[int, bytes]:
        """The error's number, and the data if it is 0."""
        self._measure()
        return self.table.read(address, length)

    def write(self, address: int, data: bytes) -> int:
        """Write registers, with all that follows from it.

        Returns:
            The error's number.
        """
        error, found = self.table.check(address, data)
        if error:
            return error
        for item, value in found:
            if error := self._set(item, value):
                return error
        self._drive()
        return Error.NONE

    def register(self, address: int, data: bytes) -> int:
        """Keep a write for `act`; returns the error's number."""
        error, _ = self.table.check(address, data)
        if not error:
            self._registered = (address, data)
            self.table["registered instruction"] = 1
        return error

    def act(self) -> int:
        """Do what was registered; returns the error's number."""
        if self._registered is None:
            return Error.INSTRUCTION
        address, data = self._registered
        self._registered = None
        self.table["registered instruction"] = 0
        return self.write(address, data)

    def clear(self) -> int:
        """Bring the position back into one revolution; returns the error's number: it must stand still."""
        if self._wheel.speed_rad_s:
            return Error.RESULT_FAIL
        self._wrap_position()
        return Error.NONE

    def reset(self, keeps: frozenset[str]) -> None:
        """Reset all items to the factory's values but the ones to keep; then it restarts."""
        self.table.restore(lambda item: item.is_eeprom and item.name not in keeps)
        self.reboot()

    def reboot(self) -> None:
        """Restart: silent for a while, torque off, errors forgotten, the position within one revolution."""
        self._release()
        self._restart()

    def _restart(self) -> None:
        self._silent_until_s = self.time.now_s() + REBOOT_S
        self._boot()

    def _boot(self) -> None:
        self.table.restore(lambda item: not item.is_eeprom)
        self.table["goal pwm"] = self.table["pwm limit"]
        if "current limit" in (item.name for item in self.table.model.items):
            self.table["goal current"] = self.table["current limit"]
        self._registered = None
        self._blocked_s = None
        self._wrap_position()
        self.table["goal position"] = self._position()
        if self.table["startup configuration"] & 1:
            self.table["torque enable"] = 1
        self._protect()
        self._drive()

    def _set(self, item: Item, value: int) -> int:
        before = self.table[item.name]
        if item.name == "torque enable" and value:
            if self.table["hardware error status"] & self.table["shutdown"]:
                return Error.RESULT_FAIL
            if not before:
                # The watchdog acts with torque on only: time without torque does not count.
                self._heard_s = self.time.now_s()
                if self.table["operating mode"] == 3:
                    self._wrap_position()
        self.table[item.name] = value
        if item.name == "operating mode" and value != before:
            self.table.restore(lambda other: other.name in _RESET_BY_MODE)
            self.table["goal pwm"] = self.table["pwm limit"]
            if value == 3:
                self._wrap_position()
        if item.name == "bus watchdog":
            self._heard_s = self.time.now_s()
        if item.is_goal and self.table["drive mode"] & _TORQUE_BY_GOAL and not self.table["hardware error status"]:
            self.table["torque enable"] = 1
        return Error.NONE

    def _sign(self) -> int:
        """Return the sign of the forward direction, relative to the servo's positive direction."""
        return -self._direction if self.table["drive mode"] & _REVERSE else self._direction

    def _drive(self) -> None:
        """Let the wheel have what the registers say."""
        self._world.catch_up()
        wheel, table = self._wheel, self.table
        wheel.is_driven = self._has_power and bool(table["torque enable"])
        fastest_rad_s = table.model.no_load_rpm * 2 * math.pi / 60 * self.voltage_v / 12.0
        match table["operating mode"]:
            case _ if table["bus watchdog"] == 0xFF:
                wanted_rad_s = 0.0
            case 1:
                wanted_rad_s = table["goal velocity"] * RAW_RAD_S
            case 16:
                wanted_rad_s = table["goal pwm"] / 885 * fastest_rad_s
            case _:
                wanted_rad_s = 0.0
        goal_rad_s = self._sign() * max(-fastest_rad_s, min(fastest_rad_s, wanted_rad_s)) / self._gear
        fastest_rad_s /= self._gear
        profile = table["profile acceleration"]
        if not profile:
            wheel.acceleration_rad_s2 = math.inf
        elif table["drive mode"] & _TIME_BASED:
            wheel.acceleration_rad_s2 = max(abs(goal_rad_s - wheel.speed_rad_s), RAW_RAD_S / self._gear) / (
                profile / 1000
            )
        else:
            wheel.acceleration_rad_s2 = profile * _ACCELERATION_RAD_S2 / self._gear
        wheel.fastest_rad_s, wheel.goal_rad_s = fastest_rad_s, goal_rad_s

    def _release(self) -> None:
        self.table["torque enable"] = 0
        self._drive()

    def _protect(self) -> None:
        table = self.table
        if self.temperature_c > table["temperature limit"]:
            self._fail(HardwareError.OVERHEATING)
        if self._has_power and not table["min voltage limit"] <= self.voltage_v * 10 <= table["max voltage limit"]:
            self._fail(HardwareError.VOLTAGE)

    def _fail(self, bit: HardwareError) -> None:
        self.table["hardware error status"] |= bit
        if bit & self.table["shutdown"]:
            self._release()

    def _position(self) -> int:
        turned = math.floor(self._wheel.angle_rad * self._gear / (2 * math.pi) * TICKS)
        # Unbounded: the register wraps.
        return self._base_ticks + self._sign() * turned

    def _wrap_position(self) -> None:
        offset = self.table["homing offset"]
        within = (self._position() - offset) % TICKS
        self._base_ticks += within + offset - self._position()

    def _measure(self) -> None:
        self._world.catch_up()
        table, wheel = self.table, self._wheel
        velocity = round(self._sign() * wheel.speed_rad_s * self._gear / RAW_RAD_S)
        goal = round(self._sign() * wheel.goal_rad_s * self._gear / RAW_RAD_S) if wheel.is_driven else 0
        position = self._position()
        if wheel.is_driven and wheel.is_blocked and goal:
            load = int(math.copysign(table.model.strongest_load, goal))
        else:
            load = round(velocity * 0.2) if wheel.is_driven else 0
        is_moving = abs(velocity) > table["moving threshold"]
        table["realtime tick"] = int(self.time.now_s() * 1000) % 32768
        table["moving"] = int(is_moving)
        table["moving status"] = 0 if velocity == goal else 2
        table["present pwm"] = round(885 * goal / 1023) if wheel.is_driven else 0
        table["present load"] = load
        table["present velocity"] = velocity
        table["present position"] = position
        table["velocity trajectory"] = velocity if wheel.is_driven else 0
        table["position trajectory"] = position
        table["present input voltage"] = round(self.voltage_v * 10)
        table["present temperature"] = round(self.temperature_c)
