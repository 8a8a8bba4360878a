"""Name of the table in which Alembic keeps the schema version."""

VERSION_TABLE = "robosc_migrations"
"""Not Alembic's own name for it: a database may hold tables of other programs that use Alembic."""
