"""Tables of jobs, their requests and results, and of the servers that share them."""

from alembic import op
from sqlalchemy import BigInteger, Boolean, Column, ForeignKey, Integer, LargeBinary, Text, UniqueConstraint

# Written out, and not taken from `schema.py`: that changes, and what version 1 was does not.
revision = "1"
down_revision = None


def upgrade() -> None:
    """Create the tables."""
    op.create_table("robosc_schema", Column("version", Integer, nullable=False))
    op.create_table("replicas", Column("id", Text, primary_key=True), Column("beats", BigInteger, nullable=False))
    op.create_table(
        "results",
        Column("key", Text, primary_key=True),
        Column("kind", Text, nullable=False),
        Column("size", BigInteger, nullable=False),
        Column("used_us", BigInteger, nullable=False),
    )
    op.create_index("results_used", "results", ["used_us"])
    op.create_table(
        "result_blocks",
        Column("key", Text, ForeignKey("results.key", ondelete="CASCADE"), primary_key=True),
        Column("number", Integer, primary_key=True),
        Column("content", LargeBinary, nullable=False),
    )
    op.create_table(
        "jobs",
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
        Column("replica", Text),
        Column("result_key", Text, ForeignKey("results.key")),
        UniqueConstraint("owner", "idempotency_key", name="jobs_idempotency"),
    )
    op.create_index("jobs_listed", "jobs", ["owner", "created_us", "id"])
    op.create_index("jobs_all_listed", "jobs", ["created_us", "id"])
    op.create_index("jobs_active", "jobs", ["state", "replica"])
    op.create_index("jobs_expiring", "jobs", ["expires_us"])
    op.create_index("jobs_results", "jobs", ["result_key"])
    op.create_table(
        "job_requests",
        Column("job", Text, ForeignKey("jobs.id", ondelete="CASCADE"), primary_key=True),
        Column("content", LargeBinary, nullable=False),
    )
