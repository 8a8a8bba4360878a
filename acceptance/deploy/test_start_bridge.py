"""The bridge's container and its unit: the commands that stand in their files, run as they would be."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from robosc_bridge.main import main as robosc_bridge
from support.certificates import Authority
from support.containers import TOP, Container, Image, Network, Start, build, wheels_of, why_not
from support.units import read_unit

MODEL = TOP / "examples" / "maze_solver" / "maze_solver.rscd"
UNIT = read_unit(TOP / "deploy" / "systemd" / "robosc-bridge@.service")

pytestmark = pytest.mark.skipif(bool(why_not(wheels_of("bridge"))), reason=why_not(wheels_of("bridge")))


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Image:
    return build("bridge", wheels_of("bridge"), tmp_path_factory.mktemp("bridge"))


@pytest.fixture(scope="module")
def network() -> Iterator[Network]:
    with Network() as made:
        yield made


@pytest.fixture
def configuration(tmp_path: Path) -> Path:
    """Write a configuration like `init`, with an endpoint that other machines reach; its lines are not plugged in."""
    file = tmp_path / "robot.yaml"
    assert robosc_bridge(["init", "--model", str(MODEL), "-o", str(file)]) == 0
    text = file.read_text()
    for key, value in {
        "grpc_address": "0.0.0.0:50061",
        "tls_certificate": "/etc/robosc/tls/robot.crt",
        "tls_key": "/etc/robosc/tls/robot.key",
    }.items():
        assert f"\n  {key}: null\n" in text
        text = text.replace(f"\n  {key}: null\n", f"\n  {key}: {value}\n", 1)
    file.write_text(text)
    file.chmod(0o644)
    return file


@pytest.fixture
def tls(tmp_path: Path) -> Path:
    folder = tmp_path / "tls"
    folder.mkdir()
    _, key = Authority(folder).sign("robot")
    key.chmod(0o444)
    return folder


@pytest.mark.real_time
def test_the_container_answers_and_ends(
    image: Image, network: Network, configuration: Path, tls: Path, tmp_path: Path
) -> None:
    stage = image.stage
    start = Start(
        [*stage.words("ENTRYPOINT"), *stage.words("CMD")],
        user=image.user,
        files={
            "/etc/robosc/robot.yaml": configuration,
            "/etc/robosc/robot.rscd": MODEL,
            "/etc/robosc/tls": tls,
        },
        volumes={"/var/lib/robosc-bridge": tmp_path / "state"},
        folder="/var/lib/robosc-bridge",
    )
    with Container(image, start, network, tmp_path / "output") as container:
        container.wait_for(stage.health_check)
        assert container.run(["id", "-u"]).stdout == "10001\n"
        assert container.run(["touch", "/opt/robosc/mine"]).returncode != 0
        assert "Traceback" not in container.output
        assert container.stop(10) == 0, container.output


def test_the_unit_checks_answers_and_ends(
    image: Image, network: Network, configuration: Path, tls: Path, tmp_path: Path
) -> None:
    specifiers = {"%i": "burger", "%S": "/var/lib"}
    files = {
        "/etc/robosc/burger.yaml": configuration,
        "/etc/robosc/burger.rscd": MODEL,
        "/etc/robosc/tls": tls,
    }
    state = f"/var/lib/{UNIT.one('StateDirectory').replace('%i', 'burger')}"
    assert UNIT.one("WorkingDirectory").replace("%S", "/var/lib").replace("%i", "burger") == state

    def started(key: str) -> Start:
        return Start(
            UNIT.command(key, specifiers),
            UNIT.environment(specifiers),
            (61000, 61000),
            files,
            {state: tmp_path / "state"},
            folder=state,
        )

    with Container(image, started("ExecStartPre"), network, tmp_path / "checked") as checked:
        assert checked.wait(30) == 0, checked.output
    with Container(image, started("ExecStart"), network, tmp_path / "output") as container:
        container.wait_for(["robosc-bridge", "health", "--config", "/etc/robosc/burger.yaml", "--alive"])
        assert container.stop(float(UNIT.one("TimeoutStopSec"))) == 0, container.output
