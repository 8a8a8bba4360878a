"""Migration of a database to the schema version of this server, by Alembic.

All migrations together are one transaction, on the server's own connection. Servers of the earlier version continue to
work.
"""

import logging
import threading
from functools import cache

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, delete, insert, inspect, select, text

from robosc_server.store.errors import StoreError
from robosc_server.store.schema import METADATA, SCHEMA

_log = logging.getLogger(__name__)

VERSION_TABLE = "robosc_migrations"
"""Table in which Alembic keeps the schema version, not called as it would call it: a database may hold tables of other
programs that use Alembic."""

_LOCK = 0x726F626F7363
"""PostgreSQL advisory lock for migrations: several servers may start at the same time."""

_MIGRATION_S = 600
"""Time that one statement of a migration may take, and that another server waits for the migration, in seconds."""

# Alembic has one environment for the whole process.
_alembic_lock = threading.Lock()


def latest_version() -> int:
    """Return the schema version of this server. Earlier versions are migrated; a later version is refused."""
    return max(map(int, _revisions()))


def prepare(connection: Connection) -> None:
    """Create the tables, or migrate them to the schema version of this server.

    Args:
        connection: Connection with a transaction that may write.

    Raises:
        StoreError: There are other tables, or those of a later version.
    """
    if connection.dialect.name == "postgresql":
        # A migration takes as long as the tables are large; what it locks, it waits for no longer than any change does.
        for setting in ("statement_timeout", "lock_timeout"):
            connection.execute(text(f"SET LOCAL {setting} = '{_MIGRATION_S}s'"))
        connection.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": _LOCK})
        connection.execute(text("SET LOCAL lock_timeout = DEFAULT"))
    version, latest = version_of(connection), latest_version()
    is_known_to_alembic = bool(_context(connection).get_current_heads())
    if version == latest and is_known_to_alembic:
        return
    with _alembic_lock:
        if version is not None and not is_known_to_alembic:
            _context(connection).stamp(_scripts(), str(version))
        config = _config()
        config.attributes["connection"] = connection
        command.upgrade(config, "head")
    connection.execute(delete(SCHEMA))
    connection.execute(insert(SCHEMA).values(version=latest))
    if version is not None and version != latest:
        _log.info("the database is migrated from schema version %d to %d", version, latest)


def version_of(connection: Connection) -> int | None:
    """Return the schema version of the tables, usable here or after a migration; None: there are no tables.

    Only reads.

    Raises:
        StoreError: There are other tables, or those of a later version.
    """
    names = set(inspect(connection).get_table_names())
    found = list(_context(connection).get_current_heads())
    if not found and SCHEMA.name in names:
        # Tables from before the migrations.
        found = [str(version) for version in connection.scalars(select(SCHEMA.c.version))]
    elif not found:
        if names & set(METADATA.tables):
            raise StoreError("foreign tables use RoboSC's table names: use another database")
        return None
    if len(found) == 1 and found[0] in _revisions():
        return int(found[0])
    name = found[0] if len(found) == 1 else "unknown"
    raise StoreError(
        f"the tables have schema version {name}, but this server supports version {latest_version()} and earlier: use "
        "the version of RoboSC that created them, or another database"
    )


def _context(connection: Connection) -> MigrationContext:
    return MigrationContext.configure(connection, opts={"version_table": VERSION_TABLE})


def _config() -> Config:
    config = Config()
    config.set_main_option("script_location", "robosc_server.store:migrations")
    return config


@cache
def _scripts() -> ScriptDirectory:
    return ScriptDirectory.from_config(_config())


@cache
def _revisions() -> frozenset[str]:
    return frozenset(script.revision for script in _scripts().walk_revisions())
