"""Databases of earlier versions are migrated to this one, with what is in them, on PostgreSQL."""

import threading
from pathlib import Path

import psycopg
import pytest
from sqlalchemy import create_engine, make_url

from robosc_server.store import Store, StoreError, open_store
from robosc_server.store.inspection import inspect_postgresql
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
)


def make(url: str, version: int) -> None:
    with psycopg.connect(url) as connection:
        connection.execute(script_of(version, "postgresql").encode())


def test_new_tables_in_postgresql_are_those_that_the_server_takes_them_for(database_url: str, tmp_path: Path) -> None:
    store = open_store(tmp_path, database_url)
    assert read(store, differences) == []
    store.close()


@pytest.mark.parametrize("version", VERSIONS)
def test_each_version_in_postgresql_is_migrated_with_all_that_is_in_it(
    version: int, database_url: str, tmp_path: Path
) -> None:
    make(database_url, version)
    url = make_url(database_url)
    with psycopg.connect(database_url) as reader:
        # Reading needs no lock, as a change of these tables would.
        reader.execute("SELECT * FROM results")
        looking = url.update_query_dict({"options": "-c statement_timeout=5000"})
        assert inspect_postgresql(looking, 10.0)[1] == version
    engine = create_engine(url.set(drivername="postgresql+psycopg"))
    with engine.connect() as connection:
        before = rows_of(connection)
    engine.dispose()
    store = open_store(tmp_path, database_url)
    assert kept(before, read(store, rows_of)) == before
    assert read(store, differences) == []
    check(store)
    store.close()
    assert inspect_postgresql(url, 10.0)[1] == latest_version()


def test_of_many_servers_that_start_at_once_one_migrates(
    database_url: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    log_migrations(caplog)
    make(database_url, 1)
    stores: list[Store] = []
    begin = threading.Barrier(4)

    def start() -> None:
        begin.wait()
        stores.append(open_store(tmp_path, database_url))

    threads = [threading.Thread(target=start) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(migrations_in(caplog)) == 1
    assert len(stores) == 4
    for store in stores[1:]:
        store.close()
    check(stores[0])
    stores[0].close()


def test_newer_tables_in_postgresql_are_refused(database_url: str, tmp_path: Path) -> None:
    open_store(tmp_path, database_url).close()
    with psycopg.connect(database_url) as connection:
        connection.execute("UPDATE robosc_migrations SET version_num = '3'")
    with pytest.raises(StoreError, match="schema version 3, but this server supports version 2 and earlier"):
        open_store(tmp_path, database_url)
    with pytest.raises(StoreError, match="schema version 3"):
        inspect_postgresql(make_url(database_url), 10.0)
