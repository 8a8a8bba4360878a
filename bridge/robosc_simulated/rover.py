"""A simulated ArduPilot Rover: modes, arming, velocity targets that expire, and telemetry.

It steers like a tank, with two wheels in the world. Its north is the world's x. What it owes its host (heartbeats,
time-outs) goes by the clock, as with all simulated devices. Sources: ArduPilot Rover (`GCS_MAVLink_Rover.cpp`,
`mode_guided.cpp`) and mavlink.io.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any

from robosc_simulated.line import Sending
from robosc_simulated.mavlink_packets import BY_NAME, Encoder, Packet, Parser
from robosc_simulated.world import World

MANUAL, HOLD, AUTO, GUIDED = 0, 4, 10, 15
MODES = (0, 1, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 15)
ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED = range(5)
TARGET_LIMIT_S = 3.0

_FORCE = 21196
_ROVER, _ARDUPILOT = 10, 3
_ARMED, _CUSTOM = 128, 1
_ACTIVE, _STANDBY = 4, 3
_FRAMES = (1, 7, 8, 9)
_VELOCITY_AND_TURN_RATE = 0x05E7
_CHUNK = 50
_UNKNOWN_CM = 65535
_SECTORS = 72
_RAYS = 9  # The rays of each sector.
_LEAST_CM, _MOST_CM = 5, 800
_LOCAL_FRD, _BODY_FRD = 20, 12
_HEARTBEAT, _SYS_STATUS = 0, 1
_SYS_STATUS_S = 1.0


class Rover:
    """The vehicle's end of a line: a `Device`.

    Args:
        world: World that it drives in.
        system: Its number.
        key: Key of signing; None: it neither signs nor asks for signatures.
        cruise_m_s: Speed at which it caps commanded speeds.
        heartbeat_s: Period of its heartbeats, in seconds.

    Attributes:
        kind: Kind of vehicle, as its heartbeat reports.
        autopilot: Autopilot, as its heartbeat reports.
        mode: Mode in which it is.
        is_armed: True if its motors have power.
        has_origin: True if its estimator knows where it is; without, it reports no place and follows no target.
        reports_motion: True if it knows the message ODOMETRY; else it reports only its position and attitude.
        obstacles: `ring`, `north ring`, `sensors`, or nothing.
        battery_v: Voltage of its battery.
        charge_state: Judgement of its own failsafe on the battery: 1 ok, 2 low, 3 critical.
        more_batteries: Voltages of further batteries, and the judgements on them.
        refusal: Reason why it does not arm; empty: it does.
        lost_pieces: Pieces of long texts that get lost on their way, by number.
        text_between: Text that comes behind the first piece of a long one; empty: none.
        refused_modes: Modes that it does not enter.
        refuses_disarming: True if it refuses to disarm until it is forced.
        answers_commands: True if it acknowledges commands.
        obeys_commands: True if it does what it acknowledges.
        arms_after_s: Time after which it carries out an order to arm; it answers at once.
        is_silent: True if it reports nothing at all.
        reported_cm: Distances that its sensors report whatever is there, by the number of their sector.
        signal_quality: Quality of the signal of its single sensors: 0 unknown, 1 invalid, up to 100.
        resets: Number of times that its estimator has begun anew.
        shift_m: Shift by which its estimate is off since: north, west.
        shift_rad: Angle by which it is off since, counter-clockwise.
        commands: Commands that it has heard: number and parameters.
        targets: Targets that it has followed or ignored: their fields.
        heartbeats: Heartbeats of others that it has heard: system and component.
    """

    baud: int | None = None

    def __init__(
        self,
        world: World,
        system: int = 1,
        key: bytes | None = None,
        cruise_m_s: float = 2.0,
        heartbeat_s: float = 1.0,
    ) -> None:
        self.kind, self.autopilot = _ROVER, _ARDUPILOT
        self.mode = MANUAL
        self.is_armed = False
        self.has_origin = True
        self.reports_motion = True
        self.obstacles = "ring"
        self.battery_v = 12.0
        self.charge_state = 1
        self.more_batteries: list[tuple[float, int]] = []
        self.refusal = ""
        self.lost_pieces: frozenset[int] = frozenset()
        self.text_between = ""
        self.refused_modes: tuple[int, ...] = ()
        self.refuses_disarming = False
        self.answers_commands = True
        self.obeys_commands = True
        self.arms_after_s = 0.0
        self.is_silent = False
        self.reported_cm: dict[int, int] = {}
        self.signal_quality = 0
        self.resets = 0
        self.shift_m = (0.0, 0.0)
        self.shift_rad = 0.0
        self.commands: list[tuple[int, tuple[float, ...]]] = []
        self.targets: list[dict[str, Any]] = []
        self.heartbeats: list[tuple[int, int]] = []
        self._world = world
        self._time = world.time
        self._system = system
        self._cruise_m_s = cruise_m_s
        self._encoder = Encoder(system, 1, key)
        self.parser = Parser(key)
        self._remote = (0.0, 0.0)
        self._target: tuple[float, float] | None = None
        self._target_s = 0.0
        self._arms_at_s = math.inf
        self._long_texts = 0
        self._began_s = self._time.now_s()
        self._first_s = {_HEARTBEAT: heartbeat_s, _SYS_STATUS: _SYS_STATUS_S}
        self._interval_s = dict(self._first_s)
        self._due_s = dict.fromkeys(self._first_s, self._began_s)
        for wheel in (world.left, world.right):
            wheel.acceleration_rad_s2 = 40.0
            # It has motors of its own, and cruises at half of their throttle (ArduPilot's CRUISE_THROTTLE).
            wheel.fastest_rad_s = 2 * cruise_m_s / world.body.wheel_radius_m

    # Acts of people and of the world.

    def take_over(self, mode: int = MANUAL, linear_m_s: float = 0.0, angular_rad_s: float = 0.0) -> None:
        """An operator with a remote control changes the mode, and drives if it is MANUAL."""
        with self._time.lock:
            self.update()
            self._remote = (linear_m_s, angular_rad_s)
            self._enter(mode)
            self._drive()

    def disarm(self) -> None:
        """An operator, or a failsafe, takes the power from the motors."""
        with self._time.lock:
            self.update()
            self.is_armed = False
            self._drive()

    def restart(self) -> None:
        """The autopilot starts anew."""
        with self._time.lock:
            self.update()
            self._began_s = self._time.now_s()
            self.is_armed = False
            self._enter(HOLD)
            self._interval_s = dict(self._first_s)
            self._due_s = dict.fromkeys(self._first_s, self._began_s)
            self._drive()

    # Methods of a device on a line.

    def receive(self, data: bytes, baud: int) -> Iterable[Sending]:
        """Hear its host and answer."""
        found = list(self.update())
        answers: list[bytes] = []
        for packet in self.parser.feed(data):
            match packet.name:
                case "HEARTBEAT":
                    self.heartbeats.append((packet.system, packet.component))
                case "COMMAND_LONG" if self._is_meant(packet):
                    answers += self._after_command(packet)
                case "SET_POSITION_TARGET_LOCAL_NED" if self._is_meant(packet):
                    self._after_target(packet.values)
        self._drive()
        return [] if self.is_silent else found + [Sending(answer) for answer in answers]

    def update(self) -> Iterable[Sending]:
        """Drive until now, and return the packets that are due."""
        self._world.catch_up()
        now_s = self._time.now_s()
        packets: list[bytes] = []
        if now_s >= self._arms_at_s:
            self._arm(True)
            self._drive()
        if self._target is not None and now_s - self._target_s >= TARGET_LIMIT_S:
            self._target = None
            self._drive()
            packets += self._texts(4, "target not received last 3secs, stopping")
        for number, due_s in self._due_s.items():
            if now_s >= due_s:
                interval_s = self._interval_s[number]
                self._due_s[number] = due_s + interval_s * (math.floor((now_s - due_s) / interval_s) + 1)
                packets += self._telemetry(number)
        return [] if self.is_silent else [Sending(packet) for packet in packets]

    def due_s(self) -> float:
        """Return the time when its next message or the expiry of its target is due."""
        expiry_s = math.inf if self._target is None else self._target_s + TARGET_LIMIT_S
        return min(expiry_s, self._arms_at_s, *self._due_s.values())

    def plug_in(self) -> None:
        """A line that was plugged in again changes nothing."""

    def _is_meant(self, packet: Packet) -> bool:
        values = packet.values
        return values["target_system"] in (0, self._system) and values["target_component"] in (0, 1)

    def _enter(self, mode: int) -> None:
        if mode != self.mode:
            self.mode = mode
            self._target = None

    def _drive(self) -> None:
        """Set the velocity of the wheels."""
        linear_m_s = angular_rad_s = 0.0
        if self.is_armed and self.mode == MANUAL:
            linear_m_s, angular_rad_s = self._remote
        elif self.is_armed and self.mode == GUIDED and self._target is not None:
            linear_m_s, angular_rad_s = self._target
        body = self._world.body
        rotation_m_s = angular_rad_s * body.wheel_separation_m / 2
        for wheel, speed_m_s in (
            (self._world.left, linear_m_s - rotation_m_s),
            (self._world.right, linear_m_s + rotation_m_s),
        ):
            wheel.is_driven = self.is_armed
            wheel.goal_rad_s = speed_m_s / body.wheel_radius_m

    def _after_command(self, packet: Packet) -> list[bytes]:
        number, parameters = packet.values["command"], packet.values["parameters"]
        self.commands.append((number, parameters))
        packets: list[bytes] = []
        match number:
            case 176:  # DO_SET_MODE
                result = self._after_mode(round(parameters[0]), round(parameters[1]))
            case 400:  # COMPONENT_ARM_DISARM
                result = self._after_arming(parameters[0] == 1.0, round(parameters[1]) == _FORCE)
                if result == FAILED:
                    packets += self._texts(2, f"PreArm: {self.refusal}")
            case 511:  # SET_MESSAGE_INTERVAL
                result = self._after_interval(round(parameters[0]), parameters[1] / 1e6)
            case _:
                result = UNSUPPORTED
        if self.answers_commands:
            packets.append(
                self._encoder.encode(
                    "COMMAND_ACK",
                    command=number,
                    result=result,
                    target_system=packet.system,
                    target_component=packet.component,
                )
            )
        return packets

    def _after_mode(self, base: int, mode: int) -> int:
        if not base & _CUSTOM or mode not in MODES:
            return DENIED
        if mode in self.refused_modes:
            return FAILED
        if self.obeys_commands:
            self._enter(mode)
        return ACCEPTED

    def _after_arming(self, is_armed: bool, is_forced: bool) -> int:
        if is_armed and self.refusal:
            return FAILED
        if not is_armed and self.refuses_disarming and not is_forced:
            return DENIED
        if self.obeys_commands and is_armed and self.arms_after_s > 0.0:
            self._arms_at_s = self._time.now_s() + self.arms_after_s
        elif self.obeys_commands:
            self._arm(is_armed)
        return ACCEPTED

    def _arm(self, is_armed: bool) -> None:
        self.is_armed = is_armed
        self._target = None
        self._arms_at_s = math.inf

    def _after_interval(self, number: int, interval_s: float) -> int:
        known = {layout.number for layout in BY_NAME.values()}
        if number not in known or (number == 331 and not self.reports_motion) or interval_s <= 0:
            return UNSUPPORTED
        self._interval_s[number] = interval_s
        self._due_s[number] = self._time.now_s()
        return ACCEPTED

    def _after_target(self, values: dict[str, Any]) -> None:
        self.targets.append(values)
        is_understood = values["type_mask"] == _VELOCITY_AND_TURN_RATE and values["frame"] in _FRAMES
        if not (is_understood and self.has_origin and self.mode == GUIDED and self.is_armed):
            return
        speed_m_s = math.copysign(min(math.hypot(values["vx"], values["vy"]), self._cruise_m_s), values["vx"])
        self._target = (speed_m_s, -values["yaw_rate"])
        self._target_s = self._time.now_s()

    # Its telemetry.

    def _telemetry(self, number: int) -> list[bytes]:
        boot_s = self._time.now_s() - self._began_s
        match number:
            case 0:  # The order is that of numbers, as in `mavlink_packets.LAYOUTS`.
                return [self._heartbeat()]
            case 1:
                return [
                    self._encoder.encode(
                        "SYS_STATUS", voltage=round(self.battery_v * 1000), current=-1, remaining=self._percent
                    )
                ]
            case 30:
                return [self._encoder.encode("ATTITUDE", time_ms=int(boot_s * 1000) % 2**32, **self._yaw())]
            case 32 if self.has_origin:
                return [self._encoder.encode("LOCAL_POSITION_NED", time_ms=int(boot_s * 1000) % 2**32, **self._place())]
            case 132 if self.obstacles == "sensors":
                return self._sensors(boot_s)
            case 147:
                return self._batteries()
            case 330 if self.obstacles.endswith("ring"):
                return [self._ring(boot_s)]
            case 331 if self.has_origin:
                return [self._odometry(boot_s)]
        return []

    def _heartbeat(self) -> bytes:
        return self._encoder.encode(
            "HEARTBEAT",
            type=self.kind,
            autopilot=self.autopilot,
            base_mode=_CUSTOM | (_ARMED if self.is_armed else 0),
            custom_mode=self.mode,
            system_status=_ACTIVE if self.is_armed else _STANDBY,
            version=3,
        )

    @property
    def _percent(self) -> int:
        return max(0, min(100, round((self.battery_v - 10.0) / 2.6 * 100)))

    def _batteries(self) -> list[bytes]:
        packets = []
        for number, (voltage_v, charge_state) in enumerate([(self.battery_v, self.charge_state), *self.more_batteries]):
            voltages = (round(voltage_v * 1000), *(_UNKNOWN_CM,) * 9)
            words = {"function": 1, "type": 1, "charge_state": charge_state, "id": number}
            share = self._percent if number == 0 else -1
            packets.append(self._encoder.encode("BATTERY_STATUS", voltages=voltages, remaining=share, **words))
        return packets

    def _yaw(self) -> dict[str, float]:
        yaw_rad = math.remainder(-self._world.heading_rad - self.shift_rad, 2 * math.pi)
        return {"yaw": yaw_rad, "yawspeed": -self._world.floor_yaw_rate_rad_s}

    def _place(self) -> dict[str, float]:
        world, speed_m_s = self._world, self._world.floor_speed_m_s
        cosine, sine = math.cos(self.shift_rad), math.sin(self.shift_rad)
        heading_rad = world.heading_rad + self.shift_rad
        return {
            "x": world.x_m * cosine - world.y_m * sine + self.shift_m[0],
            "y": -(world.x_m * sine + world.y_m * cosine + self.shift_m[1]),
            "vx": speed_m_s * math.cos(heading_rad),
            "vy": -speed_m_s * math.sin(heading_rad),
        }

    def _odometry(self, boot_s: float) -> bytes:
        half_rad = -(self._world.heading_rad + self.shift_rad) / 2
        place = self._place()
        unknown = (math.nan, *(0.0,) * 20)
        return self._encoder.encode(
            "ODOMETRY",
            time_us=int(boot_s * 1e6),
            x=place["x"],
            y=place["y"],
            q=(math.cos(half_rad), 0.0, 0.0, math.sin(half_rad)),
            vx=self._world.floor_speed_m_s,
            yawspeed=-self._world.floor_yaw_rate_rad_s,
            pose_covariance=unknown,
            velocity_covariance=unknown,
            frame=_LOCAL_FRD,
            child_frame=_BODY_FRD,
            resets=self.resets,
            estimator=1,
        )

    def _distances_cm(self, middles_deg: Sequence[float], width_deg: float) -> list[int]:
        """The nearest in each sector, clockwise from the front; most + 1: nothing."""
        parts_deg = [(part / (_RAYS - 1) - 0.5) * width_deg for part in range(_RAYS)]
        ranges_m = self._world.ranges([math.radians(-(middle + part)) for middle in middles_deg for part in parts_deg])
        nearest_m = [min(ranges_m[first : first + _RAYS]) for first in range(0, len(ranges_m), _RAYS)]
        found = [
            min(round(range_m * 100), _MOST_CM + 1) if math.isfinite(range_m) else _MOST_CM + 1 for range_m in nearest_m
        ]
        return [self.reported_cm.get(sector, distance_cm) for sector, distance_cm in enumerate(found)]

    def _ring(self, boot_s: float) -> bytes:
        increment_deg = 360 // _SECTORS
        is_north = self.obstacles == "north ring"
        first_deg = math.degrees(self._world.heading_rad) if is_north else 0.0
        return self._encoder.encode(
            "OBSTACLE_DISTANCE",
            time_us=int(boot_s * 1e6),
            distances=self._distances_cm([first_deg + k * increment_deg for k in range(_SECTORS)], increment_deg),
            min=_LEAST_CM,
            max=_MOST_CM,
            increment=increment_deg,
            frame=0 if is_north else _BODY_FRD,
        )

    def _sensors(self, boot_s: float) -> list[bytes]:
        return [
            self._encoder.encode(
                "DISTANCE_SENSOR",
                time_ms=int(boot_s * 1000) % 2**32,
                min=_LEAST_CM,
                max=_MOST_CM,
                current=distance_cm,
                id=eighth,
                orientation=eighth,
                covariance=255,
                quality=self.signal_quality,
            )
            for eighth, distance_cm in enumerate(self._distances_cm([eighth * 45.0 for eighth in range(8)], 45.0))
        ]

    def _texts(self, severity: int, text: str) -> list[bytes]:
        data = text.encode()
        if len(data) <= _CHUNK:
            return [self._encoder.encode("STATUSTEXT", severity=severity, text=data)]
        self._long_texts += 1
        # A text that fills its last piece needs an empty one.
        pieces = [data[begin : begin + _CHUNK] for begin in range(0, len(data) + 1, _CHUNK)]
        packets = [
            self._encoder.encode("STATUSTEXT", severity=severity, text=piece, id=self._long_texts, chunk=index)
            for index, piece in enumerate(pieces)
        ]
        packets = [packet for index, packet in enumerate(packets) if index not in self.lost_pieces]
        if self.text_between:
            packets.insert(1, self._encoder.encode("STATUSTEXT", severity=6, text=self.text_between.encode()))
        return packets
