"""Databases of earlier versions are migrated to this one, with what is in them."""

import sqlite3
import threading
from pathlib import Path

import pytest
from sqlalchemy import create_engine

from robosc_server.store import StoreError, open_store
from robosc_server.store.inspection import inspect_sqlite
from robosc_server.store.migrate import latest_version
from support.earlier_databases import (
    VERSIONS,
    check,
    differences,
    kept,
    log_migrations,
    migrations_in,
    read,
    rows_of,
    script_of,
    structure_of,
)


def made(folder: Path, version: int) -> Path:
    folder.mkdir(exist_ok=True)
    file = folder / "jobs.sqlite"
    with sqlite3.connect(file) as connection:
        connection.executescript(script_of(version, "sqlite"))
    connection.close()
    return file


def test_new_tables_are_those_that_the_server_takes_them_for(tmp_path: Path) -> None:
    store = open_store(tmp_path)
    assert read(store, differences) == []
    store.close()


@pytest.mark.parametrize("version", VERSIONS)
def test_each_version_is_migrated_with_all_that_is_in_it(
    version: int, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    log_migrations(caplog)
    file = made(tmp_path / "old", version)
    # Reading changes nothing.
    content = file.read_bytes()
    assert inspect_sqlite(file) == version
    assert file.read_bytes() == content
    engine = create_engine(f"sqlite:///{file}")
    with engine.connect() as connection:
        before = rows_of(connection)
    engine.dispose()
    assert all(before.values())
    latest = latest_version()
    expected = [f"the database is migrated from schema version {version} to {latest}"] if version < latest else []
    for lines in (expected, []):  # The second time there is nothing left to do.
        old, new = open_store(tmp_path / "old"), open_store(tmp_path / "new")
        assert migrations_in(caplog) == lines
        assert kept(before, read(old, rows_of)) == before
        assert read(old, structure_of) == read(new, structure_of)
        assert read(old, differences) == []
        new.close()
        old.close()
    assert inspect_sqlite(file) == latest
    old = open_store(tmp_path / "old")
    check(old)
    old.close()


def test_a_migration_that_fails_changes_nothing(tmp_path: Path) -> None:
    file = made(tmp_path, 1)
    with sqlite3.connect(file) as connection:
        # The last statement of a migration fails.
        connection.execute("CREATE INDEX jobs_ended ON jobs (ended_us)")
    connection.close()
    for _ in range(2):
        with pytest.raises(StoreError, match="index jobs_ended already exists"):
            open_store(tmp_path)
        assert inspect_sqlite(file) == 1
    with sqlite3.connect(file) as connection:
        assert "owner" not in {row[1] for row in connection.execute("PRAGMA table_info(results)")}
        connection.execute("DROP INDEX jobs_ended")
    connection.close()
    store = open_store(tmp_path)
    check(store)
    store.close()


def test_of_two_servers_that_start_at_once_one_migrates_and_the_other_is_refused(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    log_migrations(caplog)
    made(tmp_path, 1)
    begin, ended = threading.Barrier(2), threading.Barrier(2)
    outcomes: list[str] = []

    def start() -> None:
        begin.wait()
        try:
            store = open_store(tmp_path)
        except StoreError as error:
            outcomes.append(str(error))
            ended.wait()
        else:
            outcomes.append("")
            ended.wait()
            store.close()

    threads = [threading.Thread(target=start) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(outcomes)[0] == ""
    assert "in use by another robosc-server" in sorted(outcomes)[1]
    assert len(migrations_in(caplog)) == 1


@pytest.mark.parametrize(
    ("statement", "found"),
    [
        ("UPDATE robosc_migrations SET version_num = '3'", "3"),
        ("UPDATE robosc_migrations SET version_num = 'ae1027a6'", "ae1027a6"),
        ("INSERT INTO robosc_migrations VALUES ('1')", "unknown"),
        ("DROP TABLE robosc_migrations; UPDATE robosc_schema SET version = 3", "3"),
    ],
)
def test_newer_tables_are_refused_and_not_changed(statement: str, found: str, tmp_path: Path) -> None:
    open_store(tmp_path).close()
    file = tmp_path / "jobs.sqlite"
    with sqlite3.connect(file) as connection:
        connection.executescript(statement)
        before = list(connection.iterdump())
    connection.close()
    message = f"schema version {found}, but this server supports version {latest_version()} and earlier"
    with pytest.raises(StoreError, match=message):
        open_store(tmp_path)
    with sqlite3.connect(file) as connection:
        assert list(connection.iterdump()) == before
    connection.close()


def test_servers_from_before_the_migrations_see_the_version(tmp_path: Path) -> None:
    made(tmp_path, 1)
    open_store(tmp_path).close()
    with sqlite3.connect(tmp_path / "jobs.sqlite") as connection:
        assert connection.execute("SELECT version FROM robosc_schema").fetchall() == [(latest_version(),)]
    connection.close()
