"""Owners of results, and the workers that jobs have lost."""

from alembic import op
from sqlalchemy import Column, Integer, Text

revision = "2"
down_revision = "1"


def upgrade() -> None:
    """Add the columns and their indexes; a result belongs to a caller of the jobs that it is the result of."""
    op.add_column("results", Column("owner", Text, nullable=False, server_default=""))
    op.execute(
        "UPDATE results SET owner = COALESCE((SELECT MIN(owner) FROM jobs WHERE jobs.result_key = results.key), '')"
    )
    op.create_index("results_of_owners", "results", ["owner", "used_us"])
    op.drop_index("results_used", "results")
    op.add_column("jobs", Column("losses", Integer, nullable=False, server_default="0"))
    op.create_index("jobs_ended", "jobs", ["owner", "ended_us"])
