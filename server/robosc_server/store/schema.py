"""Tables of the database, the same in SQLite and PostgreSQL, and their schema version.

Times are microseconds since 1970, in UTC. Requests and result messages have separate tables, so that lists and sweeps
read no large values.
"""

from sqlalchemy import (
    BigInteger,
    Boolean,
    Column,
    Connection,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    Table,
    Text,
    UniqueConstraint,
    insert,
    inspect,
    select,
    text,
    update,
)

from robosc_server.store.errors import StoreError

VERSION = 2
"""Schema version of the tables below. Earlier versions are upgraded; a later version is refused."""

_LOCK = 0x726F626F7363
"""PostgreSQL advisory lock for creating tables: several servers may start at the same time."""

METADATA = MetaData()

SCHEMA = Table("robosc_schema", METADATA, Column("version", Integer, nullable=False))

# Servers that share this database, with their heartbeats.
REPLICAS = Table(
    "replicas",
    METADATA,
    Column("id", Text, primary_key=True),
    Column("beats", BigInteger, nullable=False),
)

RESULTS = Table(
    "results",
    METADATA,
    Column("key", Text, primary_key=True),
    Column("kind", Text, nullable=False),
    Column("size", BigInteger, nullable=False),
    Column("used_us", BigInteger, nullable=False),
    # The caller who requested it first.
    Column("owner", Text, nullable=False, server_default=""),
    Index("results_of_owners", "owner", "used_us"),
)

# The messages of a result: as many in a block as fit, so that a large result is never read at once.
BLOCKS = Table(
    "result_blocks",
    METADATA,
    Column("key", Text, ForeignKey("results.key", ondelete="CASCADE"), primary_key=True),
    Column("number", Integer, primary_key=True),
    Column("content", LargeBinary, nullable=False),
)

JOBS = Table(
    "jobs",
    METADATA,
    Column("id", Text, primary_key=True),
    Column("owner", Text, nullable=False),
    Column("kind", Text, nullable=False),
    Column("state", Text, nullable=False),
    Column("revision", BigInteger, nullable=False),
    Column("key", Text, nullable=False),
    Column("main_file", Text, nullable=False),
    Column("label", Text, nullable=False),
    Column("idempotency_key", Text),
    Column("retention_us", BigInteger, nullable=False),
    Column("created_us", BigInteger, nullable=False),
    Column("started_us", BigInteger),
    Column("ended_us", BigInteger),
    Column("expires_us", BigInteger),
    Column("attempts", Integer, nullable=False),
    Column("stage", Text),
    Column("progress", Text),
    Column("reason", Text),
    Column("message", Text),
    Column("is_from_store", Boolean, nullable=False),
    # The server of the job; NULL: none yet, or the job has ended.
    Column("replica", Text),
    # Set when the job has succeeded; it prevents the deletion of the result.
    Column("result_key", Text, ForeignKey("results.key")),
    # Number of lost workers for which the job may be the cause.
    Column("losses", Integer, nullable=False, server_default="0"),
    UniqueConstraint("owner", "idempotency_key", name="jobs_idempotency"),
    Index("jobs_listed", "owner", "created_us", "id"),
    Index("jobs_all_listed", "created_us", "id"),
    Index("jobs_active", "state", "replica"),
    Index("jobs_expiring", "expires_us"),
    Index("jobs_ended", "owner", "ended_us"),
    Index("jobs_results", "result_key"),
)

# Requests of unfinished jobs.
REQUESTS = Table(
    "job_requests",
    METADATA,
    Column("job", Text, ForeignKey("jobs.id", ondelete="CASCADE"), primary_key=True),
    Column("content", LargeBinary, nullable=False),
)


# Upgrades from each version to the next. Running servers of the earlier version continue to work.
_STEPS = {
    1: (
        "ALTER TABLE results ADD COLUMN owner TEXT NOT NULL DEFAULT ''",
        "UPDATE results SET owner = COALESCE((SELECT MIN(owner) FROM jobs WHERE jobs.result_key = results.key), '')",
        "CREATE INDEX results_of_owners ON results (owner, used_us)",
        "DROP INDEX results_used",
        "ALTER TABLE jobs ADD COLUMN losses INTEGER NOT NULL DEFAULT 0",
        "CREATE INDEX jobs_ended ON jobs (owner, ended_us)",
    ),
}


def prepare(connection: Connection) -> None:
    """Make the tables, or bring them up to this version.

    Raises:
        StoreError: They are not.
    """
    if connection.dialect.name == "postgresql":
        connection.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": _LOCK})
    version = version_of(connection)
    if version is None:
        METADATA.create_all(connection)
        connection.execute(insert(SCHEMA).values(version=VERSION))
        return
    for earlier in range(version, VERSION):
        for step in _STEPS[earlier]:
            connection.execute(text(step))
    if version != VERSION:
        connection.execute(update(SCHEMA).values(version=VERSION))


def version_of(connection: Connection) -> int | None:
    """Return the version of the existing tables, usable here or after an upgrade; None: there are no tables.

    Only reads.

    Raises:
        StoreError: There are other tables.
    """
    names = set(inspect(connection).get_table_names())
    if SCHEMA.name not in names:
        if names & set(METADATA.tables):
            raise StoreError("foreign tables use RoboSC's table names: use another database")
        return None
    versions = list(connection.scalars(select(SCHEMA.c.version)))
    if len(versions) == 1 and (versions[0] == VERSION or versions[0] in _STEPS):
        return int(versions[0])
    found = versions[0] if len(versions) == 1 else "unknown"
    raise StoreError(
        f"the tables have schema version {found}, but this server supports version {VERSION} and earlier: use the "
        "version of RoboSC that created them, or another database"
    )
