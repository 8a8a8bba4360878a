"""What is refused before anything is opened, and how the parts start and stop together."""

import re
from pathlib import Path

import pytest

from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc_bridge.configuration import parse, tie
from robosc_bridge.daemon.assembly import AssemblyError, check_settings, safety_limits
from robosc_bridge.errors import BridgeError
from support.daemons import CONFIGURATION
from support.machines import RecordedFace, controller, machine


@pytest.fixture(scope="module")
def supervisor() -> Supervisor:
    return controller()


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (
            ("{channel: fault}", "{channel: grpc}"),
            "tied to 'grpc', which needs 'remote.grpc_address': 'lost' ('/lost')",
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
        check_settings(configuration, tie(supervisor.model, configuration), Deployment.CONTROLLER)
    assert why in str(raised.value)


@pytest.mark.parametrize("chosen", ["[]", "[/turn]"])
def test_a_layer_releases_what_drives(chosen: str, supervisor: Supervisor) -> None:
    text = CONFIGURATION.replace("execution: {", f"execution: {{release_identifiers: {chosen}, ")
    configuration = parse(f"{text}\nremote: {{grpc_address: '127.0.0.1:0'}}\n".encode(), "test.yaml").configuration
    ties = tie(supervisor.model, configuration)
    with pytest.raises(AssemblyError) as raised:
        check_settings(configuration, ties, Deployment.LAYER)
    assert str(raised.value) == "execution.release_identifiers must name '/cmd_vel' in a supervision layer"
    # A controller knows what it has asked for.
    assert check_settings(configuration, ties, Deployment.CONTROLLER)


def test_the_loop_may_be_late_as_long_as_is_said() -> None:
    text = CONFIGURATION.replace("period_s: 0.02", "period_s: 0.5").replace(
        "skills:", "safety: {overrun_s: 1}\nskills:"
    )
    assert safety_limits(parse(text.encode(), "test.yaml").configuration).loop_timeout_s == 1.0
    assert safety_limits(parse(CONFIGURATION.encode(), "test.yaml").configuration).loop_timeout_s == 0.1


def test_nobody_waits_in_standby_for_somebody_who_cannot_come(supervisor: Supervisor) -> None:
    with pytest.raises(AssemblyError, match="to wait in standby, the bridge needs "):
        machine(supervisor, CONFIGURATION, starts_itself=False)


def test_a_face_that_cannot_start_opens_no_device_and_stops_the_others(supervisor: Supervisor, tmp_path: Path) -> None:
    made = machine(supervisor, CONFIGURATION.replace("/dev/base", str(tmp_path / "none")))
    first, second = RecordedFace(made), RecordedFace(made, "the address is in use")
    with pytest.raises(BridgeError, match="the address is in use"):
        made.run([first, second])
    assert first.told == ["start False", "stop False None"]
    assert not made.drive.is_alive


@pytest.mark.parametrize(
    ("remote", "why"),
    [
        ("{grpc_address: '0.0.0.0:50061'}", "remote: 0.0.0.0:50061 can be reached from other machines"),
        ("{grpc_address: '127.0.0.1:70000'}", "remote: not HOST:PORT"),
        ("{grpc_address: '127.0.0.1:1', tls_key: k}", "remote: a certificate and its key belong together"),
        ("{grpc_address: '127.0.0.1:1', client_ca: c}", "remote: callers' certificates are checked with TLS only"),
    ],
)
def test_a_face_that_may_not_listen_so_is_refused_before_anything_is_made(
    remote: str, why: str, supervisor: Supervisor
) -> None:
    configuration = parse(f"{CONFIGURATION}\nremote: {remote}\n".encode(), "test.yaml").configuration
    with pytest.raises(AssemblyError) as raised:
        check_settings(configuration, tie(supervisor.model, configuration), supervisor.deployment)
    assert why in str(raised.value)


@pytest.mark.parametrize(
    ("scanner", "why"),
    [
        (
            "lds01, port: /dev/scanner}\nsafety: {scan_timeout_s: 0.2",
            "safety.scan_timeout_s: a turn of the LiDAR takes 0.2",
        ),
        (
            "lds03, port: /dev/scanner, options: {front_rad: left}",
            "driver 'lds03': option 'front_rad': Expected `float`",
        ),
        ("lds03, port: /dev/scanner, options: {front: 1}", "driver 'lds03': there is no option 'front'; there is baud"),
    ],
)
def test_a_scanner_that_cannot_be_so_is_refused(scanner: str, why: str, supervisor: Supervisor) -> None:
    text = re.sub(r"^scanner: .*$", f"scanner: {{driver: {scanner}}}", CONFIGURATION, flags=re.MULTILINE)
    configuration = parse(text.encode(), "test.yaml").configuration
    with pytest.raises(AssemblyError) as raised:
        check_settings(configuration, tie(supervisor.model, configuration), supervisor.deployment)
    assert why in str(raised.value)
