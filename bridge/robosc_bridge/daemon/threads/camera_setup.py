"""Need of a model for the camera, and the worker that looks through it."""

from collections.abc import Callable

from robosc.execution.runtime.settings import Settings
from robosc_bridge.configuration.channel_mapping import ChannelMapping
from robosc_bridge.configuration.channels import FaultChannel, LineChannel, LineLostChannel
from robosc_bridge.daemon.threads.reports import Report
from robosc_bridge.daemon.threads.workers import Worker
from robosc_bridge.skills.settings import LineSettings


def needs_camera(mapping: ChannelMapping) -> bool:
    """Return True if a communication is mapped to the line or to the faults of the camera.

    A fault of `any` device alone needs no camera.
    """
    faults = (mapped for _, mapped in mapping.mapped_to(FaultChannel))
    return bool(
        mapping.mapped_to(LineChannel)
        or mapping.mapped_to(LineLostChannel)
        or any(isinstance(mapped, FaultChannel) and mapped.device == "camera" for mapped in faults)
    )


def camera_problems(line: LineSettings, mapping: ChannelMapping, settings: Settings) -> list[str]:
    """Return the problems of the camera and of channels of the line: a model that reads it must learn of its loss."""
    found = []
    if needs_camera(mapping) and line.camera == "simulated":
        found.append("skills.line.camera: write where the simulator serves its pictures, as simulated:PATH")
    if not mapping.mapped_to(LineLostChannel):
        found += [
            f"'{item.name}' ('{item.identifier}') is mapped to 'line', and no message reports a lost line: map a "
            f"message to 'line_lost', or set execution.max_age_s for '{item.identifier}'"
            for item, _ in mapping.mapped_to(LineChannel)
            if item.max_age is None and item.identifier not in settings.max_age_s
        ]
    return found


def camera_worker(settings: LineSettings, report: Callable[[Report], None], clock: Callable[[], float]) -> Worker:
    """Return the worker that keeps the camera open; the camera is not opened yet."""
    # OpenCV and numpy are for those who look.
    from robosc_bridge.daemon.threads.camera_worker import CameraWorker
    from robosc_bridge.devices.camera import make_camera

    return CameraWorker(make_camera(settings.camera), settings, report, clock)
