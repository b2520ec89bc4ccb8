"""Bringing a database to the tables of this code, one numbered step after the other (Alembic)."""

from __future__ import annotations

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Engine, text

_STEPS = Path(__file__).with_name("migrations")
#: Key of the lock under which PostgreSQL lets one process migrate at a time; any number that nothing else uses.
_LOCK = 0x6761696E


def migrate(engine: Engine) -> None:
    """Take the steps that the database has not taken, in one transaction; other processes wait meanwhile."""
    with engine.connect().execution_options(writes=True) as connection, connection.begin():
        if engine.dialect.name == "postgresql":
            connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _LOCK})
        config = _config()
        config.attributes["connection"] = connection
        command.upgrade(config, "head")


def version_of(engine: Engine) -> str | None:
    """The last step that the database has taken."""
    with engine.connect() as connection:
        return MigrationContext.configure(connection).get_current_revision()


def version_here() -> str | None:
    """The last step that there is."""
    return ScriptDirectory.from_config(_config()).get_current_head()


def known(version: str | None) -> bool:
    """Whether this code has the step, so that it can go on from there; None is a database without tables."""
    return version is None or version in {
        step.revision for step in ScriptDirectory.from_config(_config()).walk_revisions()
    }


def _config() -> Config:
    config = Config()
    config.set_main_option("script_location", str(_STEPS).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    return config
