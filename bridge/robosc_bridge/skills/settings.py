"""Settings of the skills: numbers with units, ranges and what they mean, which the configuration and its page share."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

Words = tuple[Annotated[str, Meta(min_length=1, max_length=40)], ...]
# Terminals give no blank (it is called `space`), no carriage return (it becomes a line feed), and none of the
# characters that they keep to themselves: Ctrl-C, Ctrl-Q, Ctrl-S, Ctrl-Z and Ctrl-\.
TypedKey = Annotated[
    str,
    Meta(pattern=r"^(space|[^ \r\u0003\u0011\u0013\u001a\u001c])(?![\s\S])", title="space or a single character"),
]


class RotateSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of the robot's rotation by an angle."""

    speed_rad_s: Annotated[float, Meta(ge=0.05, le=10, description="Highest yaw rate, in rad/s.")] = 0.8
    slowest_rad_s: Annotated[
        float, Meta(ge=0.01, le=1, description="Lowest yaw rate, in rad/s: below it, the wheels may stand still.")
    ] = 0.08
    braking_rad_s2: Annotated[float, Meta(ge=0.05, le=50, description="Deceleration towards the end, in rad/s².")] = 1.5
    gain_per_s: Annotated[
        float,
        Meta(
            ge=0.1,
            le=10,
            description="Yaw rate per remaining angle, in rad/s per rad; choose less for slower serial lines.",
        ),
    ] = 2.0
    tolerance_rad: Annotated[
        float, Meta(ge=0.002, le=0.8, description="Largest error of a finished rotation, in rad.")
    ] = 0.02
    settle_s: Annotated[
        float, Meta(ge=0, le=5, description="Time within the tolerance after which the rotation is done, in seconds.")
    ] = 0.3
    patience_s: Annotated[
        float,
        Meta(ge=1, le=60, description="Seconds beyond twice the time at full speed after which a rotation fails."),
    ] = 5.0


class LineSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings for detecting a line on the floor."""

    camera: Annotated[
        str,
        Meta(
            min_length=1,
            max_length=4096,
            description="Device such as /dev/video0, a video file, or `simulated:PATH`, served by a simulator.",
        ),
    ] = "/dev/video0"
    shade: Annotated[Literal["dark", "light"], Meta(description="Shade of the line, compared with the floor.")] = "dark"
    threshold: Annotated[
        float, Meta(ge=0, le=255, description="Shade that separates line and floor: 0 is black, 255 is white.")
    ] = 100.0
    top: Annotated[
        float, Meta(ge=0, le=1, description="First of the picture's rows that are examined, as a share of the height.")
    ] = 0.6
    bottom: Annotated[float, Meta(ge=0, le=1, description="Last of these rows, as a share of the height.")] = 1.0
    smallest: Annotated[
        float, Meta(ge=0, le=1, description="Smallest share of the pixels in these rows that counts as a line.")
    ] = 0.005
    largest: Annotated[
        float, Meta(ge=0, le=1, description="Largest such share, so that a dark picture shows no line.")
    ] = 0.6
    gain_rad_s: Annotated[
        float, Meta(ge=0, le=100, description="Correction for a line that is off by a whole picture width, in rad/s.")
    ] = 2.0
    limit_rad_s: Annotated[float, Meta(ge=0, le=10, description="Largest correction, in rad/s.")] = 1.0
    timeout_s: Annotated[
        float, Meta(ge=0.05, le=60, description="Seconds without a picture after which the line counts as lost.")
    ] = 0.5


class EmergencyStopSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Keys and buttons with which the operator stops the robot, and lets it go on."""

    stop_keys: Annotated[
        tuple[TypedKey, ...], Meta(description="Keys that stop the robot: single characters, or `space`.")
    ] = ("space",)
    resume_keys: Annotated[tuple[TypedKey, ...], Meta(description="Keys that let the robot go on.")] = ("r",)
    stop_buttons: Annotated[Words, Meta(description="Buttons of the drive that stop the robot.")] = ()
    resume_buttons: Annotated[Words, Meta(description="Buttons of the drive that let the robot go on.")] = ()
