"""Check of the files that a configuration names for remote access, before anything starts.

They are read as they are when they are used, so that what is wrong with one is not found by a robot that is started
and cannot be reached.
"""

from collections.abc import Callable, Iterator

from robosc_api.security import SecurityError, check_credentials, check_files
from robosc_bridge.configuration.structure import Configuration
from robosc_bridge.daemon.supervisors import credentials_of
from robosc_bridge.devices.interface import Velocity
from robosc_bridge.errors import BridgeError
from robosc_bridge.ground_station import ground_settings
from robosc_bridge.remote import settings_of


def file_problems(configuration: Configuration, fastest: Velocity) -> list[str]:
    """Return the problems of the files; empty: none.

    Args:
        configuration: Configuration that names the files.
        fastest: Limits of speed and yaw rate.

    Raises:
        GroundSettingsError: The ground station cannot be reached as configured.
    """
    found = []
    for section, look in _looks(configuration, fastest):
        try:
            look()
        except (SecurityError, BridgeError) as error:
            found.append(f"{section}: {error}")
    return found


def _looks(configuration: Configuration, fastest: Velocity) -> Iterator[tuple[str, Callable[[], object]]]:
    """Yield each section with the function that reads its files."""
    endpoint = settings_of(configuration)
    if endpoint is not None:
        security = endpoint.security
        yield "remote", lambda: check_files(security)
    ground = ground_settings(configuration, fastest)
    if ground is not None and ground.signing is not None:
        yield "remote.mavlink_key", ground.signing.check
    yield "supervisor", lambda: check_credentials(credentials_of(configuration.supervisor))
