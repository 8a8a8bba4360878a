"""`robosc-server check-config`, `example-config` and `token`."""

import contextlib
import errno
import json
import os
import re
import socket
import sqlite3
import tomllib
from pathlib import Path
from typing import Any

import pytest
from cryptography import x509
from sqlalchemy import create_engine, text

from robosc_api.security import Quota, Scope, TokenFile, make_token
from robosc_api.security.tokens import parse_tokens, read_time
from robosc_server.operations import config_check
from robosc_server.operations.commands import run_command
from robosc_server.operations.settings import Settings
from robosc_server.operations.settings_reference import example_file
from robosc_server.operations.settings_sources import settings_from, variable_of
from robosc_server.store import StoreError, open_store
from robosc_server.store.factory import DATABASE_FILE
from robosc_server.store.migrate import latest_version
from support.certificates import Authority
from support.earlier_databases import script_of
from support.held_store import held_store
from support.job_workers import StartedWorkers
from support.postgresql import postgresql
from support.service import served


@pytest.fixture(autouse=True)
def clean(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in (*Settings.model_fields, "config"):
        monkeypatch.delenv(variable_of(name), raising=False)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


class Checked:
    """Output of `check-config --json`."""

    def __init__(self, capsys: pytest.CaptureFixture[str], *words: str) -> None:
        self.status = run_command(["check-config", "--json", "--port", "0", *words])
        self.text = capsys.readouterr().out
        self.document: dict[str, Any] = json.loads(self.text)

    def of(self, part: str) -> list[tuple[str, str]]:
        return [(found["grade"], found["message"]) for found in self.document["findings"] if found["part"] == part]

    def grade(self, part: str) -> str:
        grades = [grade for grade, _ in self.of(part)]
        return max(grades, key=["ok", "warning", "error"].index)


def test_a_server_without_any_settings_could_start(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    checked = Checked(capsys)
    assert checked.status == 0
    assert checked.document["ok"] is True
    assert {found["part"] for found in checked.document["findings"]} == {
        "listening", "certificates", "tokens", "signing", "database", "workers", "confinement", "metrics", "tracing",
    }  # fmt: skip
    assert [grade for grade, _ in checked.of("listening")] == ["ok"]
    assert not (tmp_path / "robosc-server").exists(), "nothing is made"
    assert run_command(["check-config", "--port", "0"]) == 0
    assert re.search(r"^ok +certificates: no TLS$", capsys.readouterr().out, re.MULTILINE)


def test_where_each_value_comes_from(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "server.toml"
    file.write_text('task_nodes = 5\nretention_seconds = 60\ndatabase_url = "postgresql://u:password@127.0.0.1:1/n"\n')
    monkeypatch.setenv("ROBOSC_SERVER_RETENTION_SECONDS", "70")
    checked = Checked(capsys, "--config", str(file))
    settings = checked.document["settings"]
    assert settings["task_nodes"] == {"value": 5, "source": f"{file}: task_nodes", "default": "20000000"}
    assert settings["retention_seconds"]["value"] == 70
    assert settings["retention_seconds"]["source"] == "$ROBOSC_SERVER_RETENTION_SECONDS"
    assert settings["port"]["source"] == "--port"
    assert settings["host"]["source"] == "default"
    assert set(settings) == set(Settings.model_fields)
    assert checked.status == 1
    assert checked.grade("database") == "error"
    assert "password" not in checked.text


def test_wrong_settings(capsys: pytest.CaptureFixture[str]) -> None:
    checked = Checked(capsys, "--task-nodes", "0", "--workers", "x")
    assert checked.status == 2
    assert checked.document["ok"] is False
    assert len(checked.document["problems"]) == 2
    assert run_command(["check-config", "--task-nodes", "0"]) == 2
    assert "--task-nodes: must be" in capsys.readouterr().err


def test_certificates(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    authority = Authority(tmp_path)
    certificate, key = authority.sign("server", days=100)
    words = ["--tls-certificate", str(certificate), "--tls-key", str(key)]
    assert Checked(capsys, *words).grade("certificates") == "ok"
    assert Checked(capsys, *words[:2]).of("listening")[0][0] == "error"
    soon, soon_key = authority.sign("soon", days=3)
    assert Checked(capsys, words[0], str(soon), words[2], str(soon_key)).grade("certificates") == "warning"
    old, old_key = authority.sign("old", days=-1)
    checked = Checked(capsys, words[0], str(old), words[2], str(old_key))
    assert checked.status == 1
    ended = x509.load_pem_x509_certificate(old.read_bytes()).not_valid_after_utc
    assert f"{old}: expired at {ended:%Y-%m-%d}" in checked.of("certificates")[0][1]
    checked = Checked(capsys, *words[:3], str(soon_key))
    assert "cannot be used" in checked.of("certificates")[0][1]
    (tmp_path / "empty").touch()
    checked = Checked(capsys, *words, "--client-ca", str(tmp_path / "empty"))
    assert "no PEM certificates" in checked.of("certificates")[0][1]


def test_tokens(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "tokens"
    file.write_text(make_token("watcher", (Scope.WATCH,))[1])
    file.chmod(0o600)
    assert "every call is refused" in Checked(capsys, "--tokens", str(file)).of("tokens")[0][1]
    file.write_text(make_token("caller", (Scope.SYNTHESIZE,))[1])
    assert Checked(capsys, "--tokens", str(file)).grade("tokens") == "ok"
    file.write_text("wrong")
    assert Checked(capsys, "--tokens", str(file)).status == 1


def test_what_others_could_read_on_the_way(capsys: pytest.CaptureFixture[str]) -> None:
    cluster = Checked(capsys, "--workers", "dask://192.0.2.1:1")
    assert cluster.grade("workers") == "error"
    assert "insecure_workers_beyond_loopback" in cluster.of("workers")[0][1]
    far = Checked(
        capsys,
        "--database-url",
        "postgresql://u:p@nowhere.invalid:1/n",
        "--tracing-endpoint",
        "http://nowhere.invalid:1",
    )
    assert any("add ?sslmode" in message for _, message in far.of("database"))
    assert any("use https" in message for _, message in far.of("tracing"))
    sure = Checked(capsys, "--database-url", "postgresql://u:p@nowhere.invalid:1/n?sslmode=verify-full")
    assert not any("add ?sslmode" in message for _, message in sure.of("database"))
    near = Checked(capsys, "--database-url", "postgresql://u:p@127.0.0.1:1/n")
    assert not any("add ?sslmode" in message for _, message in near.of("database"))


def test_a_socket_and_the_number_of_connections(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert Checked(capsys, "--socket", str(tmp_path / "s")).of("listening") == [("ok", str(tmp_path / "s"))]
    assert Checked(capsys, "--socket", str(tmp_path / "none" / "s")).grade("listening") == "error"
    assert Checked(capsys, "--socket", str(tmp_path / ("s" * 200))).grade("listening") == "error"
    (tmp_path / "file").touch()
    ((grade, message),) = Checked(capsys, "--socket", str(tmp_path / "file")).of("listening")
    assert (grade, message.endswith("no socket: remove it, or choose another path")) == ("error", True)
    assert Checked(capsys, "--forwarded-identity").grade("listening") == "error"
    many = Checked(capsys, "--connections", "1000000000")
    assert "LimitNOFILE" in many.of("listening")[1][1]


def test_addresses(capsys: pytest.CaptureFixture[str]) -> None:
    assert "without TLS" in Checked(capsys, "--host", "0.0.0.0").of("listening")[0][1]
    open_to_all = Checked(capsys, "--host", "0.0.0.0", "--insecure-beyond-loopback")
    assert (open_to_all.status, open_to_all.grade("listening")) == (0, "warning")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        checked = Checked(capsys, "--port", str(port), "--metrics-address", f"127.0.0.1:{port}")
        assert (checked.status, checked.grade("listening"), checked.grade("metrics")) == (0, "warning", "warning")
    assert Checked(capsys, "--host", "192.0.2.1", "--insecure-beyond-loopback").status == 1
    assert Checked(capsys, "--metrics-address", "0.0.0.0:0").status == 1
    assert Checked(capsys, "--metrics-address", "0.0.0.0:0", "--metrics-beyond-loopback").status == 0


def test_who_is_asked_beside(capsys: pytest.CaptureFixture[str]) -> None:
    assert Checked(capsys, "--workers", "dask://127.0.0.1:1").grade("workers") == "error"
    assert Checked(capsys, "--tracing-endpoint", "http://127.0.0.1:1").grade("tracing") == "warning"
    with socket.create_server(("127.0.0.1", 0)) as there:
        port = there.getsockname()[1]
        assert Checked(capsys, "--workers", f"dask://127.0.0.1:{port}").grade("workers") == "ok"
        assert Checked(capsys, "--tracing-endpoint", f"http://127.0.0.1:{port}").grade("tracing") == "ok"
    assert Checked(capsys, "--worker-processes", "1000", "--task-memory-bytes", "1TiB").grade("workers") == "warning"


def test_the_state_folder(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    assert Checked(capsys, "--state-dir", str(file)).status == 1
    assert Checked(capsys, "--state-dir", str(file / "below")).status == 1
    state = tmp_path / "state"
    state.mkdir()
    (state / DATABASE_FILE).write_bytes(b"no database at all, and long enough for somebody to look" * 100)
    assert "not a database" in Checked(capsys, "--state-dir", str(state)).of("database")[0][1]
    (state / DATABASE_FILE).unlink()
    sqlite3.connect(state / DATABASE_FILE).close()
    assert Checked(capsys, "--state-dir", str(state)).status == 0
    if os.getuid() != 0:
        state.chmod(0o500)
        assert Checked(capsys, "--state-dir", str(state)).status == 1


def folder_state(folder: Path) -> dict[str, bytes]:
    """Return the files in a folder; of what is shared by those who have a database open, the name alone."""
    return {path.name: b"" if path.name.endswith("-shm") else path.read_bytes() for path in folder.iterdir()}


def test_tables_of_another_version_are_reported_and_nothing_is_left_behind(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    state = tmp_path / "a state"

    def found() -> list[tuple[str, str]]:
        before = folder_state(state)
        findings = Checked(capsys, "--state-dir", str(state)).of("database")
        assert folder_state(state) == before
        return findings

    store = open_store(state)
    open_now = found()
    store.close()
    assert open_now == [("warning", f"{state / DATABASE_FILE} is in use by another robosc-server")]
    assert found() == [("ok", f"SQLite in {state / DATABASE_FILE}")]
    newer = "UPDATE robosc_migrations SET version_num = '999'"
    # The newer version stands in the log of changes, which a server that was killed leaves, and later in the file
    # itself.
    with contextlib.closing(sqlite3.connect(state / DATABASE_FILE)) as connection:
        connection.execute(newer)
        connection.commit()
        assert (state / f"{DATABASE_FILE}-wal").stat().st_size
        in_log = found()
    in_file = found()
    assert in_log == in_file
    (grade, message), *others = in_file
    assert (grade, others) == ("error", [])
    with pytest.raises(StoreError) as refused:
        open_store(state)
    assert message.removeprefix(f"{state / DATABASE_FILE}: ") in str(refused.value)
    assert f"version 999, but this server supports version {latest_version()} and earlier" in message


def test_a_migration_is_announced(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    with contextlib.closing(sqlite3.connect(tmp_path / DATABASE_FILE)) as connection:
        connection.executescript(script_of(1, "sqlite"))
    migration = f"; the next start migrates the tables from schema version 1 to {latest_version()}"
    found = Checked(capsys, "--state-dir", str(tmp_path)).of("database")
    assert found == [("ok", f"SQLite in {tmp_path / DATABASE_FILE}{migration}")]
    open_store(tmp_path).close()
    assert Checked(capsys, "--state-dir", str(tmp_path)).of("database") == [("ok", found[0][1].removesuffix(migration))]


def test_a_database_that_a_running_server_has(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    state = tmp_path / "state"
    link = tmp_path / "link"
    link.symlink_to(state)
    in_use = f"{DATABASE_FILE} is in use by another robosc-server"
    with held_store(state) as outcome:
        assert outcome == "open"
        before = {path.name for path in state.iterdir()}
        for place in (state, link):
            checked = Checked(capsys, "--state-dir", str(place))
            assert (checked.status, checked.of("database")) == (0, [("warning", f"{place}/{in_use}")])
        checked = Checked(capsys, "--database-url", f"sqlite:///{state / DATABASE_FILE}")
        assert checked.grade("database") == "warning"
        assert {path.name for path in state.iterdir()} == before
        # It has kept its lock to the end.
        with pytest.raises(StoreError, match="in use by another robosc-server"):
            open_store(state)
    before = {path.name for path in state.iterdir()}
    assert Checked(capsys, "--state-dir", str(state)).grade("database") == "ok"
    assert {path.name for path in state.iterdir()} == before


def test_a_look_at_a_database_of_this_process_leaves_it_the_lock(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    store = open_store(tmp_path)
    assert Checked(capsys, "--state-dir", str(tmp_path)).grade("database") == "warning"
    try:
        with held_store(tmp_path) as outcome:
            assert outcome.endswith("is in use by another robosc-server")
    finally:
        store.close()


@pytest.mark.parametrize("place", ["/proc/nothing", "/proc", "/sys/nothing/below"])
def test_a_folder_that_not_even_root_can_make(place: str, capsys: pytest.CaptureFixture[str]) -> None:
    checked = Checked(capsys, "--state-dir", place)
    assert (checked.status, checked.grade("database")) == (1, "error")
    assert "cannot be written" in checked.of("database")[0][1]


def test_that_a_folder_can_be_written_is_found_without_a_trace(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also on file systems that have no files without a name."""
    before = tmp_path.stat().st_mtime_ns
    assert Checked(capsys, "--state-dir", str(tmp_path / "a" / "b")).grade("database") == "ok"
    assert tmp_path.stat().st_mtime_ns == before

    def without(path: Any, flags: int, *more: Any, **named: Any) -> int:
        if flags & os.O_TMPFILE == os.O_TMPFILE:
            raise OSError(errno.EOPNOTSUPP, os.strerror(errno.EOPNOTSUPP))
        return opened(path, flags, *more, **named)

    opened = os.open
    monkeypatch.setattr(os, "open", without)
    assert Checked(capsys, "--state-dir", str(tmp_path / "a" / "b")).grade("database") == "ok"
    assert list(tmp_path.iterdir()) == []
    assert Checked(capsys, "--state-dir", "/proc/nothing").grade("database") == "error"


def test_tables_of_another_version_in_postgresql(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    with postgresql() as server:
        url = server.new_database()
        assert Checked(capsys, "--database-url", url).of("database")[0][0] == "ok"
        open_store(tmp_path, url).close()
        ((grade, message),) = Checked(capsys, "--database-url", url).of("database")
        assert (grade, "PostgreSQL" in message) == ("ok", True)
        engine = create_engine(url.replace("postgresql://", "postgresql+psycopg://"))
        with engine.begin() as connection:
            connection.execute(text("UPDATE robosc_migrations SET version_num = '999'"))
        engine.dispose()
        ((grade, message),) = Checked(capsys, "--database-url", url).of("database")
        assert grade == "error"
        assert f"version 999, but this server supports version {latest_version()} and earlier" in message
        assert Checked(capsys, "--database-url", url.replace("test0", "nowhere")).grade("database") == "error"


def test_a_signing_key(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "key"
    assert Checked(capsys, "--signing-key", str(file)).status == 1
    file.write_text("no key")
    assert Checked(capsys, "--signing-key", str(file)).status == 1


def test_the_example_holds_every_setting_with_its_default(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["example-config"]) == 0
    text = capsys.readouterr().out
    assert text == example_file()
    assert tomllib.loads(text) == {}
    file = tmp_path / "server.toml"
    file.write_text(re.sub(r"^#(?=[a-z])", "", text, flags=re.MULTILINE))
    assert list(tomllib.loads(file.read_text())) == list(Settings.model_fields)
    settings = settings_from({}, file)
    for name, field in Settings.model_fields.items():
        if field.default is not None and field.default_factory is None:
            assert getattr(settings, name) == field.default, name


def test_a_token_with_quotas(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["token", "laptop", "--scope", "synthesize", "--scope", "admin", "--per-minute", "60"]) == 0
    captured = capsys.readouterr()
    (entry,) = parse_tokens(captured.err.splitlines()[-1], "line")
    assert captured.out.startswith("robosc_")
    assert (entry.scopes, entry.quota) == (frozenset({Scope.SYNTHESIZE, Scope.ADMIN}), Quota(per_minute=60))
    assert run_command(["token", "not a name"]) == 2


@pytest.mark.parametrize(
    ("scopes", "is_reported"),
    [
        ([], False),
        (["synthesize"], False),
        (["admin", "synthesize"], False),
        (["admin"], True),
        (["watch"], True),
        (["watch", "operate"], True),
    ],
)
def test_a_token_with_which_nothing_can_be_called(
    scopes: list[str], is_reported: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command(["token", "laptop", *(word for scope in scopes for word in ("--scope", scope))]) == 0
    captured = capsys.readouterr()
    assert captured.out.startswith("robosc_")
    assert captured.out.count("\n") == 1
    assert ("cannot be used with this server: it lacks the scope 'synthesize'" in captured.err) is is_reported
    assert parse_tokens(captured.err.splitlines()[-1], "line")


def test_the_help_says_what_each_scope_is_for(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        run_command(["token", "--help"])
    help_text = " ".join(capsys.readouterr().out.split())
    for scope in Scope:
        assert re.search(rf"{scope}(, besides synthesize)?: [a-z]", help_text), scope


def test_a_server_that_lets_nobody_in_says_so(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    file = tmp_path / "tokens"
    file.write_text(make_token("watcher", (Scope.WATCH, Scope.ADMIN))[1])
    file.chmod(0o600)
    words = f"{file}: no valid token has the scope 'synthesize', so every call is refused"
    with served(given_workers=StartedWorkers(), tokens=file):
        pass
    assert caplog.text.count(words) == 1


def test_tokens_that_expire_are_reported(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s = read_time("2026-11-26T12:00:00Z")
    monkeypatch.setattr(config_check, "wall_clock_s", lambda: float(now_s))
    file = tmp_path / "tokens"
    days = {"past": -1, "soon": 13, "later": 15, "rotated": 2}
    lines = [make_token(name, (Scope.SYNTHESIZE,), expires_s=now_s + 86400 * day)[1] for name, day in days.items()]
    file.write_text("\n".join([*lines, make_token("rotated", (Scope.SYNTHESIZE,))[1]]))
    file.chmod(0o600)
    past, soon, _, rotated = (line.partition("sha256:")[2][:8] for line in lines)
    assert Checked(capsys, "--tokens", str(file)).of("tokens") == [
        ("ok", f"{file}: tokens with the scope 'synthesize': 4"),
        (
            "warning",
            f"{file}: the token {past} of 'past' has expired at 2026-11-25T12:00:00Z: robosc-server tokens rotate "
            f"{file} past",
        ),
        (
            "warning",
            f"{file}: the token {soon} of 'soon' expires at 2026-12-09T12:00:00Z: robosc-server tokens rotate {file} "
            "soon",
        ),
        ("ok", f"{file}: the token {rotated} of 'rotated' expires at 2026-11-28T12:00:00Z; another one replaces it"),
    ]
    file.write_text(lines[0])
    ((grade, message), _) = Checked(capsys, "--tokens", str(file)).of("tokens")
    assert (grade, message) == (
        "warning",
        f"{file}: no valid token has the scope 'synthesize', so every call is refused",
    )


def test_the_token_file_is_kept_by_commands(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "tokens"
    assert run_command(["tokens", "add", str(file), "laptop", "--calls", "3", "--json"]) == 0
    made = json.loads(capsys.readouterr().out)
    entry = TokenFile(file).find(made["token"])
    assert entry is not None and entry.scopes == {Scope.SYNTHESIZE} and entry.quota == Quota(calls=3)
    assert run_command(["tokens", "revoke", str(file), "nobody", "--json"]) == 2
    message = f"{file}: no token with the name or id 'nobody'"
    found = capsys.readouterr()
    assert json.loads(found.out) == {"error": {"status": 2, "message": message}}
    assert found.err == f"robosc-server: {message}\n"
    with pytest.raises(SystemExit) as caught:
        run_command(["tokens", "list", "--json"])
    assert caught.value.code == 2
    assert json.loads(capsys.readouterr().out)["error"]["status"] == 2


def test_what_is_no_command_means_to_serve() -> None:
    assert run_command([]) is None
    assert run_command(["--port", "0"]) is None
