"""Remote endpoints of the daemon, as the program starts and stops them."""

import logging
from collections.abc import Callable, Iterator, Sequence
from typing import Protocol

from robosc_api.security import SecurityError, check_credentials, check_files
from robosc_bridge.configuration.structure import Configuration
from robosc_bridge.daemon.operations import Operations
from robosc_bridge.daemon.supervisors import credentials_of
from robosc_bridge.daemon.threads.device_thread import DeviceThread
from robosc_bridge.daemon.view_settings import settings_of as view_settings
from robosc_bridge.devices.interface import Velocity
from robosc_bridge.errors import BridgeError
from robosc_bridge.ground_station.settings import ground_settings
from robosc_bridge.remote import RemoteEndpoint, settings_of
from robosc_bridge.safety import SafetyLimits

_log = logging.getLogger(__name__)


class Endpoint(Protocol):
    """Server for operators or ground stations, with threads of its own."""

    @property
    def name(self) -> str:
        """Name of the endpoint, for the log."""

    @property
    def is_alive(self) -> bool:
        """True if the endpoint serves: from `start` until `stop`, unless it has failed."""

    def start(self) -> None:
        """Begin to serve; the robot does not move yet.

        Raises:
            BridgeError: The endpoint cannot serve, such as on an address that is in use.
        """

    def stop(self) -> None:
        """End all calls and threads of the endpoint within some seconds; never raises, may be called again."""


class LivenessMonitor:
    """Monitor of the threads and endpoints that must not end while the robot runs.

    Args:
        threads: Threads of devices; the drivers report the state of the devices themselves.
    """

    def __init__(self, threads: Sequence[DeviceThread]) -> None:
        self._threads = tuple(threads)
        self._endpoints: tuple[Endpoint, ...] = ()
        self._reported: set[str] = set()

    def watch(self, endpoint: Endpoint) -> None:
        """Watch this endpoint, too: a robot whose endpoint has ended takes no stop from it."""
        self._endpoints = (*self._endpoints, endpoint)

    def are_alive(self) -> bool:
        """Return True if no thread and no endpoint has ended; log each endpoint that has ended, once."""
        ended = [endpoint.name for endpoint in self._endpoints if not endpoint.is_alive]
        for name in ended:
            if name not in self._reported:
                self._reported.add(name)
                _log.critical("the %s has ended unexpectedly: the robot stops, and the bridge must be restarted", name)
        return not ended and all(thread.is_alive for thread in self._threads)


def is_remote(configuration: Configuration) -> bool:
    """Return True if a remote endpoint is configured, by which programs and operators reach the robot all the time."""
    return configuration.remote.grpc_address is not None or configuration.remote.mavlink_url is not None


def is_startable(configuration: Configuration) -> bool:
    """Return True if an operator can start the robot through an endpoint, and start it again."""
    return is_remote(configuration) or configuration.view.address is not None


def make_endpoints(configuration: Configuration, operations: Operations, limits: SafetyLimits) -> tuple[Endpoint, ...]:
    """The remote endpoints that are configured, not started yet.

    Raises:
        BridgeError: One cannot be made as it is configured.
    """
    endpoints: list[Endpoint] = []
    remote = settings_of(configuration)
    if remote is not None:
        endpoints.append(RemoteEndpoint(operations, remote))
    ground = ground_settings(configuration, Velocity(limits.linear_m_s, limits.angular_rad_s))
    if ground is not None:
        # MAVLink's dialect takes long to load, and few robots need it.
        from robosc_bridge.ground_station.link import GroundLink

        endpoints.append(GroundLink(operations, ground))
    if configuration.remote.metrics_address is not None:
        # Its modules are loaded only for a configured endpoint.
        from robosc_bridge.daemon.metrics import MetricsEndpoint

        is_open = configuration.remote.insecure_beyond_loopback
        endpoints.append(MetricsEndpoint(operations.feed, configuration.remote.metrics_address, is_open=is_open))
    page = view_settings(configuration)
    if page is not None:
        # The page's modules are loaded only for a configured page.
        from robosc_view import ViewEndpoint

        endpoints.append(ViewEndpoint(operations, page))
    return tuple(endpoints)


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
