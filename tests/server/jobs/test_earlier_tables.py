"""Databases of earlier versions are brought up to this one, with what is in them."""

import sqlite3
from pathlib import Path

from sqlalchemy import inspect

from robosc_server.store import Store, open_store
from robosc_server.store.inspection import inspect_sqlite
from support.first_tables import TABLES, check


def structure_of(store: Store) -> object:
    """Columns and indexes of all tables."""
    tables = inspect(store._database._engine)
    return {
        name: (
            {column["name"]: (str(column["type"]), column["nullable"]) for column in tables.get_columns(name)},
            {index["name"]: index["column_names"] for index in tables.get_indexes(name)},
        )
        for name in tables.get_table_names()
    }


def test_tables_of_the_first_version_in_sqlite(tmp_path: Path) -> None:
    for folder in ("old", "new"):
        (tmp_path / folder).mkdir()
    with sqlite3.connect(tmp_path / "old" / "jobs.sqlite") as connection:
        connection.executescript(TABLES.replace("'BLOCK'", "x'00000000'"))
    connection.close()
    # Who only looks changes nothing.
    before = (tmp_path / "old" / "jobs.sqlite").read_bytes()
    inspect_sqlite(tmp_path / "old" / "jobs.sqlite")
    assert (tmp_path / "old" / "jobs.sqlite").read_bytes() == before
    for _ in range(2):  # The second time there is nothing left to do.
        old, new = open_store(tmp_path / "old"), open_store(tmp_path / "new")
        assert structure_of(old) == structure_of(new)
        new.close()
        old.close()
    old = open_store(tmp_path / "old")
    check(old)
    old.close()
