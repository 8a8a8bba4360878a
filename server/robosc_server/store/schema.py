"""Tables of the database, the same in SQLite and PostgreSQL.

The scripts of `robosc_server/store/migrations/` make them, and number their schema versions; `migrate.py` runs them.
Times are microseconds since 1970, in UTC. Requests and result messages have separate tables, so that lists and sweeps
read no large values.
"""

from sqlalchemy import (
    BigInteger,
    Boolean,
    Column,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    Table,
    Text,
    UniqueConstraint,
)

METADATA = MetaData()

# Versions of RoboSC from before the migrations look here, and refuse tables that are newer than they are.
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
