"""The robots' bodies, in numbers of the simulators' own: the drivers hold theirs."""

from dataclasses import dataclass


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
    """

    name: str
    wheel_radius_m: float
    wheel_separation_m: float
    radius_m: float
    scanner_x_m: float
    servo_model: str
    fastest_rpm: float
    opencr_information: int


BODIES = {
    body.name: body
    for body in (
        Body("burger", 0.033, 0.160, 0.105, -0.032, "XL430-W250", 61.0, 1),
        Body("waffle", 0.033, 0.287, 0.220, -0.064, "XM430-W210", 77.0, 2),
        Body("waffle_pi", 0.033, 0.287, 0.220, -0.064, "XM430-W210", 77.0, 2),
    )
}
