"""Tests of the refusals before anything is opened, and of starting and stopping the parts together."""

import re
import sys
from pathlib import Path

import pytest

from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc_bridge.assembly import AssemblyError, check_settings, safety_limits
from robosc_bridge.configuration import map_channels, parse
from robosc_bridge.daemon.states import State
from robosc_bridge.errors import BridgeError
from robosc_bridge.safety import Reason
from robosc_simulated import SimulatedTurtleBot3, VirtualHost
from robosc_simulated.mavlink_packets import Encoder
from support.certificates import Authority
from support.daemons import CONFIGURATION
from support.driven import driven
from support.machines import RecordedEndpoint, controller, machine


@pytest.fixture(scope="module")
def supervisor() -> Supervisor:
    return controller()


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (
            ("{channel: fault}", "{channel: grpc}"),
            "mapped to 'grpc', which needs 'remote.grpc_address': 'lost' ('/lost')",
        ),
        (
            ("skills:", "safety: {operator_link_timeout_s: 1}\nskills:"),
            "'safety.operator_link_timeout_s' needs 'remote.grpc_address' or 'remote.mavlink_url'",
        ),
        (("execution: {", "execution: {command_timeout_s: 2, "), "means nothing in the deployment 'controller'"),
    ],
)
def test_what_needs_a_remote_face_is_refused_without_one(
    change: tuple[str, str], why: str, supervisor: Supervisor
) -> None:
    configuration = parse(CONFIGURATION.replace(*change).encode(), "test.yaml").configuration
    with pytest.raises(AssemblyError) as raised:
        check_settings(configuration, map_channels(supervisor.model, configuration), Deployment.CONTROLLER)
    assert why in str(raised.value)


@pytest.mark.parametrize("chosen", ["[]", "[/turn]"])
def test_a_layer_releases_what_drives(chosen: str, supervisor: Supervisor) -> None:
    text = CONFIGURATION.replace("execution: {", f"execution: {{release_identifiers: {chosen}, ")
    configuration = parse(f"{text}\nremote: {{grpc_address: '127.0.0.1:0'}}\n".encode(), "test.yaml").configuration
    mapping = map_channels(supervisor.model, configuration)
    with pytest.raises(AssemblyError) as raised:
        check_settings(configuration, mapping, Deployment.LAYER)
    assert str(raised.value) == "execution.release_identifiers must name '/cmd_vel' in a supervision layer"
    # A controller knows what it has asked for.
    assert check_settings(configuration, mapping, Deployment.CONTROLLER)


def test_the_loop_may_be_late_as_long_as_is_said() -> None:
    text = CONFIGURATION.replace("period_s: 0.02", "period_s: 0.5").replace(
        "skills:", "safety: {overrun_s: 1, command_timeout_s: 1}\nskills:"
    )
    assert safety_limits(parse(text.encode(), "test.yaml").configuration).loop_timeout_s == 1.0
    assert safety_limits(parse(CONFIGURATION.encode(), "test.yaml").configuration).loop_timeout_s == 0.1


def test_nobody_waits_in_standby_for_somebody_who_cannot_come(supervisor: Supervisor) -> None:
    with pytest.raises(AssemblyError, match="to wait in standby, the bridge needs "):
        machine(supervisor, CONFIGURATION, starts_itself=False)


def test_a_face_that_cannot_start_opens_no_device_and_stops_the_others(supervisor: Supervisor, tmp_path: Path) -> None:
    made = machine(supervisor, CONFIGURATION.replace("/dev/base", str(tmp_path / "none")))
    first, second = RecordedEndpoint(made), RecordedEndpoint(made, "the address is in use")
    with pytest.raises(BridgeError, match="the address is in use"):
        made.run([first, second])
    assert first.calls == ["start False", "stop False None"]
    assert not made.drive.is_alive


@pytest.mark.parametrize(
    ("remote", "why"),
    [
        ("{grpc_address: '0.0.0.0:50061'}", "remote: 0.0.0.0:50061 is reachable from other machines"),
        ("{grpc_address: '127.0.0.1:70000'}", "remote: not HOST:PORT"),
        ("{grpc_address: '127.0.0.1:1', tls_key: k}", "remote: a certificate and its key must be given together"),
        ("{grpc_address: '127.0.0.1:1', client_ca: c}", "remote: client certificates need TLS"),
    ],
)
def test_a_face_that_may_not_listen_so_is_refused_before_anything_is_made(
    remote: str, why: str, supervisor: Supervisor
) -> None:
    configuration = parse(f"{CONFIGURATION}\nremote: {remote}\n".encode(), "test.yaml").configuration
    with pytest.raises(AssemblyError) as raised:
        check_settings(configuration, map_channels(supervisor.model, configuration), supervisor.deployment)
    assert why in str(raised.value)


@pytest.mark.parametrize(
    ("scanner", "why"),
    [
        (
            "lds01, port: /dev/scanner}\nsafety: {scan_timeout_s: 0.2",
            "safety.scan_timeout_s: a revolution of the LiDAR takes 0.2",
        ),
        (
            "lds03, port: /dev/scanner, options: {front_rad: left}",
            "driver 'lds03': option 'front_rad': Expected `float`",
        ),
        ("lds03, port: /dev/scanner, options: {front: 1}", "driver 'lds03': there is no option 'front'; there is baud"),
        ("lds03, port: /dev/scanner, y_m: 0.1", "scanner: x_m and y_m belong together: give both, or none"),
    ],
)
def test_a_scanner_that_cannot_be_so_is_refused(scanner: str, why: str, supervisor: Supervisor) -> None:
    text = re.sub(r"^scanner: .*$", f"scanner: {{driver: {scanner}}}", CONFIGURATION, flags=re.MULTILINE)
    configuration = parse(text.encode(), "test.yaml").configuration
    with pytest.raises(AssemblyError) as raised:
        check_settings(configuration, map_channels(supervisor.model, configuration), supervisor.deployment)
    assert why in str(raised.value)


@pytest.mark.parametrize(("place", "expected"), [("", None), (", x_m: 0, y_m: -0.06", (0.0, -0.06))])
def test_the_place_of_the_scanner_is_that_of_the_configuration(
    place: str, expected: tuple[float, float] | None, supervisor: Supervisor
) -> None:
    text = re.sub(
        r"^scanner: .*$", f"scanner: {{driver: lds03, port: /dev/scanner{place}}}", CONFIGURATION, flags=re.MULTILINE
    )
    assert machine(supervisor, text).operations.scanner_place == expected


SET_MESSAGE_INTERVAL = 511


TLS = "{grpc_address: '127.0.0.1:1', tls_certificate: CERTIFICATE, tls_key: KEY"


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (("driver: opencr", "driver: opncr"), "unknown drive base 'opncr'; did you mean 'opencr'?"),
        (("driver: lds01", "driver: lds9"), "unknown range scanner 'lds9'"),
        (("/dev/base", "/dev/base, options: {bauds: 1}"), "driver 'opencr': "),
        (("/dev/scanner", "/dev/scanner, options: {speed: 1}"), "driver 'lds01': "),
        (("skills:", "remote: {grpc_address: '127.0.0.1:1', tokens: NONE}\nskills:"), "remote: NONE: "),
        (
            ("skills:", "remote: {grpc_address: '127.0.0.1:1', tls_certificate: NONE, tls_key: NONE}\nskills:"),
            "remote: NONE: ",
        ),
        (("skills:", f"remote: {TLS}, client_ca: NONE}}\nskills:"), "remote: NONE: "),
        (
            ("skills:", "remote: {mavlink_url: 'udpout:127.0.0.1:1', mavlink_key: NONE}\nskills:"),
            "remote.mavlink_key: NONE: ",
        ),
        (("skills:", "supervisor: {ca: NONE}\nskills:"), "supervisor: NONE: "),
        (("skills:", "supervisor: {token_file: NONE}\nskills:"), "supervisor: NONE: "),
        (
            ("skills:", "supervisor: {key: NONE}\nskills:"),
            "supervisor: a certificate and its key must be given together",
        ),
    ],
)
def test_what_cannot_be_used_is_refused_without_a_start(
    change: tuple[str, str], why: str, supervisor: Supervisor, tmp_path: Path
) -> None:
    certificate, key = Authority(tmp_path).sign("bridge")
    names = {"CERTIFICATE": str(certificate), "KEY": str(key), "NONE": str(tmp_path / "none")}
    text = CONFIGURATION.replace(*change)
    for name, path in names.items():
        text, why = text.replace(name, path), why.replace(name, path)
    configuration = parse(text.encode(), "test.yaml").configuration
    with pytest.raises(BridgeError) as raised:
        check_settings(configuration, map_channels(supervisor.model, configuration), Deployment.CONTROLLER)
    assert why in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_rover_is_driven_within_its_own_limits() -> None:
    """Those of its body, not those of a TurtleBot3; one that is called like one has its numbers."""
    own = "{wheel_separation_m: 0.16, linear_m_s: 0.1, angular_rad_s: 0.5}"
    patient = "{motor_timeout_s: 1.0, scan_timeout_s: 1.0, overrun_s: 1.0}"
    with driven("mavlink-rover", velocity=(3.0, 0.0), robot=own, safety=patient) as bridge:
        assert bridge.limits.linear_m_s == 0.1
        assert bridge.limits.separation_m == 0.16
        assert bridge.limits.wheel_m_s == pytest.approx(0.14)
        bridge.until(lambda: bridge.wheels_m_s == pytest.approx((0.1, 0.1), rel=0.05), "the fastest that it may")
        assert max(speed for _, *wheels in bridge.trace.commanded for speed in wheels) <= 0.1 * 1.05
    with driven("mavlink-rover", safety=patient) as bridge:
        assert bridge.limits.linear_m_s == 0.22
        bridge.moves()


def test_a_rover_may_take_as_long_to_arm_as_its_heartbeats_need() -> None:
    """Mode and arming show in a heartbeat each: with the second and third of a slow radio lost, after 5 s."""

    def slowed(robot: SimulatedTurtleBot3) -> None:
        assert robot.rover is not None
        words = {"target_system": 1, "target_component": 1, "command": SET_MESSAGE_INTERVAL}
        packet = Encoder(255, 190).encode("COMMAND_LONG", parameters=(0.0, 2.5e6, *(0.0,) * 5), **words)
        robot.rover.receive(packet, 0)

    with driven("mavlink-rover", before=slowed) as bridge:
        bridge.moves()
        assert Reason.TORQUE_LOST not in bridge.messages


def test_faces_are_started_before_the_devices_and_stopped_after_them(supervisor: Supervisor) -> None:
    with VirtualHost() as host, SimulatedTurtleBot3("burger", "opencr", "lds01", clock=host) as robot:
        text = CONFIGURATION.replace("/dev/base", str(robot.base_path)).replace("/dev/scanner", str(robot.scanner_path))
        made = machine(supervisor, text, host=host)
        endpoint = RecordedEndpoint(made)
        before_s = sys.getswitchinterval()
        assert made.run([endpoint])
    # A busy endpoint must not hold up the other threads while the bridge runs; the interval is restored afterwards.
    assert endpoint.switch_s < 0.001 < before_s == sys.getswitchinterval()
    assert endpoint.calls == ["start False", f"stop False {State.OVER}"]


class MortalEndpoint(RecordedEndpoint):
    """One that ends by itself as soon as the robot runs."""

    @property
    def is_alive(self) -> bool:  # type: ignore[override]
        return self.made.daemon.state is not State.RUNNING

    def start(self) -> None:
        self.calls.append("start")


def test_the_robot_stops_when_a_face_ends_by_itself(supervisor: Supervisor, caplog: pytest.LogCaptureFixture) -> None:
    with VirtualHost() as host, SimulatedTurtleBot3("burger", "opencr", "lds01", clock=host) as robot:
        text = CONFIGURATION.replace("/dev/base", str(robot.base_path)).replace("/dev/scanner", str(robot.scanner_path))
        made = machine(supervisor, text, host=host)
        endpoint = MortalEndpoint(made)
        made.run([endpoint])
    assert "has ended" in made.daemon.problem
    assert caplog.text.count("the recorded endpoint has ended unexpectedly: the robot stops") == 1
    assert endpoint.calls == ["start", f"stop False {State.OVER}"]
