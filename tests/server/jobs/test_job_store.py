"""The database itself: opening, refusing, surviving."""

import asyncio
import os
import sqlite3
import stat
import threading
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import Connection, text

from robosc_server.store import Store, StoreError, StoreUnavailableError, open_store
from robosc_server.store.records import blocks_of, messages_of
from support.held_store import held_store
from support.held_time import HeldLoop
from support.job_parts import in_loop
from support.waiting import PATIENCE_S


@given(st.lists(st.one_of(st.binary(max_size=50), st.integers(0, 2**20).map(bytes)), max_size=12))
def test_messages_are_found_again_in_their_blocks(messages: list[bytes]) -> None:
    blocks = list(blocks_of(messages))
    assert [message for block in blocks for message in messages_of(block)] == messages
    assert all(len(block) <= 512 * 1024 or len(list(messages_of(block))) == 1 for block in blocks)


def test_a_folder_is_for_one_server_and_free_after_a_kill(tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "state"
    with held_store(folder) as outcome:
        assert outcome == "open"
        with pytest.raises(StoreError, match="in use by another robosc-server"):
            open_store(folder)
    store = open_store(folder)
    with pytest.raises(StoreError, match="in use by another robosc-server"):
        open_store(folder)
    store.close()
    open_store(folder, f"sqlite:///{folder}/jobs.sqlite").close()


def test_what_is_kept_is_for_its_owner_alone(tmp_path: Path) -> None:
    folder = tmp_path / "state"
    store = open_store(folder)
    try:
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700
        assert {stat.S_IMODE(path.stat().st_mode) for path in folder.iterdir()} == {0o600}
    finally:
        store.close()


def test_a_foreign_database_is_not_touched(tmp_path: Path) -> None:
    open_store(tmp_path).close()
    path = tmp_path / "jobs.sqlite"
    with sqlite3.connect(path) as connection:
        connection.executescript("DROP TABLE robosc_schema; DROP TABLE robosc_migrations")
    connection.close()
    with pytest.raises(StoreError, match="foreign tables"):
        open_store(tmp_path)
    path.write_bytes(b"This is no database, whatever its name says. " * 100)
    with pytest.raises(StoreError, match="not a database"):
        open_store(tmp_path)


@pytest.mark.parametrize("is_replaced", [False, True])
async def test_nothing_is_accepted_into_a_file_that_is_gone(
    tmp_path: Path, is_replaced: bool, caplog: pytest.LogCaptureFixture
) -> None:
    store = open_store(tmp_path / "state")
    try:
        await store.enter("me")
        (tmp_path / "state").rename(tmp_path / "aside")
        if is_replaced:
            (tmp_path / "state").mkdir()
            (tmp_path / "state" / "jobs.sqlite").touch()
        for _ in range(2):
            with pytest.raises(StoreUnavailableError):
                await store.beat("me")
            assert not store.is_available
        assert await store.active_ids_of("me") == set()
        assert store.is_readable
        assert [record.message for record in caplog.records] == [
            "the database is unavailable: its file was removed or replaced: put it back, or restart the server to "
            "begin with a new one"
        ]
        if is_replaced:
            (tmp_path / "state").rename(tmp_path / "other")
        (tmp_path / "aside").rename(tmp_path / "state")
        assert await store.beat("me")
        assert store.is_available
    finally:
        store.close()


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("nonsense", "the database URL is invalid"),
        ("mysql://me:secret@host/name", "'mysql' is not supported"),
        ("sqlite://", "must name a file"),
        ("sqlite:///:memory:", "must name a file"),
        ("postgresql://me:secret@127.0.0.1:1/name", "cannot be used"),
    ],
)
def test_other_urls_are_refused_without_their_passwords(tmp_path: Path, url: str, message: str) -> None:
    with pytest.raises(StoreError, match=message) as refused:
        open_store(tmp_path, url)
    assert "secret" not in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_folder_that_cannot_be_made_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(StoreError, match="cannot be used"):
        open_store(tmp_path / "file" / "state")


async def test_a_transaction_that_takes_too_long_is_cut_off_and_the_next_one_is_served(
    tmp_path: Path, loop: HeldLoop
) -> None:
    store = open_store(tmp_path)
    endless = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT count(*) FROM n"
    begun, ended = threading.Event(), threading.Event()

    def work(connection: Connection) -> None:
        begun.set()
        try:
            connection.execute(text(endless))
        finally:
            ended.set()

    for _ in range(5):  # More than there are threads.
        reading = asyncio.create_task(store._database.read(work))
        assert await asyncio.to_thread(begun.wait, PATIENCE_S)
        await loop.passed(7.0)
        assert not reading.done()
        await loop.passed(1.0)
        with pytest.raises(StoreUnavailableError):
            await reading
        assert await asyncio.to_thread(ended.wait, PATIENCE_S)
        begun.clear()
        ended.clear()
    assert not store.is_available
    assert await store.find("x") is None
    assert store.is_available
    store.close()


def test_a_connection_for_reading_is_made_without_writing(tmp_path: Path) -> None:
    """Else it could not be made while the disk is full, or while another connection writes."""
    store = open_store(tmp_path)
    writer = sqlite3.connect(tmp_path / "jobs.sqlite", isolation_level=None)
    try:
        writer.execute("BEGIN IMMEDIATE")
        store._database._engine.dispose()  # Those that there were.
        in_loop(lambda: find(store, "x"))
    finally:
        writer.close()
        store.close()


async def find(store: Store, job_id: str) -> None:
    assert await store.find(job_id) is None


def test_the_log_of_changes_stays_short(tmp_path: Path) -> None:
    store = open_store(tmp_path)

    def work(connection: Connection) -> None:
        connection.execute(text("CREATE TABLE IF NOT EXISTS filler (content BLOB)"))
        connection.execute(text("INSERT INTO filler VALUES (zeroblob(4000000))"))
        connection.execute(text("DELETE FROM filler"))

    async def test() -> None:
        for _ in range(15):
            await store._database.write(work)

    in_loop(test)
    log = tmp_path / "jobs.sqlite-wal"
    assert log.stat().st_size < 24 * 2**20
    # And pages that are free go back to the disk.
    path = tmp_path / "jobs.sqlite"

    async def sweep() -> None:
        await store.sweep(0)

    in_loop(sweep)
    store.close()
    assert path.stat().st_size < 2**20
    assert os.path.lexists(path)
