"""Migrations of the database, one for each schema version, run by Alembic."""
