"""Inserting a row that another process may insert at the same moment."""

from __future__ import annotations

from typing import Any

from sqlalchemy import Connection, Table
from sqlalchemy.dialects import postgresql, sqlite


def insert_if_new(connection: Connection, table: Table, **values: Any) -> bool:
    """Insert a row unless there is one with its key, or its other unique columns; whether it was inserted.

    A row of another transaction that is not over is waited for.
    """
    insert = (postgresql if connection.dialect.name == "postgresql" else sqlite).insert(table)
    wanted = insert.values(values).on_conflict_do_nothing().returning(*table.primary_key)
    return connection.execute(wanted).first() is not None
