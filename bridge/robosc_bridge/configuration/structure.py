"""Frozen structures of a configuration, from which its checks, JSON schema and documentation are generated."""

from typing import Annotated, Any, Literal, get_args

import msgspec
from msgspec import Meta, Struct

from robosc_bridge.configuration.channels import Channel
from robosc_bridge.safety.limits import BOUNDS, SCAN_TIMEOUT_S, SCAN_TIMEOUTS_S, SafetyLimits
from robosc_bridge.skills.settings import EmergencyStopSettings, LineSettings, RotateSettings

_Text = Annotated[str, Meta(min_length=1, max_length=4096)]
_Name = Annotated[str, Meta(min_length=1, max_length=255)]
# The end of a text: Python's `$` takes a line feed after it, and JSON Schema's expressions know no `\Z`.
_OptionName = Annotated[str, Meta(pattern=r"^[a-z][a-z0-9_]{0,39}(?![\s\S])", title="baud or watchdog_s")]
_Address = Annotated[
    str, Meta(pattern=r"^(\[[0-9a-fA-F:.]{2,45}\]|[A-Za-z0-9._-]{1,253}):[0-9]{1,5}(?![\s\S])", title="HOST:PORT")
]
_ServerAddress = Annotated[
    str,
    Meta(
        pattern=r"^(\[[0-9a-fA-F:.]{2,45}\]|(?![0-9]+(?![\s\S]))[A-Za-z0-9._-]{1,253})(:[0-9]{1,5})?(?![\s\S])",
        title="HOST or HOST:PORT",
    ),
]
_Option = bool | int | float | str


class _Section(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Common part of all sections."""


TurtleBot = Literal["burger", "waffle", "waffle_pi"]
TURTLEBOTS: tuple[str, ...] = get_args(TurtleBot)
"""The robots whose dimensions and limits the bridge knows."""


class Body(_Section, frozen=True):
    """A robot of one's own, for a drive that needs no further data of it."""

    wheel_separation_m: Annotated[
        float, Meta(gt=0, le=5, description="Distance between its left and its right wheels, in metres.")
    ]
    linear_m_s: Annotated[float, Meta(gt=0, le=5, description="Highest speed forward and backward, in m/s.")]
    angular_rad_s: Annotated[float, Meta(gt=0, le=20, description="Highest yaw rate, in rad/s.")]


class Drive(_Section, frozen=True):
    """The drive base."""

    driver: Annotated[_Name, Meta(description="`opencr`, `dynamixel`, `mavlink-rover`, or one of a plug-in.")]
    port: Annotated[_Text, Meta(description="Serial port, preferably a stable name below /dev/serial/by-id.")]
    options: Annotated[
        dict[_OptionName, _Option | tuple[_Option, ...]],
        Meta(description="Options of the driver: see docs/bridge-drivers.md."),
    ] = {}


class Scanner(_Section, frozen=True):
    """The LiDAR."""

    driver: Annotated[_Name, Meta(description="`lds01`, `lds02`, `lds03`, or one of a plug-in.")]
    port: Annotated[_Text, Meta(description="Serial port, preferably a stable name below /dev/serial/by-id.")]
    options: Annotated[
        dict[_OptionName, _Option | tuple[_Option, ...]],
        Meta(description="Options of the driver: see docs/bridge-drivers.md."),
    ] = {}
    x_m: Annotated[
        Annotated[float, Meta(ge=-5, le=5)] | None,
        Meta(
            description="Place of the LiDAR, in metres forward of the middle between the wheels; null: as the "
            "TurtleBot3 has it."
        ),
    ] = None
    y_m: Annotated[
        Annotated[float, Meta(ge=-5, le=5)] | None,
        Meta(description="The same to the left; both keys or none."),
    ] = None


class Execution(_Section, frozen=True):
    """Execution of the supervisor."""

    # The safety layer waits for the loop for two periods at least.
    period_s: Annotated[float, Meta(ge=0.001, le=0.5, description="Time between decisions, in seconds.")] = 0.02
    every: Annotated[
        Literal["period", "event"] | None,
        Meta(
            description="When the supervisor decides: each period, or after each message as well; null: `event`, or "
            "never in a supervision layer."
        ),
    ] = None
    policy: Annotated[
        Literal["fair", "priority", "random", "strategy"] | None,
        Meta(
            description="Choice of the request to issue if several are allowed; null: `strategy` where the model has "
            "goals, else `fair`."
        ),
    ] = None
    priority: Annotated[
        tuple[_Name, ...], Meta(description="Communications, most urgent first, for the policy `priority`.")
    ] = ()
    seed: Annotated[int, Meta(ge=0, le=2**31 - 1, description="Seed of the policy `random`.")] = 0
    release_identifiers: Annotated[
        tuple[_Text, ...] | None,
        Meta(description="Identifiers whose last message stays in effect; null: all that are mapped to the drive."),
    ] = None
    max_age_s: Annotated[
        dict[_Text, Annotated[float, Meta(gt=0, le=86400)]],
        Meta(description="By identifier, the seconds after which data that the model received is stale."),
    ] = {}
    service_timeout_s: Annotated[
        Annotated[float, Meta(gt=0, le=86400)] | None,
        Meta(description="Seconds after which a call without an answer fails; null: never."),
    ] = 10.0
    action_timeout_s: Annotated[
        Annotated[float, Meta(gt=0, le=86400)] | None,
        Meta(
            description="Seconds after which a goal without a result fails, unless it is being cancelled; null: never."
        ),
    ] = None
    cancel_timeout_s: Annotated[
        float,
        Meta(
            ge=0,
            le=86400,
            description="Seconds after a cancel was asked for until it is reported that its goal has not ended; 0: "
            "never.",
        ),
    ] = 5.0
    on_unknown: Annotated[
        Literal["default", "keep", "fault"],
        Meta(
            description="Reaction to data that is no value of an enum: use its default, keep the last value, or fault."
        ),
    ] = "default"
    command_timeout_s: Annotated[
        float,
        Meta(ge=0, le=86400, description="In a layer, seconds of silence after which the last request ends; 0: never."),
    ] = 1.0
    assumption_timeout_s: Annotated[
        float,
        Meta(
            ge=0,
            le=86400,
            description="With goals, seconds after which an assumption that is owed is reported; 0: never.",
        ),
    ] = 30.0


def _scan_timeouts() -> str:
    """Return the times of the LiDARs in words."""
    known = ", ".join(f"{time_s:g} for `{driver}`" for driver, time_s in SCAN_TIMEOUTS_S.items())
    return f"{known}, three revolutions for others, {SCAN_TIMEOUT_S:g} if their rate is unknown"


def _within(name: str, description: str = "") -> Meta:
    """Return the bounds of a number of the safety layer, and what its key means."""
    bounds = BOUNDS[name]
    least = {"gt": 0} if bounds.least is None else {"ge": bounds.least}
    return Meta(**least, le=bounds.most, description=description or None)


class Safety(_Section, frozen=True):
    """Limits and times of the safety layer; all requests of the supervisor stay within them."""

    linear_m_s: Annotated[
        Annotated[float, _within("linear_m_s")] | None,
        Meta(description="Highest speed forward and backward, in m/s; null: that of the drive."),
    ] = None
    angular_rad_s: Annotated[
        Annotated[float, _within("angular_rad_s")] | None,
        Meta(description="Highest yaw rate, in rad/s; null: that of the drive."),
    ] = None
    linear_acceleration_m_s2: Annotated[
        float, _within("linear_acceleration_m_s2", "Largest acceleration, in m/s²; safety stops ignore it.")
    ] = SafetyLimits.linear_acceleration_m_s2
    angular_acceleration_rad_s2: Annotated[
        float,
        _within("angular_acceleration_rad_s2", "Largest angular acceleration, in rad/s²; safety stops ignore it."),
    ] = SafetyLimits.angular_acceleration_rad_s2
    command_timeout_s: Annotated[
        float,
        _within(
            "command_timeout_s",
            "Seconds without a command after which the wheels stop; at least twice `execution.period_s`.",
        ),
    ] = SafetyLimits.command_timeout_s
    scan_timeout_s: Annotated[
        Annotated[float, _within("scan_timeout_s")] | None,
        Meta(
            description="Seconds without a full revolution of the LiDAR after which the wheels stop; null: "
            f"{_scan_timeouts()}."
        ),
    ] = None
    min_valid_share: Annotated[
        float,
        _within(
            "min_valid_share",
            "Share of valid ranges within 30° of the direction of motion, below which the LiDAR is blind.",
        ),
    ] = SafetyLimits.min_valid_share
    stops_when_blind: Annotated[
        bool,
        Meta(description="True: the robot does not move where the LiDAR measures nothing; false: it does, and warns."),
    ] = SafetyLimits.is_stopped_when_blind
    bad_frames_share: Annotated[
        float,
        Meta(gt=0, le=1, description="Share of damaged frames of the LiDAR above which the bridge warns."),
    ] = 0.1
    motor_timeout_s: Annotated[
        float, _within("motor_timeout_s", "Seconds without an answer after which the drive counts as failed.")
    ] = SafetyLimits.motor_timeout_s
    overrun_s: Annotated[
        float,
        _within(
            "loop_timeout_s",
            "Seconds without a cycle of the supervisor's loop after which the wheels stop; at least twice "
            "`execution.period_s`.",
        ),
    ] = SafetyLimits.loop_timeout_s
    battery_warning_v: Annotated[
        Annotated[float, _within("battery_warn_v")] | None,
        Meta(description="Voltage at and below which the bridge warns; null: the drive decides."),
    ] = None
    battery_stop_v: Annotated[
        Annotated[float, _within("battery_stop_v")] | None,
        Meta(
            description="Voltage at and below which the robot stops; null: 11.1 for `opencr`, the lowest supply of the "
            "servos for `dynamixel`, none for others; a rover itself reports that its battery is empty."
        ),
    ] = None
    operator_link_timeout_s: Annotated[
        Annotated[float, _within("operator_timeout_s")] | None,
        Meta(
            description="Seconds without a sign of life of an operator after which the robot stops; null: none needed."
        ),
    ] = SafetyLimits.operator_timeout_s
    torque_off_on_operator_stop: Annotated[
        bool | None,
        Meta(
            description="True: after an operator's stop the motors also let go, once the wheels stand still; null: "
            "only if the drive has controls of its own (`opencr`)."
        ),
    ] = None


class Skills(_Section, frozen=True):
    """Settings of the skills."""

    rotate: Annotated[RotateSettings, Meta(description="Rotation by an angle.")] = RotateSettings()
    line: Annotated[LineSettings, Meta(description="Detection of a line on the floor.")] = LineSettings()
    emergency_stop: Annotated[EmergencyStopSettings, Meta(description="The operator's stop.")] = EmergencyStopSettings()


class Remote(_Section, frozen=True):
    """Access to the bridge, for commanding and watching it."""

    grpc_address: Annotated[
        _Address | None,
        Meta(description="HOST:PORT to listen on, such as 127.0.0.1:50061; null: no endpoint."),
    ] = None
    tls_certificate: Annotated[
        _Text | None, Meta(description="File with the bridge's certificate chain (PEM); null: no TLS, loopback only.")
    ] = None
    tls_key: Annotated[_Text | None, Meta(description="File with the private key of the certificate (PEM).")] = None
    client_ca: Annotated[
        _Text | None,
        Meta(
            description="File with the authorities (PEM) of callers' certificates; null: callers need no certificate."
        ),
    ] = None
    tokens: Annotated[
        _Text | None, Meta(description="File of tokens, made by `robosc-bridge token`; null: callers need no token.")
    ] = None
    insecure_beyond_loopback: Annotated[
        bool, Meta(description="Listen without TLS on an address that other machines can reach, on a trusted network.")
    ] = False
    mavlink_url: Annotated[
        _Text | None,
        Meta(description="Address of the ground station, such as udpout:192.168.1.2:14550; null: no ground station."),
    ] = None
    mavlink_system: Annotated[int, Meta(ge=1, le=255, description="System id of the vehicle.")] = 1
    mavlink_key: Annotated[
        _Text | None,
        Meta(description="File with the signing key: only signed commands are obeyed then; null: no signatures."),
    ] = None
    mavlink_link_id: Annotated[int, Meta(ge=0, le=255, description="Link id of the signed stream.")] = 0
    mavlink_unsigned_commands: Annotated[
        bool, Meta(description="True: unsigned commands from other computers can do more than stop.")
    ] = False
    mavlink_interval_s: Annotated[
        float, Meta(ge=0.05, le=10, description="Seconds between two messages of the pose, and of the obstacles.")
    ] = 0.1
    metrics_address: Annotated[
        _Text | None,
        Meta(description="HOST:PORT at which Prometheus reads metrics, over HTTP at /metrics; null: no metrics."),
    ] = None


class View(_Section, frozen=True):
    """The live view: a web page that shows what the robot does."""

    address: Annotated[
        _Address | None,
        Meta(description="HOST:PORT to serve the page on, such as 127.0.0.1:8066; null: no page."),
    ] = None
    names: Annotated[
        tuple[_Name, ...],
        Meta(
            max_length=20,
            description="Further names by which browsers reach the page, besides its address and localhost.",
        ),
    ] = ()
    tls_certificate: Annotated[
        _Text | None, Meta(description="File with the page's certificate chain (PEM); null: no TLS, loopback only.")
    ] = None
    tls_key: Annotated[_Text | None, Meta(description="File with the private key of the certificate (PEM).")] = None
    insecure_beyond_loopback: Annotated[
        bool,
        Meta(
            description="Serve the page without TLS on an address that other machines can reach, on a trusted network."
        ),
    ] = False
    scene: Annotated[
        _Text | None,
        Meta(description="Name or file of a scene (docs/twin.md) whose walls and line the map shows; null: no scene."),
    ] = None
    scene_seed: Annotated[int, Meta(ge=0, le=2**31, description="Seed of the random parts of the scene.")] = 0


class SupervisorSource(_Section, frozen=True):
    """Source of the supervisor, besides the file on the command line."""

    server: Annotated[
        _ServerAddress | None,
        Meta(description="HOST or HOST:PORT of the synthesis server (default port: 50051); null: no server."),
    ] = None
    ca: Annotated[
        _Text | None,
        Meta(description="File with the trusted authorities (PEM) of the server's certificate; null: no TLS."),
    ] = None
    certificate: Annotated[_Text | None, Meta(description="File with the bridge's own certificate chain (PEM).")] = None
    key: Annotated[_Text | None, Meta(description="File with the private key of the certificate (PEM).")] = None
    token_file: Annotated[_Text | None, Meta(description="File with the bridge's token for the server.")] = None
    keep: Annotated[
        _Text | None,
        Meta(
            description="Folder for the server's last supervisor, for a start without network; null: `robosc-bridge` "
            "in the user's state folder."
        ),
    ] = None
    trusted_keys: Annotated[
        tuple[_Text, ...],
        Meta(description="Public keys (`ssh-ed25519 AAAA...`) whose signatures are trusted, or files with such keys."),
    ] = ()


class Log(_Section, frozen=True):
    """Recording of logs."""

    folder: Annotated[_Text | None, Meta(description="Folder for logs; null: the log only goes to the terminal.")] = (
        None
    )


class Configuration(_Section, frozen=True):
    """A robot and what the communications of a model are mapped to."""

    robot: Annotated[TurtleBot | Body, Meta(description="The TurtleBot3, or the body of another robot.")]
    drive: Annotated[Drive, Meta(description="The drive base.")]
    scanner: Annotated[Scanner | None, Meta(description="The LiDAR; null: there is none.")] = None
    execution: Annotated[Execution, Meta(description="Execution of the supervisor.")] = Execution()
    safety: Annotated[Safety, Meta(description="Limits of the safety layer.")] = Safety()
    skills: Annotated[Skills, Meta(description="Settings of the skills.")] = Skills()
    remote: Annotated[Remote, Meta(description="Access to the bridge from other programs and computers.")] = Remote()
    view: Annotated[View, Meta(description="The live view, a web page.")] = View()
    supervisor: Annotated[SupervisorSource, Meta(description="Source of the supervisor.")] = SupervisorSource()
    log: Annotated[Log, Meta(description="Log of the run.")] = Log()
    channels: Annotated[
        dict[_Text, Channel],
        Meta(description="Channel of each communication of the model, by its identifier or name."),
    ] = {}


def schema() -> dict[str, Any]:
    """The JSON schema of a configuration, for editors and other programs; schema.json beside this file holds it."""
    made: dict[str, Any] = msgspec.to_builtins(msgspec.json.schema(Configuration))
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "RoboSC bridge", **made}
