"""Environment in which Alembic runs the migrations: the server's own connection, in the transaction it has begun."""

from alembic import context

from robosc_server.store.migrate import VERSION_TABLE

context.configure(connection=context.config.attributes["connection"], version_table=VERSION_TABLE)
context.run_migrations()
