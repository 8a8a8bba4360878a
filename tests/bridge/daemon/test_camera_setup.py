"""Tests that the camera's sightings and its state reach the model, and that models that need a camera have one."""

import logging

import pytest

from robosc.certification import make_supervisor
from robosc.execution.runtime.clock import ManualClock
from robosc.execution.runtime.event_log import MemoryLog
from robosc.model.structure import Deployment
from robosc_bridge.assembly import AssemblyError, assemble, check_settings
from robosc_bridge.configuration import map_channels, parse
from robosc_bridge.configuration.channel_mapping import ChannelMapping
from robosc_bridge.configuration.structure import Configuration
from robosc_bridge.daemon.execution import Job
from robosc_bridge.daemon.loop import Daemon
from robosc_bridge.daemon.states import State
from robosc_bridge.daemon.threads.camera_setup import needs_camera
from robosc_bridge.daemon.threads.reports import Device, DeviceDown, DeviceUp, Report, SafetyNotice, Sighting
from robosc_bridge.safety import Caution, SafetyLayer, SafetyLimits
from robosc_bridge.skills import EmergencyStop, Rotate
from support.models import bundle_of

MODEL = """
robot Watcher {
    datatype object Number { data: double }
    component Eyes {
        outgoing message correction with identifier: "/line", type: double
        outgoing message lost with identifier: "/lost", type: none
        outgoing message blind with identifier: "/blind", type: string
        outgoing message sees with identifier: "/sees", type: none
        outgoing message broken with identifier: "/broken", type: none
        behaviour {
            variable aside: double = 0.0
            on response from correction do aside := value goto found
            on response from lost goto nowhere
            on response from blind goto nowhere
            on response from sees
            on response from broken
            initial marked state nowhere { }
            marked state found { }
        }
    }
}
"""
DEVICES = "robot: burger\ndrive: {driver: opencr, port: /dev/base}\n"
ALL = {
    "/line": "{channel: line}",
    "/lost": "{channel: line_lost}",
    "/blind": "{channel: fault, device: camera}",
    "/sees": "{channel: fault, device: camera, event: back}",
    "/broken": "{channel: fault, device: any}",
}
LIMITS = SafetyLimits(linear_m_s=0.2, angular_rad_s=2.0, wheel_m_s=0.2, separation_m=0.16, scan_timeout_s=None)

MADE = make_supervisor(bundle_of(MODEL))


def mapped(more: str = "", **channels: str) -> tuple[Configuration, ChannelMapping]:
    """All communications as `ALL` says, but for those that are named here."""
    chosen = ALL | {f"/{name}": channel for name, channel in channels.items()}
    lines = "".join(f"  {name}: {channel}\n" for name, channel in chosen.items())
    assert MADE.supervisor is not None, MADE.reason
    configuration = parse(f"{DEVICES}{more}channels:\n{lines}".encode(), "test.yaml").configuration
    return configuration, map_channels(MADE.supervisor.model, configuration)


def test_a_warning_is_logged_when_it_begins(caplog: pytest.LogCaptureFixture) -> None:
    scene = Scene()
    blind, both = (Caution.SCAN_BLIND,), (Caution.BATTERY, Caution.SCAN_BLIND)
    for warnings in (blind, both, blind, (), blind):
        scene.report(SafetyNotice((), warnings))
    assert [record.message for record in caplog.records] == [
        Caution.SCAN_BLIND,
        Caution.BATTERY,
        Caution.SCAN_BLIND,
    ]


NONE = {"lost": "{channel: none}", "blind": "{channel: none}", "sees": "{channel: none}"}


class Scene:
    """A daemon, and devices that a test plays."""

    def __init__(self) -> None:
        configuration, mapping = mapped()
        assert MADE.supervisor is not None
        clock = ManualClock(now_s=50.0)
        self.log = MemoryLog()
        job = Job(
            MADE.supervisor,
            mapping,
            mapping.settings(configuration.execution, MADE.supervisor.deployment),
            False,
            True,
            needs_camera=True,
        )
        skills = configuration.skills
        stop = EmergencyStop(skills.emergency_stop)
        self.daemon = Daemon(job, SafetyLayer(LIMITS), Rotate(skills.rotate), stop, clock, self.log)

    def report(self, *reports: Report) -> list[str]:
        """The model's events that follow."""
        before = len(self.log.entries)
        self.daemon.cycle(*reports)
        return [entry["event"] for entry in self.log.entries[before:] if entry["kind"] == "event"]

    def up(self) -> None:
        self.report(DeviceUp(Device.DRIVE))
        self.report(DeviceUp(Device.CAMERA))
        assert self.daemon.state is State.RUNNING


def test_it_waits_for_the_camera_and_says_so(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "robosc_bridge.daemon")
    scene = Scene()
    scene.report()
    scene.report(DeviceUp(Device.DRIVE))
    scene.report(Sighting(50.0, None), DeviceDown(Device.CAMERA, "/dev/video0: there is no such camera", 1.0, True))
    scene.report()
    states = [scene.daemon.state]
    scene.report(DeviceUp(Device.CAMERA))
    assert [*states, scene.daemon.state] == [State.STARTING, State.RUNNING]
    assert [record.message for record in caplog.records] == [
        "waiting: the drive base is not there",
        "the drive is there",
        "waiting: the camera is not there",
        "camera: /dev/video0: there is no such camera",
        "the camera is there",
        "standby",
        "running",
    ]


def test_the_model_gets_the_line_and_its_loss() -> None:
    scene = Scene()
    scene.up()
    assert scene.report(Sighting(50.0, 0.25)) == ["correction.response"]
    assert scene.log.entries[-1]["state"]["Eyes"] == {"state": "found", "variables": {"aside": 0.25}}
    assert scene.report(Sighting(50.1, None)) == ["lost.response"]
    assert scene.log.entries[-1]["state"]["Eyes"]["state"] == "nowhere"
    assert scene.report(Sighting(50.2, -0.5)) == ["correction.response"]


def test_the_model_gets_the_cameras_faults_and_the_robot_is_not_stopped_for_them() -> None:
    scene = Scene()
    scene.up()
    assert scene.report(DeviceDown(Device.CAMERA, "no picture for 0.5 s", 0.0, True)) == [
        "blind.response",
        "broken.response",
    ]
    # A mere repetition is no news.
    assert scene.report(DeviceDown(Device.CAMERA, "gone", 1.0, False)) == []
    assert scene.report(DeviceUp(Device.CAMERA)) == ["sees.response"]
    assert scene.daemon.state is State.RUNNING


def test_a_lost_camera_is_no_lost_drive_base() -> None:
    scene = Scene()
    scene.up()
    scene.report(DeviceDown(Device.CAMERA, "gone", 1.0, True))
    assert (scene.daemon.state, scene.daemon.problem) == (State.RUNNING, "")


@pytest.mark.parametrize(
    ("channels", "is_needed"),
    [
        ({}, True),
        ({**NONE, "line": "{channel: none}"}, False),
        ({**NONE, "line": "{channel: none}", "lost": "{channel: line_lost}"}, True),
        ({**NONE, "line": "{channel: none}", "blind": "{channel: fault, device: camera}"}, True),
        ({**NONE, "line": "{channel: none}", "blind": "{channel: fault, device: any}"}, False),
    ],
)
def test_a_camera_is_opened_only_for_whom_it_is_for(channels: dict[str, str], is_needed: bool) -> None:
    configuration, mapping = mapped(**channels)
    assert needs_camera(mapping) is is_needed
    assert MADE.supervisor is not None
    machine = assemble(configuration, mapping, MADE.supervisor, MemoryLog(), starts_itself=True)
    assert (machine.camera is not None) is is_needed


def check(configuration: Configuration, mapping: ChannelMapping) -> None:
    check_settings(configuration, mapping, Deployment.CONTROLLER)


def test_a_line_whose_loss_no_message_reports_is_refused() -> None:
    with pytest.raises(AssemblyError, match=r"'correction' \('/line'\) is mapped to 'line', and no message reports a"):
        check(*mapped(lost="{channel: none}"))
    check(*mapped("execution: {max_age_s: {/line: 0.5}}\n", lost="{channel: none}"))
    check(*mapped())


def test_a_simulator_without_a_place_is_refused() -> None:
    with pytest.raises(AssemblyError, match="as simulated:PATH"):
        check(*mapped("skills: {line: {camera: simulated}}\n"))
    check(*mapped("skills: {line: {camera: 'simulated:/tmp/x'}}\n"))
    check(*mapped("skills: {line: {camera: simulated}}\n", line="{channel: none}", **NONE))
