"""Alembic runs this for each command, on the connection that `Database.migrate` hands in."""

from alembic import context

from rapp_cloud.database.tables import metadata

context.configure(connection=context.config.attributes["connection"], target_metadata=metadata, render_as_batch=True)
with context.begin_transaction():
    context.run_migrations()
