"""The drivers named `mavlink-rover`, with options of types that a configuration file can contain."""

from pathlib import Path

from robosc_bridge.devices.mavlink_link import BAUD, OWN_COMPONENT, OWN_SYSTEM
from robosc_bridge.devices.mavlink_obstacles import MavlinkObstacles
from robosc_bridge.devices.mavlink_rover import MavlinkRover
from robosc_bridge.devices.robots import Body
from robosc_bridge.host import Host
from robosc_bridge.protocol.mavlink_signing import Signing
from robosc_bridge.transport.system_host import SYSTEM_HOST


def make_rover(
    path: str,
    robot: Body,
    baud: int = BAUD,
    *,
    system: int | None = None,
    own_system: int = OWN_SYSTEM,
    own_component: int = OWN_COMPONENT,
    signing_key: str | None = None,
    signing_link: int = 0,
    motion_limit_s: float = 1.0,
    telemetry_s: float = 0.05,
    host: Host = SYSTEM_HOST,
) -> MavlinkRover:
    """Return a drive base.

    Args:
        path: Path as for `MavlinkRover`.
        robot: Abilities of the robot.
        baud: Speed of a serial port.
        system: System number of the vehicle; None: the first rover that is heard.
        own_system: Our system number, from 1 to 255.
        own_component: Our component number, from 1 to 255; not both may be the autopilot's.
        signing_key: File with the key of signing; None: nothing is signed.
        signing_link: Number of the signed stream.
        motion_limit_s: Time for which the vehicle's last estimate of its motion holds, in seconds.
        telemetry_s: Period at which it is asked to report its motion, in seconds.
        host: Parts of its computer that it uses.

    Raises:
        SigningError: There is no key in that file.
        ValueError: An argument is out of its range.
    """
    return MavlinkRover(
        path,
        robot,
        baud,
        system=system,
        own_system=own_system,
        own_component=own_component,
        signing=_signing(signing_key, signing_link),
        motion_limit_s=motion_limit_s,
        telemetry_s=telemetry_s,
        host=host,
    )


def make_obstacles(
    path: str,
    baud: int = BAUD,
    *,
    system: int | None = None,
    own_system: int = OWN_SYSTEM,
    own_component: int = OWN_COMPONENT,
    signing_key: str | None = None,
    signing_link: int = 0,
    host: Host = SYSTEM_HOST,
) -> MavlinkObstacles:
    """Return a range scanner; arguments and errors are those of `make_rover`."""
    return MavlinkObstacles(
        path,
        baud,
        system=system,
        own_system=own_system,
        own_component=own_component,
        signing=_signing(signing_key, signing_link),
        host=host,
    )


def _signing(key_file: str | None, link: int) -> Signing | None:
    if not 0 <= link <= 255:
        raise ValueError(f"signing_link must be from 0 to 255, not {link}")
    if key_file is None:
        return None
    signing = Signing(Path(key_file), link)
    signing.check()
    return signing
