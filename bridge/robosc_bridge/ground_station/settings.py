"""Settings of the line to a ground station and of its permissions, checked before anything starts."""

import ipaddress
from dataclasses import dataclass
from pathlib import Path

from robosc_bridge.configuration.structure import Configuration
from robosc_bridge.devices.interface import Velocity
from robosc_bridge.errors import BridgeError
from robosc_bridge.protocol.mavlink_signing import Signing
from robosc_bridge.transport.network_line import is_network_address

AUTOPILOT = 1
"""The component that a ground station takes for a vehicle."""

BAUD = 57_600

NETWORK_BYTES_PER_S = 60_000
"""Most that is sent over a network."""

_FORMS = "udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT, or a serial port's path, also with ,BAUD"
# Ranges in metres: of an unknown LiDAR, and of known ones by their makers' data sheets.
_ANY_RANGE_M = (0.05, 100.0)
_RANGES_M = {"lds01": (0.12, 3.5), "lds02": (0.16, 8.0), "lds03": (0.05, 12.0)}


class GroundSettingsError(BridgeError):
    """The settings of the ground station in the configuration are invalid."""


@dataclass(frozen=True)
class GroundSettings:
    """Settings of the line to a ground station.

    Attributes:
        address: Address of `transport.network_line`, or a serial port's path.
        fastest: Velocity of a full stick.
        baud: Speed of a serial port.
        system: Number of the vehicle.
        component: Number of the bridge in it.
        signing: The key; None: nothing is signed.
        accepts_unsigned: True if, without a key, more than stops and requests for messages is allowed.
        interval_s: Time between two messages of pose, and of obstacles, in seconds.
        range_m: Shortest and longest distance that the LiDAR measures.
    """

    address: str
    fastest: Velocity
    baud: int = BAUD
    system: int = 1
    component: int = AUTOPILOT
    signing: Signing | None = None
    accepts_unsigned: bool = False
    interval_s: float = 0.1
    range_m: tuple[float, float] = _ANY_RANGE_M

    @property
    def bytes_per_s(self) -> float:
        """Maximum average rate of sent bytes; a third of a serial line stays free for unsolicited messages."""
        return NETWORK_BYTES_PER_S if is_network_address(self.address) else self.baud / 10 * 2 / 3


def ground_settings(configuration: Configuration, fastest: Velocity) -> GroundSettings | None:
    """Return the settings of a configuration; None: there is no ground station.

    Args:
        configuration: Configuration with the settings in its section `remote`.
        fastest: Limits of speed and yaw rate.

    Raises:
        GroundSettingsError: The settings contradict each other.
    """
    remote = configuration.remote
    if remote.mavlink_url is None:
        return None
    address, baud = _parsed(remote.mavlink_url)
    if remote.mavlink_key is not None and remote.mavlink_unsigned_commands:
        raise GroundSettingsError(
            "remote.mavlink_unsigned_commands: with a key (mavlink_key), only signed commands are obeyed; remove one"
        )
    scanner = configuration.scanner
    return GroundSettings(
        address,
        fastest,
        baud,
        remote.mavlink_system,
        signing=None if remote.mavlink_key is None else Signing(Path(remote.mavlink_key), remote.mavlink_link_id),
        accepts_unsigned=remote.mavlink_unsigned_commands or is_loopback(address),
        interval_s=remote.mavlink_interval_s,
        range_m=_ANY_RANGE_M if scanner is None else _RANGES_M.get(scanner.driver, _ANY_RANGE_M),
    )


def is_loopback(address: str) -> bool:
    """Return True if an address connects only programs on this computer."""
    if not is_network_address(address):
        return False
    host = address.split(":")[1]
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _parsed(url: str) -> tuple[str, int]:
    """Address and baud rate."""
    if is_network_address(url):
        scheme, _, place = url.partition(":")
        host, _, port = place.rpartition(":")
        is_port = port.isascii() and port.isdecimal() and (0 if scheme == "udpin" else 1) <= int(port) <= 65535
        if host and ":" not in host and is_port:
            return url, BAUD
    elif url.startswith("/"):
        path, _, baud = url.partition(",")
        if not baud:
            return path, BAUD
        if baud.isascii() and baud.isdecimal() and 1 <= int(baud) <= 10_000_000:
            return path, int(baud)
    raise GroundSettingsError(f"remote.mavlink_url: '{url}' cannot be used; it is {_FORMS}")
