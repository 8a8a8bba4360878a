"""The robots' bodies, in numbers of the simulators' own: the drivers hold theirs."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from msgspec import Meta, Struct

from robosc_bridge.configuration.decoding import decode
from robosc_bridge.configuration.document import parse_document, read_file
from robosc_bridge.configuration.problems import ConfigurationError
from robosc_simulated.control_table import MODELS


@dataclass(frozen=True)
class Body:
    """A differential-drive robot.

    Attributes:
        name: Name as on the command line.
        wheel_radius_m: Radius of both wheels.
        wheel_separation_m: Distance between the wheels' middles.
        radius_m: Radius of the round body that collides.
        scanner_x_m: The laser's place on the body, forward of the wheels' axis.
        servo_model: Key of `control_table.MODELS`.
        fastest_rpm: Speed to which OpenCR's firmware clamps a wheel.
        opencr_information: Value that OpenCR reports at address 2.
        gear_ratio: Revolutions of a servo for one of its wheel.
        are_mirrored: For the left and the right servo, True if its own positive direction turns its wheel backward.
        are_reversed: For each, True if its drive mode is set to reverse.
        ids: Ids of the left and the right servo.
        baud_code: Value of their register Baud Rate.
        velocity_limit: Value of their register Velocity Limit; None: the factory's.
        scanner_y_m: The laser's place to the left of the middle.
    """

    name: str
    wheel_radius_m: float
    wheel_separation_m: float
    radius_m: float
    scanner_x_m: float
    servo_model: str
    fastest_rpm: float
    opencr_information: int
    gear_ratio: float = 1.0
    are_mirrored: tuple[bool, bool] = (False, True)
    are_reversed: tuple[bool, bool] = (False, True)
    ids: tuple[int, int] = (1, 2)
    baud_code: int = 3
    velocity_limit: int | None = None
    scanner_y_m: float = 0.0


BODIES = {
    body.name: body
    for body in (
        Body("burger", 0.033, 0.160, 0.105, -0.032, "XL430-W250", 61.0, 1),
        Body("waffle", 0.033, 0.287, 0.220, -0.064, "XM430-W210", 77.0, 2),
        Body("waffle_pi", 0.033, 0.287, 0.220, -0.064, "XM430-W210", 77.0, 2),
    )
}

BAUDS = (9600, 57600, 115200, 1000000, 2000000, 3000000, 4000000, 4500000)
"""Bauds of a servo, by the value of its register Baud Rate."""

_Id = Annotated[int, Meta(ge=0, le=252)]


class _BodyFile(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Content of a file of a body: a robot with two servos on an adapter."""

    wheel_radius_m: Annotated[float, Meta(ge=0.005, le=1)]
    wheel_separation_m: Annotated[float, Meta(ge=0.01, le=5)]
    radius_m: Annotated[float, Meta(ge=0.01, le=5)]
    scanner_x_m: Annotated[float, Meta(ge=-5, le=5)] = 0.0
    scanner_y_m: Annotated[float, Meta(ge=-5, le=5)] = 0.0
    servo_model: str = "XL430-W250"
    gear_ratio: Annotated[float, Meta(ge=0.01, le=100)] = 1.0
    are_mirrored: tuple[bool, bool] = (False, True)
    are_reversed: tuple[bool, bool] = (False, True)
    ids: tuple[_Id, _Id] = (1, 2)
    baud: int = 1_000_000
    velocity_limit: Annotated[int, Meta(ge=0, le=1023)] | None = None


def find_body(source: str | Path) -> Body:
    """Return a body.

    Args:
        source: Key of `BODIES`, or a file (YAML; docs/twin.md has its keys).

    Raises:
        ValueError: There is no such robot and no such file, or something in it is wrong; one sentence.
    """
    if isinstance(source, str) and source in BODIES:
        return BODIES[source]
    path = Path(source)
    if not path.exists():
        raise ValueError(f"there is no robot and no file {str(source)!r}; there are {', '.join(BODIES)}")
    try:
        said = decode(parse_document(read_file(path), str(path)), _BodyFile)
    except ConfigurationError as error:
        raise ValueError(error.problems[0].text(error.file)) from error
    if said.servo_model not in MODELS:
        raise ValueError(f"{path}: there is no servo model {said.servo_model!r}; there are {', '.join(MODELS)}")
    if said.baud not in BAUDS:
        raise ValueError(f"{path}: a servo has no baud {said.baud}; there are {', '.join(map(str, BAUDS))}")
    if said.ids[0] == said.ids[1]:
        raise ValueError(f"{path}: the two servos must have different ids")
    return Body(
        path.stem,
        said.wheel_radius_m,
        said.wheel_separation_m,
        said.radius_m,
        said.scanner_x_m,
        said.servo_model,
        0.0,
        0,
        said.gear_ratio,
        said.are_mirrored,
        said.are_reversed,
        said.ids,
        BAUDS.index(said.baud),
        said.velocity_limit,
        said.scanner_y_m,
    )
