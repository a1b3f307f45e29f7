"""What the platform remembers in tables: SQLite in its data folder, or PostgreSQL by URL; Alembic brings old ones up to date."""
