"""Assembly of a daemon and the threads of its devices from a configuration."""

import contextlib
import dataclasses
import inspect
import logging
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any

import msgspec

from robosc.execution.runtime.event_log import EventLog
from robosc.execution.runtime.runner import DeploymentError
from robosc.execution.runtime.settings import Settings, SettingsError, require_settings_of
from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc_api.security import SecurityError, check_listening
from robosc_bridge.configuration.channel_mapping import ChannelMapping
from robosc_bridge.configuration.channels import GrpcChannel
from robosc_bridge.configuration.structure import Configuration, Safety, Scanner
from robosc_bridge.daemon.execution import Job
from robosc_bridge.daemon.feed import Feed
from robosc_bridge.daemon.loop import Daemon
from robosc_bridge.daemon.operations import Operations
from robosc_bridge.daemon.service_manager import ServiceManager
from robosc_bridge.daemon.states import OperatorCommand
from robosc_bridge.daemon.threads.camera_setup import camera_problems, camera_worker, needs_camera
from robosc_bridge.daemon.threads.device_thread import DeviceThread
from robosc_bridge.daemon.threads.reports import Device
from robosc_bridge.daemon.threads.workers import DriveWorker, ScannerWorker
from robosc_bridge.daemon.timing import Timing
from robosc_bridge.daemon.view_settings import settings_of as view_settings
from robosc_bridge.devices.dry_base import DryBase
from robosc_bridge.devices.interface import DriveBase, RangeScanner, Velocity
from robosc_bridge.devices.robots import ROBOTS, Body, Robot
from robosc_bridge.driver_options import checked_options
from robosc_bridge.driver_registry import (
    Driver,
    DriverFeatures,
    Kind,
    features_of,
    find_driver,
    make_drive_base,
    make_range_scanner,
)
from robosc_bridge.endpoints import Endpoint, LivenessMonitor, file_problems, is_remote, is_startable
from robosc_bridge.errors import BridgeError
from robosc_bridge.host import Host
from robosc_bridge.protocol.mavlink_signing import SigningError
from robosc_bridge.remote import settings_of
from robosc_bridge.safety import SafetyLayer, SafetyLimits
from robosc_bridge.safety.limits import REVOLUTIONS, SCAN_TIMEOUT_S, SCAN_TIMEOUTS_S
from robosc_bridge.skills import EmergencyStop, Rotate
from robosc_bridge.transport.system_host import SYSTEM_HOST

EXCHANGE_S = 0.02
"""Time between exchanges with the drive base: what OpenCR refreshes its registers at."""

MOTOR_MARGIN_V = 0.5
"""Voltage above the lowest supply of its motors at which the bridge warns where the battery is not known."""

RESTART_S = 3.0
"""After so long without a full revolution a LiDAR's motor is restarted, as its official driver does."""

KEYS: Mapping[str, str] = MappingProxyType(
    {
        "linear_acceleration_m_s2": "linear_acceleration_m_s2",
        "angular_acceleration_rad_s2": "angular_acceleration_rad_s2",
        "command_timeout_s": "command_timeout_s",
        "motor_timeout_s": "motor_timeout_s",
        "loop_timeout_s": "overrun_s",
        "operator_timeout_s": "operator_link_timeout_s",
        "min_valid_share": "min_valid_share",
        "is_stopped_when_blind": "stops_when_blind",
    }
)
"""Numbers of the safety layer that are those of a key below `safety`, and the key."""

SWITCH_S = 0.0005
"""After how long a thread that computes lets others run. With Python's own 5 ms, a remote endpoint that is busy
would hold up a stop three times: the scanner's thread, the loop, and the drive base's thread follow one another."""

# Longer than anything that a device's thread does at once, such as calibrating a gyroscope, or bringing a rover to rest
# and undoing what may have begun.
_THREAD_LIMIT_S = 15.0

_log = logging.getLogger(__name__)


class AssemblyError(BridgeError):
    """A configuration has a part that cannot be made; the message names it."""


def safety_limits(configuration: Configuration) -> SafetyLimits:
    """The numbers of the safety layer; what the configuration leaves to the drive is what the robot can do.

    Raises:
        AssemblyError: They do not go together.
    """
    robot, chosen = _robot(configuration), configuration.safety
    features = features_of(configuration.drive.driver) or DriverFeatures()
    can = robot.limits if isinstance(robot, Body) else robot.limits(robot.motor.velocity_limit_raw)
    numbers = {name: getattr(chosen, key) for name, key in KEYS.items()}
    for part in ("linear", "angular"):
        unit = "m" if part == "linear" else "rad"
        slower = f"{part}_deceleration_{unit}_s2"
        numbers[slower] = max(numbers[f"{part}_acceleration_{unit}_s2"], getattr(SafetyLimits, slower))
    warn_v, stop_v = _battery(chosen, features, robot)
    try:
        return SafetyLimits(
            **numbers,
            linear_m_s=min(chosen.linear_m_s or math.inf, can.linear_m_s),
            angular_rad_s=min(chosen.angular_rad_s or math.inf, can.angular_rad_s),
            wheel_m_s=can.wheel_m_s,
            separation_m=robot.wheel_separation_m,
            scan_timeout_s=None if configuration.scanner is None else scan_timeout_s(configuration.scanner, chosen),
            torque_on_s=features.torque_on_s or SafetyLimits.torque_on_s,
            astray_s=features.astray_s or SafetyLimits.astray_s,
            astray_m_s=features.astray_m_s or SafetyLimits.astray_m_s,
            battery_warn_v=warn_v,
            battery_stop_v=stop_v,
            has_own_controls=features.has_own_controls,
            is_torque_off_on_operator_stop=(
                features.has_own_controls
                if chosen.torque_off_on_operator_stop is None
                else chosen.torque_off_on_operator_stop
            ),
        )
    except ValueError as error:
        raise AssemblyError(f"safety: {error}") from error


def _battery(chosen: Safety, features: DriverFeatures, robot: Robot | Body) -> tuple[float | None, float | None]:
    """Return the voltages of a warning and of the end: those that are chosen, else of the pack or the motors."""
    warn_v, stop_v = features.battery_v or (None, None)
    if features.battery_v is None and isinstance(robot, Robot):
        stop_v = robot.motor.lowest_v
        warn_v = stop_v + MOTOR_MARGIN_V
    stop_v = stop_v if chosen.battery_stop_v is None else chosen.battery_stop_v
    if chosen.battery_warning_v is not None:
        warn_v = chosen.battery_warning_v
    elif stop_v is not None:
        warn_v = stop_v if warn_v is None else max(warn_v, stop_v)
    return warn_v, stop_v


def scan_timeout_s(scanner: Scanner, chosen: Safety) -> float:
    """Return the time without a full scan after which a LiDAR counts as silent, in seconds."""
    if chosen.scan_timeout_s is not None:
        return chosen.scan_timeout_s
    if scanner.driver in SCAN_TIMEOUTS_S:
        return SCAN_TIMEOUTS_S[scanner.driver]
    features = features_of(scanner.driver, Kind.RANGE_SCANNER)
    if features is None or features.revolution_s is None:
        return SCAN_TIMEOUT_S
    return REVOLUTIONS * features.revolution_s


def check_settings(configuration: Configuration, mapping: ChannelMapping, deployment: Deployment) -> Settings:
    """Return the executor's settings; find whatever else `assemble` would refuse as well, and open nothing.

    Args:
        configuration: Configuration of the robot.
        mapping: Channels that the model's communications are mapped to.
        deployment: Deployment of the supervisor.

    Raises:
        AssemblyError: Something does not fit, or a file is missing or wrong; says what.
        GroundSettingsError: The ground station cannot be reached as configured.
        UnknownDriverError: There is no such driver.
    """
    _require_endpoints(configuration, mapping)
    if deployment is Deployment.LAYER and not is_remote(configuration):
        raise AssemblyError(
            "a supervision layer needs 'remote.grpc_address' or 'remote.mavlink_url' for those who send requests to it"
        )
    limits = safety_limits(configuration)
    fastest = Velocity(limits.linear_m_s, limits.angular_rad_s)
    drive_base(configuration)
    if configuration.scanner is not None:
        range_scanner(configuration.scanner)
    settings = mapping.settings(configuration.execution, deployment)
    problems = [
        *file_problems(configuration, fastest),
        *camera_problems(configuration.skills.line, mapping, settings),
        *_scan_problems(configuration),
    ]
    if problems:
        raise AssemblyError("; ".join(problems))
    kept = mapping.never_released(settings) if deployment is Deployment.LAYER else ()
    if kept:
        # A velocity would outlive the program that asked for it.
        names = ", ".join(f"'{identifier}'" for identifier in kept)
        raise AssemblyError(f"execution.release_identifiers must name {names} in a supervision layer")
    try:
        require_settings_of(settings, str(deployment))
    except SettingsError as error:
        raise AssemblyError(f"execution: {error}") from error
    return settings


def _scanner_place(scanner: Scanner | None) -> tuple[float, float] | None:
    """Return the place of the LiDAR, if the configuration has it."""
    if scanner is None or scanner.x_m is None or scanner.y_m is None:
        return None
    return scanner.x_m, scanner.y_m


def _scan_problems(configuration: Configuration) -> list[str]:
    """A time within which no revolution can be complete would stop the robot for ever; half a place is none."""
    scanner = configuration.scanner
    if scanner is not None and (scanner.x_m is None) != (scanner.y_m is None):
        return ["scanner: x_m and y_m belong together: give both, or none"]
    features = None if scanner is None else features_of(scanner.driver, Kind.RANGE_SCANNER)
    if scanner is None or features is None or features.revolution_s is None:
        return []
    if scan_timeout_s(scanner, configuration.safety) > features.revolution_s:
        return []
    return [
        f"safety.scan_timeout_s: a revolution of the LiDAR takes {features.revolution_s:g} s; the time must be longer"
    ]


def _robot(configuration: Configuration) -> Robot | Body:
    """The robot, as its drive needs it."""
    chosen, features = configuration.robot, features_of(configuration.drive.driver)
    if isinstance(chosen, str):
        known = ROBOTS[chosen]
        knows = features is not None and (features.needs_turtlebot3 or features.knows_turtlebot3)
        return known if knows else known.body
    return Body(chosen.linear_m_s, chosen.angular_rad_s, chosen.wheel_separation_m)


def drive_base(configuration: Configuration, host: Host = SYSTEM_HOST) -> DriveBase:
    """The drive base, not opened yet.

    Raises:
        UnknownDriverError: There is no such driver.
        AssemblyError: It takes no such option.
    """
    drive = configuration.drive
    driver = find_driver(Kind.DRIVE_BASE, drive.driver)
    try:
        options = checked_options(driver, drive.options) | _on(host, driver)
        return make_drive_base(drive.driver, path=drive.port, robot=_robot(configuration), **options)
    except (SigningError, TypeError, ValueError) as error:
        raise AssemblyError(f"driver '{drive.driver}': {error}") from error


def _on(host: Host, driver: Driver) -> dict[str, Host]:
    """Arguments of a driver; that of a plug-in need not know any host but this computer."""
    takes_host = "host" in inspect.signature(driver.make).parameters
    return {"host": host} if takes_host and host is not SYSTEM_HOST else {}


def range_scanner(scanner: Scanner, host: Host = SYSTEM_HOST) -> RangeScanner:
    """The LiDAR, not opened yet; raises as `drive_base`."""
    driver = find_driver(Kind.RANGE_SCANNER, scanner.driver)
    try:
        options = checked_options(driver, scanner.options) | _on(host, driver)
        return make_range_scanner(scanner.driver, path=scanner.port, **options)
    except (SigningError, TypeError, ValueError) as error:
        raise AssemblyError(f"driver '{scanner.driver}': {error}") from error


@dataclass(frozen=True)
class Machine:
    """Daemon and the threads of its devices.

    Attributes:
        daemon: The loop, run by whoever calls `run`.
        drive: The drive base's thread.
        scanner: The LiDAR's thread; None: there is none.
        camera: The camera's thread; None: no communication is mapped to it.
        operations: The daemon as remote endpoints see it.
        liveness: Monitor of threads and endpoints that must not end while the robot runs.
        manager: Service manager that the bridge notifies that it is alive.
        worker: Worker of the drive base.
    """

    daemon: Daemon
    drive: DeviceThread
    scanner: DeviceThread | None
    camera: DeviceThread | None
    operations: Operations
    liveness: LivenessMonitor
    manager: ServiceManager
    worker: DriveWorker

    def run(self, endpoints: Sequence[Endpoint] = ()) -> bool:
        """Start the remote endpoints and the threads, run the loop to its end, and stop them.

        Returns:
            Whether all threads gave back their devices in time, and nothing that was begun may still hold or move; what
            is left is logged.

        Raises:
            BridgeError: An endpoint cannot be started; no device was opened then.
        """
        threads = [thread for thread in (self.drive, self.scanner, self.camera) if thread]
        with contextlib.ExitStack() as stack:
            stack.callback(sys.setswitchinterval, sys.getswitchinterval())
            sys.setswitchinterval(SWITCH_S)
            for endpoint in endpoints:
                stack.callback(endpoint.stop)
                endpoint.start()
                self.liveness.watch(endpoint)
            for thread in threads:
                thread.start()
            self.manager.ready()
            stack.callback(self.manager.close)
            try:
                self.daemon.run()
            finally:
                self.manager.stopping()
                # The drive base first: whatever else hangs, the wheels stop.
                self.worker.end()
                ended = [thread.stop(_THREAD_LIMIT_S) for thread in threads]
        if not all(ended):
            _log.error("a device was not given back within %g s; its motors may hold or move", _THREAD_LIMIT_S)
        if self.worker.leftover:
            _log.error("%s", self.worker.leftover)
        return all(ended) and not self.worker.leftover

    def quit(self) -> None:
        """Let `run` end; from any thread or signal handler."""
        self.daemon.post(OperatorCommand.QUIT)


def _require_endpoints(configuration: Configuration, mapping: ChannelMapping) -> None:
    """Require a remote endpoint that may listen at its address, for everything that is reached from elsewhere."""
    needing = [f"'{item.name}' ('{item.identifier}')" for item, _ in mapping.mapped_to(GrpcChannel)]
    if needing and configuration.remote.grpc_address is None:
        raise AssemblyError(f"mapped to 'grpc', which needs 'remote.grpc_address': {', '.join(needing)}")
    if configuration.safety.operator_link_timeout_s is not None and not is_remote(configuration):
        raise AssemblyError("'safety.operator_link_timeout_s' needs 'remote.grpc_address' or 'remote.mavlink_url'")
    endpoint = settings_of(configuration)
    if endpoint is not None:
        try:
            check_listening(endpoint.address, endpoint.security)
        except (SecurityError, ValueError) as error:
            raise AssemblyError(f"remote: {error}") from error
    page = view_settings(configuration)
    if page is not None:
        try:
            check_listening(page.address, page.security)
        except (SecurityError, ValueError) as error:
            raise AssemblyError(f"view: {error}") from error
        if page.scene is not None:
            # The simulator is imported only for a map that is wanted.
            from robosc_view.scene_map import scene_map

            try:
                scene_map(page.scene, page.scene_seed)
            except BridgeError as error:
                raise AssemblyError(f"view: {error}") from error


def assemble(
    configuration: Configuration,
    mapping: ChannelMapping,
    supervisor: Supervisor,
    log: EventLog,
    deployment: Deployment = Deployment.CONTROLLER,
    *,
    starts_itself: bool,
    host: Host = SYSTEM_HOST,
    is_dry: bool = False,
) -> Machine:
    """Make everything; nothing is opened yet.

    Args:
        configuration: Configuration of the robot.
        mapping: Channels that the model's communications are mapped to.
        supervisor: Supervisor that is executed.
        log: Log that its events are written to.
        deployment: Deployment of the supervisor: it decides itself, or lets requests of programs through.
        starts_itself: True if it starts as soon as the devices are there.
        host: Host that it runs on.
        is_dry: True if the wheels are to stay at rest, with torque off, whatever is commanded.

    Raises:
        AssemblyError: A device or number does not fit, or the supervisor has another deployment.
        UnknownDriverError: There is no such driver.
    """
    settings = check_settings(configuration, mapping, deployment)
    if not starts_itself and not is_startable(configuration):
        needed = "'remote.grpc_address', 'remote.mavlink_url' or 'view.address'"
        raise AssemblyError(f"to wait in standby, the bridge needs {needed}")
    limits = safety_limits(configuration)
    safety = SafetyLayer(limits)
    # A bridge with an endpoint can be started again by a call.
    is_layer = deployment is Deployment.LAYER
    job = Job(
        supervisor,
        mapping,
        settings,
        needs_scanner=configuration.scanner is not None,
        needs_camera=needs_camera(mapping),
        starts_itself=starts_itself,
        stays_after_fault=is_startable(configuration),
        is_layer=is_layer,
    )
    rotate = configuration.skills.rotate
    # A rotation has a time limit, which goes by its speed.
    speed_rad_s = min(rotate.speed_rad_s, limits.angular_rad_s)
    slowest_rad_s = min(rotate.slowest_rad_s, speed_rad_s)
    rotate = msgspec.structs.replace(rotate, speed_rad_s=speed_rad_s, slowest_rad_s=slowest_rad_s)
    stop = EmergencyStop(configuration.skills.emergency_stop)
    feed = Feed()
    base = drive_base(configuration, host)
    if is_dry:
        base = DryBase(base, limits.separation_m, host.monotonic)
    lidar = None if configuration.scanner is None else range_scanner(configuration.scanner, host)
    timing = Timing(host.monotonic, _line_counts(base, lidar), decides_at_once=settings.every == "event")
    try:
        daemon = Daemon(job, safety, Rotate(rotate), stop, host, log, feed, host.queue(), timing)
    except (DeploymentError, SettingsError) as error:
        raise AssemblyError(str(error)) from error
    worker = DriveWorker(base, safety, daemon.post, EXCHANGE_S, host.monotonic, timing=timing)
    drive = DeviceThread(worker, host)
    scanner = None
    if lidar is not None and configuration.scanner is not None:
        listener = ScannerWorker(
            lidar,
            safety,
            daemon.post,
            scan_timeout_s(configuration.scanner, configuration.safety),
            RESTART_S,
            host.monotonic,
            bad_frames_share=configuration.safety.bad_frames_share,
        )
        scanner = DeviceThread(listener, host)
    camera = None
    if job.needs_camera:
        camera = DeviceThread(camera_worker(configuration.skills.line, daemon.post, host.monotonic), host)
    threads = [thread for thread in (drive, scanner, camera) if thread]
    liveness = LivenessMonitor(threads)
    daemon.connect(drive.hurry, worker.reset, liveness.are_alive)
    operations = Operations(
        supervisor,
        mapping,
        feed,
        daemon.post,
        lambda: safety.operator_seen(host.monotonic()),
        is_layer=is_layer,
        turtlebot=configuration.robot if isinstance(configuration.robot, str) else "",
        scanner_place=_scanner_place(configuration.scanner),
    )
    manager = ServiceManager(lambda now_s: drive.is_alive and worker.is_cycling(now_s))
    daemon.beat = lambda now_s: manager.beat(now_s, daemon.state)
    return Machine(daemon, drive, scanner, camera, operations, liveness, manager, worker)


def _line_counts(base: DriveBase, lidar: RangeScanner | None) -> dict[str, Callable[[], dict[str, int]]]:
    """Counts of the devices' lines, by device; those of drivers that keep none are left out."""
    found: dict[str, Callable[[], dict[str, int]]] = {}
    for device, driver in ((Device.DRIVE, base), (Device.SCANNER, lidar)):
        if dataclasses.is_dataclass(getattr(driver, "counters", None)):
            found[device] = partial(_counted, driver)
    return found


def _counted(driver: Any) -> dict[str, int]:
    return dataclasses.asdict(driver.counters)
