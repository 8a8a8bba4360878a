"""Databases of earlier versions are brought up to this one, with what is in them."""

from pathlib import Path

import psycopg
from sqlalchemy import make_url

from robosc_server.store import open_store
from robosc_server.store.inspection import inspect_postgresql
from support.first_tables import TABLES, check


def test_tables_of_the_first_version_in_postgresql(database_url: str, tmp_path: Path) -> None:
    with psycopg.connect(database_url) as connection:
        connection.execute(TABLES.replace("BLOB", "BYTEA").replace("'BLOCK'", r"'\x00000000'").encode())
    with psycopg.connect(database_url) as reader:
        # Who only looks waits for nobody, as a change of these tables would have to.
        reader.execute("SELECT * FROM results")
        inspect_postgresql(make_url(database_url).update_query_dict({"options": "-c statement_timeout=5000"}), 10.0)
    store = open_store(tmp_path, database_url)
    check(store)
    store.close()
