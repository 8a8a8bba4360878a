"""Dockerfiles, the file of compose and the locks of the images, looked at by linters and by rules of our own."""

import os
import re
import runpy
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml
from cryptography.hazmat.primitives.serialization import load_pem_private_key
from cryptography.x509 import load_pem_x509_certificate

from robosc_server.operations.settings import Settings
from robosc_server.operations.settings_sources import settings_from
from robosc_server.operations.shutdown import END_S
from support.checkers import checked
from support.containers import IMAGES, TOP
from support.dockerfiles import Ignored, Stage, context_files, parse_dockerfile

DOCKERFILES = sorted(IMAGES.glob("*.Dockerfile"))
COMPOSE = TOP / "deploy" / "compose"
SERVER_SECRETS = {"tls_certificate", "tls_key", "tokens", "database_login"}
"""Secrets that the server of compose reads."""


@pytest.fixture(scope="module")
def compose() -> dict[str, Any]:
    return dict(yaml.safe_load((COMPOSE / "compose.yaml").read_text()))


@pytest.mark.parametrize("file", DOCKERFILES, ids=lambda file: file.stem)
def test_hadolint_finds_nothing(file: Path) -> None:
    checked("hadolint", "--no-color", file)


def test_hadolint_would_find_something(tmp_path: Path) -> None:
    file = tmp_path / "Dockerfile"
    file.write_text("FROM python:latest\nRUN cd /tmp && pip install robosc\n")
    with pytest.raises(AssertionError, match=r"(?s)DL3007.*DL3003"):
        checked("hadolint", "--no-color", file)


@pytest.mark.parametrize("file", DOCKERFILES, ids=lambda file: file.stem)
def test_an_image_is_as_it_should_be(file: Path) -> None:
    stages = parse_dockerfile(file.read_text())
    last = stages[-1]
    # The stage that builds has a compiler; the image is the same system without one.
    assert len(stages) == 2 and stages[0].base == last.base.replace("-slim", "")
    # A version of the base in full, not whatever is the latest.
    assert re.fullmatch(r"docker\.io/library/python:3\.12\.\d+-slim-\w+", last.base)
    # Not root, and a number, which Kubernetes can judge.
    assert last.instructions.index(last.last("USER")) < last.instructions.index(last.last("ENTRYPOINT"))  # type: ignore[arg-type]
    assert re.fullmatch(r"[1-9]\d{4,}:[1-9]\d{4,}", last.last("USER").text)  # type: ignore[union-attr]
    # No shell stands between the engine's signals and the program, or a health check and its answer.
    assert last.words("ENTRYPOINT") and last.health_check[1] == "health"
    assert [item.text for item in last.all("STOPSIGNAL")] == ["SIGTERM"]
    # Tools that build it are not in it.
    assert [(item.flags, item.text) for item in last.all("COPY")] == [({"from": "build"}, "/opt/robosc /opt/robosc")]
    (volume,) = last.last("VOLUME").words  # type: ignore[union-attr]
    assert last.last("WORKDIR").text == volume  # type: ignore[union-attr]
    assert any(f"-m 0700 {volume}" in item.text for item in last.all("RUN"))


def test_only_what_an_image_needs_is_sent_to_its_build() -> None:
    ignored = Ignored((TOP / ".dockerignore").read_text())
    for secret in (
        ".git/config",
        "deploy/compose/secrets/server/tls_key",
        ".venv/bin/python",
        "tests/conftest.py",
        "out/a",
    ):
        assert secret in ignored, secret
    assert "robosc/__pycache__/errors.pyc" in ignored
    for needed in ("pyproject.toml", "robosc/errors.py", "proto/robosc_api/v1/jobs_pb2.py", "robosc/py.typed"):
        assert needed not in ignored, needed
    for file in DOCKERFILES:
        for item in parse_dockerfile(file.read_text())[0].all("COPY"):
            for source in item.text.split()[:-1]:
                assert any(context_files(TOP, [source], ignored)), source


def test_the_wheel_has_all_that_the_images_copy_for_it() -> None:
    packages = tomllib.loads((TOP / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"][
        "packages"
    ]
    for file in DOCKERFILES:
        copied = [item.text.split()[0] for item in parse_dockerfile(file.read_text())[0].all("COPY")]
        assert all(any(package == one or package.startswith(f"{one}/") for one in copied) for package in packages)


def test_the_locks_of_the_images_are_lines_of_the_lock() -> None:
    program = runpy.run_path(str(TOP / "deploy" / "lock_images.py"))
    entries = program["locked"]((TOP / "requirements.lock").read_text())
    for name, needed in program["wanted"]().items():
        lock = program["locked"]((TOP / "deploy" / f"requirements-{name}.txt").read_text())
        assert lock == {package: entries[package] for package in needed}, f"{name}: python deploy/lock_images.py"


def test_the_lock_of_some_extras_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    program = runpy.run_path(str(TOP / "deploy" / "lock_images.py"))
    assert program["main"](["bridge", "view"]) == 0
    assert program["locked"](capsys.readouterr().out) == program["locked"](
        (TOP / "deploy" / "requirements-bridge.txt").read_text()
    )
    with pytest.raises(KeyError):
        program["main"](["nonsense"])


def test_what_a_dockerfile_says_is_read() -> None:
    (stage,) = parse_dockerfile(
        'ARG A=b:1\nFROM ${A} AS one\n# no\nENV X=1 \\\n    Y=$X/2\nHEALTHCHECK --interval=3s CMD ["a", "b"]\n'
    )
    assert (stage.base, stage.name) == ("b:1", "one")
    assert stage.environment({}) == {"X": "1", "Y": "1/2"}
    assert stage.health_check == ["a", "b"]
    assert stage.last("HEALTHCHECK").flags == {"interval": "3s"}  # type: ignore[union-attr]
    assert Stage("", "").words("CMD") == []


def test_the_compose_file_fits_its_schema(tmp_path: Path) -> None:
    checked("check-jsonschema", "--builtin-schema", "vendor.compose-spec", COMPOSE / "compose.yaml")
    wrong = tmp_path / "compose.yaml"
    wrong.write_text("services: {server: {imag: robosc-server}}\n")
    with pytest.raises(AssertionError, match="imag"):
        checked("check-jsonschema", "--builtin-schema", "vendor.compose-spec", wrong)


def test_yamllint_finds_nothing() -> None:
    rules = "{extends: default, rules: {line-length: {max: 120}, document-start: disable, braces: {forbid: false}}}"
    checked("yamllint", "--strict", "-d", rules, "deploy")


def test_every_service_of_compose_is_confined(compose: dict[str, Any]) -> None:
    for name, service in compose["services"].items():
        assert service["read_only"] is True, name
        assert service["cap_drop"] == ["ALL"] and service["security_opt"] == ["no-new-privileges:true"], name
        assert {"mem_limit", "pids_limit", "stop_grace_period", "restart"} <= set(service), name
        assert "privileged" not in service and "latest" not in service["image"], name
        # The image's own, or one that is written here.
        assert name == "server" or service["healthcheck"]["test"][0] == "CMD", name
        assert set(service.get("secrets", ())) <= set(compose["secrets"]), name
        assert set(service["networks"]) <= set(compose["networks"]), name
    # Only the server is reached from outside.
    assert [name for name, service in compose["services"].items() if "ports" in service] == ["server"]
    assert [name for name, service in compose["services"].items() if "outside" in service["networks"]] == ["server"]
    assert compose["networks"]["inside"] == {"internal": True}


def test_the_settings_of_compose_can_be_used(compose: dict[str, Any]) -> None:
    settings = settings_from({}, COMPOSE / "server.toml")
    server = compose["services"]["server"]
    # A folder as a whole: a file of it that is replaced by another one is seen.
    (mounted,) = [item for item in server["volumes"] if isinstance(item, dict)]
    assert (mounted["source"], mounted["read_only"], mounted["bind"]) == (
        "./secrets/server",
        True,
        {"create_host_path": False},
    )
    secrets = {f"{mounted['target']}/{name}" for name in SERVER_SECRETS}
    assert "secrets" not in server
    assert {str(settings.tls_certificate), str(settings.tls_key), str(settings.tokens)} <= secrets
    assert settings.database_url is not None
    host, _, passfile = settings.database_url.partition("@")[2].partition("/robosc?passfile=")
    assert host in compose["services"] and passfile in secrets
    assert settings.workers == f"dask://{compose['services']['worker']['command'][0].removeprefix('tcp://')}"
    assert compose["services"]["server"]["ports"][0].endswith(f":{settings.port}")
    assert _seconds(server["stop_grace_period"]) > settings.drain_seconds + END_S
    threads = int(_after(compose["services"]["worker"]["command"], "--nthreads"))
    memory = int(compose["services"]["worker"]["mem_limit"].removesuffix("g")) * 2**30
    assert threads * settings.task_memory_bytes < memory


def test_the_secrets_of_compose_are_made_and_kept(compose: dict[str, Any], tmp_path: Path) -> None:
    from robosc_api.security.tokens import parse_tokens

    folder = tmp_path / "secrets"
    command = ["sh", str(COMPOSE / "make_secrets.sh"), "server.example.org", str(folder)]
    subprocess.run(command, check=True, capture_output=True)
    before = _contents(folder)
    handed = {f"server/{name}" for name in SERVER_SECRETS}
    handed |= {secret["file"].removeprefix("secrets/") for secret in compose["secrets"].values()}
    # Neither container sees the token itself.
    own = {"first_token", "callers_ca.key", "first_caller.crt", "first_caller.key"}
    assert set(before) == handed | {"callers/ca.crt"} | own
    assert all(file.stat().st_mode & 0o077 == 0 for file in folder.rglob("*"))
    (entry,) = parse_tokens(before["server/tokens"].decode(), "tokens")
    assert entry.name == "first"
    assert before["server/database_login"].decode().strip().endswith(":" + before["database_password"].decode())
    if os.geteuid() == 0:
        given = (*handed, "server", "callers", "callers/ca.crt")
        assert {folder.joinpath(name).stat().st_uid for name in given} == {10001}
        assert {folder.joinpath(name).stat().st_uid for name in own} == {0}
    subprocess.run(command, check=True, capture_output=True)
    assert _contents(folder) == before
    wrong = subprocess.run(["sh", str(COMPOSE / "make_secrets.sh"), "a b"], capture_output=True, text=True)
    assert (wrong.returncode, wrong.stderr) == (2, "make_secrets.sh: 'a b' is not a name or address of a machine\n")


class _Overrides(yaml.SafeLoader):  # type: ignore[misc]  # untyped
    """Reader of a file of compose that adds to another one, with the tags that Docker reads there."""


_Overrides.add_constructor("!override", lambda loader, node: loader.construct_sequence(node, deep=True))
_Overrides.add_constructor("!reset", lambda loader, node: loader.construct_sequence(node, deep=True))


@pytest.fixture(scope="module")
def with_envoy(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Content of the file that puts Envoy in front of the server."""
    found: dict[str, Any] = yaml.load((COMPOSE / "envoy.yaml").read_text(), _Overrides)
    return found


def test_compose_with_envoy_fits_its_schema(with_envoy: dict[str, Any], tmp_path: Path) -> None:
    file = tmp_path / "envoy.yaml"
    file.write_text(yaml.safe_dump(with_envoy))
    checked("check-jsonschema", "--builtin-schema", "vendor.compose-spec", file)


def test_only_envoy_is_reached_from_outside(compose: dict[str, Any], with_envoy: dict[str, Any]) -> None:
    server, envoy = with_envoy["services"]["server"], with_envoy["services"]["envoy"]
    assert server["ports"] == [] and server["networks"] == ["inside"]
    assert envoy["networks"] == ["outside"] and len(envoy["ports"]) == 1
    assert envoy["read_only"] is True and envoy["cap_drop"] == ["ALL"]
    assert envoy["security_opt"] == ["no-new-privileges:true"]
    assert {"mem_limit", "pids_limit", "restart", "logging"} <= set(envoy) and "latest" not in envoy["image"]
    assert _seconds(envoy["stop_grace_period"]) > 30
    # The socket has the user of both.
    assert (
        envoy["user"] == "10001:10001" and "uid=10001,gid=10001" in with_envoy["volumes"]["socket"]["driver_opts"]["o"]
    )
    assert "socket:/run/robosc" in envoy["volumes"] and server["volumes"] == ["socket:/run/robosc"]
    assert set(compose["services"]) & set(with_envoy["services"]) == {"server"}


def test_envoy_of_compose_starts_with_the_secrets_that_are_made(with_envoy: dict[str, Any], tmp_path: Path) -> None:
    secrets = tmp_path / "secrets"
    command = ["sh", str(COMPOSE / "make_secrets.sh"), "localhost", str(secrets)]
    subprocess.run(command, check=True, capture_output=True)
    places = {}
    for mount in with_envoy["services"]["envoy"]["volumes"]:
        source, target, *_ = mount.split(":")
        places[target] = tmp_path / source if source.startswith("./secrets") else COMPOSE / source
    text = places.pop("/etc/envoy/envoy.yaml").read_text()
    for target, source in places.items():
        assert source.exists() or target == "/run/robosc", source
        text = text.replace(target, str(source))
    file = tmp_path / "mtls.yaml"
    file.write_text(text)
    checked("envoy", "--mode", "validate", "-c", file)
    # The first caller is one of those whom Envoy lets through, and no authority.
    verify = ["openssl", "verify", "-purpose", "sslclient", "-CAfile", "callers/ca.crt", "first_caller.crt"]
    done = subprocess.run(verify, cwd=secrets, capture_output=True, text=True, check=False)
    assert done.stdout == "first_caller.crt: OK\n", done.stderr
    certificate = load_pem_x509_certificate((secrets / "first_caller.crt").read_bytes())
    key = load_pem_private_key((secrets / "first_caller.key").read_bytes(), None)
    assert key.public_key() == certificate.public_key()
    assert certificate.subject.rfc4514_string() == "CN=first"


def test_variables_of_the_images_are_settings() -> None:
    for file in DOCKERFILES:
        names = parse_dockerfile(file.read_text())[-1].environment({"PATH": ""})
        for name in names:
            if name.startswith("ROBOSC_SERVER_"):
                assert name.removeprefix("ROBOSC_SERVER_").lower() in Settings.model_fields, name


def _contents(folder: Path) -> dict[str, bytes]:
    return {file.relative_to(folder).as_posix(): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


def _seconds(text: str) -> float:
    return float(text.removesuffix("s"))


def _after(words: list[str], flag: str) -> str:
    return words[words.index(flag) + 1]
