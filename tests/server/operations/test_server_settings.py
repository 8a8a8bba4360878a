"""Tests of the sources of settings, and of the messages about wrong ones."""

from pathlib import Path

import pytest

from robosc_api.security import ServerSecurity
from robosc_server.operations.settings import Settings, default_text, description_of, format_value
from robosc_server.operations.settings_sources import (
    ENVIRONMENT_PREFIX,
    MAXIMUM_FILE_BYTES,
    SettingsError,
    flag_of,
    load_settings,
    read_file,
    variable_of,
)
from robosc_server.tasks.task import TaskLimits


@pytest.fixture(autouse=True)
def clean(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (*Settings.model_fields, "config"):
        monkeypatch.delenv(variable_of(name), raising=False)


def written(folder: Path, text: str) -> Path:
    file = folder / "server.toml"
    file.write_text(text)
    return file


def problems(capsys: pytest.CaptureFixture[str], *words: str) -> list[str]:
    with pytest.raises(SystemExit) as caught:
        load_settings(list(words))
    assert caught.value.code == 2
    return [line.removeprefix("robosc-server: ") for line in capsys.readouterr().err.splitlines()]


def test_a_flag_goes_before_the_environment_and_that_before_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = written(tmp_path, 'port = 1\nhost = "file"\nbundle_files = 7\nstate_dir = "/file"\n')
    monkeypatch.setenv("ROBOSC_SERVER_PORT", "2")
    monkeypatch.setenv("ROBOSC_SERVER_HOST", "environment")
    monkeypatch.setenv("ROBOSC_SERVER_STATE_DIR", "")
    settings = load_settings(["--config", str(file), "--port", "3"])
    assert (settings.port, settings.host, settings.bundle_files) == (3, "environment", 7)
    assert settings.state_dir == Path("/file")
    assert type(settings) is Settings
    monkeypatch.setenv("ROBOSC_SERVER_CONFIG", str(file))
    assert load_settings([]).bundle_files == 7


def test_made_from_its_fields_it_looks_nowhere_else(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROBOSC_SERVER_PORT", "2")
    assert Settings().port == 50051


def test_what_follows_from_settings() -> None:
    settings = Settings(host="::1", port=7, state_dir=Path("/state"), tls_key=Path("key"), task_seconds=3.0)
    assert settings.address == "[::1]:7"
    assert settings.security == ServerSecurity(key=Path("key"))
    assert settings.task_limits == TaskLimits(seconds=3.0)
    assert Settings().task_limits == TaskLimits()


@pytest.mark.parametrize(
    ("text", "number"), [("5", 5), ("5B", 5), ("64KiB", 2**16), ("3 MiB", 3 * 2**20), ("1GiB", 2**30)]
)
def test_sizes_may_have_a_unit(text: str, number: int) -> None:
    assert load_settings(["--result-bytes", text]).result_bytes == number


def test_flags_that_are_yes_or_no(tmp_path: Path) -> None:
    file = written(tmp_path, "insecure_beyond_loopback = true")
    assert load_settings(["--config", str(file)]).insecure_beyond_loopback
    assert not load_settings(["--config", str(file), "--no-insecure-beyond-loopback"]).insecure_beyond_loopback


def test_every_problem_is_reported_with_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = written(
        tmp_path,
        'port = "x"\nprot = 3\ntask_seconds = nan\nbundle_files = true\nworkers = "dask://"\nlog_format = "yaml"\n'
        'metrics_address = "nowhere"\ntls_key = 3\nwaiting_tasks = 2.0\n[part]\nport = 1\n',
    )
    monkeypatch.setenv("ROBOSC_SERVER_TASK_NODES", "-4")
    monkeypatch.setenv("ROBOSC_SERVER_UNKNOWN", "others may begin like this")
    found = problems(
        capsys, "--config", str(file), "--database-url", "secret", "--result-bytes", "3 apples", "--host", "a b"
    )
    assert set(found) == {
        f"{file}: port: must be a whole number",
        f"{file}: prot: unknown setting; `robosc-server example-config` lists all settings",
        f"{file}: part: unknown setting; `robosc-server example-config` lists all settings",
        f"{file}: task_seconds: must be a finite number",
        f"{file}: bundle_files: must be a whole number",
        f"{file}: waiting_tasks: must be a whole number",
        f"{file}: workers: must have HOST:PORT after ://",
        f"{file}: log_format: must be 'text' or 'json'",
        f"{file}: metrics_address: must be HOST:PORT",
        f"{file}: tls_key: must be a text",
        "$ROBOSC_SERVER_TASK_NODES: must be greater than or equal to 1",
        "--database-url: must be postgresql://USER:PASSWORD@HOST:PORT/NAME or sqlite:///FILE",
        "--result-bytes: must be a number of bytes, such as 1048576 or 1MiB",
        "--host: must be a host name or an address",
    }


@pytest.mark.parametrize(
    ("flag", "value"),
    [
        ("--port", "65536"),
        ("--port", "-1"),
        ("--task-seconds", "0"),
        ("--task-seconds", "inf"),
        ("--task-memory-bytes", "1MiB"),
        ("--worker-processes", "0"),
        ("--workers", "celery://x:1"),
        ("--tracing-endpoint", "localhost:4317"),
        ("--log-level", "trace"),
        ("--database-url", "sqlite://"),
        ("--database-url", "mysql://host/name"),
        ("--drain-seconds", "-1"),
        ("--result-bytes", "9" * 18),
    ],
)
def test_values_out_of_their_ranges(flag: str, value: str, capsys: pytest.CaptureFixture[str]) -> None:
    (problem,) = problems(capsys, f"{flag}={value}")
    assert problem.startswith(f"{flag}: ")


def test_files_that_are_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "No such file" in problems(capsys, "--config", str(tmp_path / "none"))[0]
    secret = written(tmp_path, 'database_url = "postgresql://u:password@h/n')
    (problem,) = problems(capsys, "--config", str(secret))
    assert problem.startswith(f"{secret}: not valid TOML")
    assert "password" not in problem
    (tmp_path / "server.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(SettingsError, match="not valid TOML"):
        read_file(secret)
    written(tmp_path, "#" * (MAXIMUM_FILE_BYTES + 1))
    with pytest.raises(SettingsError, match="larger than"):
        read_file(secret)
    written(tmp_path, "a = " + "[" * 100_000)
    with pytest.raises(SettingsError, match="not valid TOML"):
        read_file(secret)


def test_a_password_is_not_shown() -> None:
    assert "password" not in repr(Settings(database_url="postgresql://user:password@host/name"))


def test_every_setting_is_in_the_help(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        load_settings(["--help"])
    assert caught.value.code == 0
    text = " ".join(capsys.readouterr().out.split())
    assert text.startswith("usage: robosc-server [--config FILE] [SETTING ...] robosc-server COMMAND ... Check models")
    for name in Settings.model_fields:
        assert f" {flag_of(name)}" in text
        # Lines are folded at hyphens, too.
        wanted = f"{description_of(name)} (default: {default_text(name)})"
        assert wanted.replace(" ", "").replace("-", "") in text.replace(" ", "").replace("-", "")
        assert variable_of(name) == ENVIRONMENT_PREFIX + name.upper()


def test_defaults_in_words() -> None:
    assert default_text("bundle_bytes") == "1MiB"
    assert default_text("insecure_beyond_loopback") == "false"
    assert default_text("tls_key") == "none"
    assert format_value("task_seconds", 0.5) == "0.5"
    assert format_value("result_bytes", 1000) == "1000"
