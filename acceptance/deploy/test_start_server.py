"""The server's container, pod and unit: the commands that stand in their files, run as they would be.

Each answers its own health checks and a caller, cannot write where it should not, and ends within its time.
"""

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from robosc_api.security import Scope, make_token
from support.certificates import Authority
from support.containers import TOP, Container, Image, Network, Start, build, wheels_of, why_not
from support.manifests import container_of, has_kustomize, named, of_kind
from support.units import read_unit

UNIT = read_unit(TOP / "deploy" / "systemd" / "robosc-server.service")
ADDRESS = "localhost:50051"
DOCKER_GRACE_S = 10.0
"""Time that `docker stop` waits, in seconds, unless it is given another."""

CHECK = """
import sys
from pathlib import Path
from robosc.source import Bundle, SourceFile
from robosc_api.security import Credentials
from robosc_client import Client
address, ca, token = sys.argv[1:]
with Client(address, Credentials(ca=Path(ca), token_file=Path(token))) as client:
    findings = client.check(Bundle(SourceFile("robot.rscd", "robot Empty { component C { behaviour { } } "), ()))
assert findings and "robot.rscd" in str(findings[0]), findings
"""

pytestmark = pytest.mark.skipif(bool(why_not(wheels_of("server"))), reason=why_not(wheels_of("server")))


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Image:
    return build("server", wheels_of("server"), tmp_path_factory.mktemp("server"))


@pytest.fixture
def network() -> Iterator[Network]:
    with Network() as made:
        yield made


class Secrets:
    """Certificate, key and tokens of a server, and what a caller needs."""

    def __init__(self, folder: Path) -> None:
        authority = Authority(folder)
        self.ca = authority.file
        self.certificate, self.key = authority.sign("server")
        token, line = make_token("caller", (Scope.SYNTHESIZE,))
        self.tokens, self.token = folder / "tokens", folder / "token"
        self.tokens.write_text(line + "\n")
        self.token.write_text(token + "\n")
        self.token.chmod(0o600)

    def handed(self, user: int, places: Mapping[str, Path]) -> dict[str, Path]:
        """Files by their places, for one user alone."""
        for file in places.values():
            os.chown(file, user, user)
            file.chmod(0o400)
        return dict(places)


@pytest.fixture
def secrets(tmp_path: Path) -> Secrets:
    folder = tmp_path / "secrets"
    folder.mkdir()
    folder.chmod(0o755)
    return Secrets(folder)


def check(network: Network, secrets: Secrets) -> None:
    """Check a model over gRPC, as a caller elsewhere does."""
    command = [*network.entry, sys.executable, "-c", CHECK, ADDRESS, str(secrets.ca), str(secrets.token)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


def assert_confined(container: Container, state: str, user: int) -> None:
    """Check that it is nobody, may nothing, and writes only where its state is."""
    assert container.run(["id", "-u"]).stdout == f"{user}\n"
    status = container.run(["cat", "/proc/1/status"]).stdout
    assert "CapEff:\t0000000000000000" in status and "NoNewPrivs:\t1" in status
    for place in ("/", "/opt/robosc", "/etc", "/usr/local/lib", "/root"):
        assert container.run(["touch", f"{place}/mine"]).returncode != 0, place
    assert container.run(["touch", f"{state}/mine", "/tmp/mine"]).returncode == 0


@pytest.mark.real_time
def test_the_container_answers_and_ends(image: Image, network: Network, secrets: Secrets, tmp_path: Path) -> None:
    stage = image.stage
    start = Start(
        [*stage.words("ENTRYPOINT"), *stage.words("CMD")],
        {
            "ROBOSC_SERVER_TLS_CERTIFICATE": "/run/secrets/tls_certificate",
            "ROBOSC_SERVER_TLS_KEY": "/run/secrets/tls_key",
            "ROBOSC_SERVER_TOKENS": "/run/secrets/tokens",
        },
        image.user,
        secrets.handed(
            image.user[0],
            {
                "/run/secrets/tls_certificate": secrets.certificate,
                "/run/secrets/tls_key": secrets.key,
                "/run/secrets/tokens": secrets.tokens,
            },
        ),
        {"/var/lib/robosc": tmp_path / "state"},
        folder="/var/lib/robosc",
    )
    with Container(image, start, network, tmp_path / "output") as container:
        container.wait_for(stage.health_check)
        check(network, secrets)
        assert_confined(container, "/var/lib/robosc", image.user[0])
        assert container.stop(DOCKER_GRACE_S) == 0, container.output
    assert "Traceback" not in container.output and "warning" not in container.output.lower(), container.output


def test_without_tls_the_container_does_not_listen(image: Image, network: Network, tmp_path: Path) -> None:
    stage = image.stage
    start = Start(stage.words("ENTRYPOINT"), user=image.user, volumes={"/var/lib/robosc": tmp_path / "state"})
    with Container(image, start, network, tmp_path / "output") as container:
        assert container.wait(60) == 1
    assert "TLS" in container.output and "Traceback" not in container.output


def test_the_unit_checks_answers_and_ends(image: Image, network: Network, secrets: Secrets, tmp_path: Path) -> None:
    user, credentials = 61184, "/run/credentials/robosc-server.service"
    specifiers = {"%S": "/var/lib", "%d": credentials}
    sources = {"tls_certificate": secrets.certificate, "tls_key": secrets.key, "tokens": secrets.tokens}
    assert {text.partition(":")[0] for text in UNIT.all("LoadCredential")} == set(sources)
    settings = tmp_path / "server.toml"
    settings.write_text('host = "0.0.0.0"\nworker_processes = 1\n')
    state = f"/var/lib/{UNIT.one('StateDirectory')}"
    start = Start(
        UNIT.command("ExecStart", specifiers),
        UNIT.environment(specifiers),
        (user, user),
        {
            "/etc/robosc/server.toml": settings,
            **secrets.handed(user, {f"{credentials}/{name}": file for name, file in sources.items()}),
        },
        {state: tmp_path / "state"},
        folder=state,
        is_memory_sealed=UNIT.one("MemoryDenyWriteExecute") == "yes",
    )
    before = replace(start, command=UNIT.command("ExecStartPre", specifiers))
    with Container(image, before, network, tmp_path / "checked") as checked:
        assert checked.wait(60) == 0, checked.output
    with Container(image, start, network, tmp_path / "output") as container:
        container.wait_for(["robosc-server", "health"])
        check(network, secrets)
        assert_confined(container, state, user)
        assert container.stop(float(UNIT.one("TimeoutStopSec"))) == 0, container.output
    assert "Traceback" not in container.output, container.output


@pytest.mark.skipif(not has_kustomize(), reason="there is no kubectl, which knows Kustomize")
def test_the_pod_answers_its_probes_and_ends(image: Image, network: Network, secrets: Secrets, tmp_path: Path) -> None:
    pod = named("overlays/single", "Deployment", "robosc-server")["spec"]["template"]["spec"]
    security, specification = pod["securityContext"], container_of("overlays/single", "robosc-server")
    (config,) = of_kind("overlays/single", "ConfigMap")
    given = {
        "robosc-tls": {"tls.crt": secrets.certificate, "tls.key": secrets.key},
        "robosc-tokens": {"tokens": secrets.tokens},
    }
    files, volumes, temporary = {}, {}, []
    for mount in specification["volumeMounts"]:
        (volume,) = [item for item in pod["volumes"] if item["name"] == mount["name"]]
        place, folder = mount["mountPath"], tmp_path / mount["name"]
        folder.mkdir()
        if "configMap" in volume:
            assert volume["configMap"]["name"] == config["metadata"]["name"]
            (folder / mount["subPath"]).write_text(config["data"][mount["subPath"]])
            files[place] = folder / mount["subPath"]
        elif "secret" in volume:
            for key, file in given.pop(volume["secret"]["secretName"]).items():
                (folder / key).write_bytes(file.read_bytes())
                os.chown(folder / key, 0, security["fsGroup"])
                (folder / key).chmod(volume["secret"]["defaultMode"])
            files[place] = folder
        elif "persistentVolumeClaim" in volume:
            volumes[place] = folder
        else:
            temporary.append(place)
    assert not given
    start = Start(
        [*(specification.get("command") or image.stage.words("ENTRYPOINT")), *specification.get("args", ())],
        {item["name"]: item["value"] for item in specification["env"]},
        (security["runAsUser"], security["runAsGroup"]),
        files,
        volumes,
        temporary,
        folder="/var/lib/robosc",
    )
    with Container(image, start, network, tmp_path / "output") as container:
        for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
            container.wait_for(specification[probe]["exec"]["command"])
        check(network, secrets)
        assert_confined(container, "/var/lib/robosc", security["runAsUser"])
        assert container.run(specification["lifecycle"]["preStop"]["exec"]["command"]).returncode == 0
        assert container.stop(pod["terminationGracePeriodSeconds"]) == 0, container.output
    assert "Traceback" not in container.output, container.output
