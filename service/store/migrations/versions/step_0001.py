"""The first tables; and what a store from before them holds is carried over."""

import secrets
import time
from pathlib import Path

import sqlalchemy as sa
from alembic import op

from service.store.blobs import Blobs

revision = "0001"
down_revision = None

#: Layout in the header of the SQLite file: 1 was one table with the answers in it; code of then refuses 2 in words.
_BEFORE, _NOW = 1, 2
_SEQ = sa.BigInteger().with_variant(sa.Integer, "sqlite")


def upgrade() -> None:
    """Make the tables, and fill them with what was kept before them."""
    sqlite = op.get_bind().dialect.name == "sqlite"
    before = sqlite and op.get_bind().scalar(sa.text("PRAGMA user_version")) == _BEFORE
    if before:
        op.rename_table("designs", "designs_before")
    op.create_table(
        "designs",
        sa.Column("id", sa.String(32), primary_key=True),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("created_at", sa.Text, nullable=False),
        sa.Column("version", sa.Text, nullable=False),
        sa.Column("request", sa.LargeBinary, nullable=False),
        sa.Column("answer_blob", sa.String(64), nullable=False),
        sa.Column("parts_blob", sa.String(64)),
        sa.Column("bytes", sa.BigInteger, nullable=False),
        sa.Column("used_at", sa.Double, nullable=False),
    )
    op.create_index("ix_designs_answer_blob", "designs", ["answer_blob"])
    op.create_index("ix_designs_parts_blob", "designs", ["parts_blob"])
    op.create_index("designs_by_use", "designs", ["used_at", "id", "bytes"])
    identity = op.create_table("identity", sa.Column("id", sa.String(32), primary_key=True))
    op.bulk_insert(identity, [{"id": secrets.token_hex(16)}])
    op.create_table(
        "ownerships",
        sa.Column("seq", _SEQ, primary_key=True, autoincrement=True),
        sa.Column("design_id", sa.String(32), sa.ForeignKey("designs.id", ondelete="CASCADE"), nullable=False),
        sa.Column("owner", sa.String(64), nullable=False),
        sa.UniqueConstraint("design_id", "owner"),
        sqlite_autoincrement=True,
    )
    op.create_index("ownerships_by_owner", "ownerships", ["owner", "seq"])
    op.create_table(
        "jobs",
        sa.Column("seq", _SEQ, primary_key=True, autoincrement=True),
        sa.Column("id", sa.String(32), nullable=False, unique=True),
        sa.Column("owner", sa.String(64), nullable=False),
        sa.Column("kind", sa.String(40), nullable=False),
        sa.Column("state", sa.String(12), nullable=False),
        sa.Column("spec", sa.LargeBinary, nullable=False),
        sa.Column("done", sa.Integer, nullable=False),
        sa.Column("total", sa.Integer, nullable=False),
        sa.Column("revision", sa.Integer, nullable=False),
        sa.Column("attempts", sa.Integer, nullable=False),
        sa.Column("result", sa.Text),
        sa.Column("result_blob", sa.String(64)),
        sa.Column("error", sa.Text),
        sa.Column("created_at", sa.Double, nullable=False),
        sa.Column("started_at", sa.Double),
        sa.Column("finished_at", sa.Double),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_jobs_state", "jobs", ["state"])
    op.create_index("ix_jobs_result_blob", "jobs", ["result_blob"])
    op.create_table(
        "chunks",
        sa.Column("job_id", sa.String(32), sa.ForeignKey("jobs.id", ondelete="CASCADE"), nullable=False),
        sa.Column("number", sa.Integer, nullable=False),
        sa.Column("result_blob", sa.String(64), nullable=False),
        sa.PrimaryKeyConstraint("job_id", "number"),
    )
    op.create_index("ix_chunks_result_blob", "chunks", ["result_blob"])
    op.create_table(
        "leases",
        sa.Column("name", sa.String(40), primary_key=True),
        sa.Column("holder", sa.String(64), nullable=False),
        sa.Column("until", sa.Double, nullable=False),
    )
    op.create_table(
        "keys",
        sa.Column("id", sa.String(16), primary_key=True),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("digest", sa.String(64), nullable=False),
        sa.Column("scope", sa.String(8), nullable=False),
        sa.Column("requests_per_minute", sa.Integer),
        sa.Column("max_stored_bytes", sa.BigInteger),
        sa.Column("created_at", sa.Double, nullable=False),
        sa.Column("revoked_at", sa.Double),
    )
    op.create_table(
        "repeated",
        sa.Column("owner", sa.String(64), nullable=False),
        sa.Column("key", sa.String(200), nullable=False),
        sa.Column("request_digest", sa.String(64), nullable=False),
        sa.Column("created_at", sa.Double, nullable=False),
        sa.Column("status", sa.Integer),
        sa.Column("headers", sa.Text),
        sa.Column("answer_blob", sa.String(64)),
        sa.PrimaryKeyConstraint("owner", "key"),
    )
    op.create_index("ix_repeated_created_at", "repeated", ["created_at"])
    op.create_index("ix_repeated_answer_blob", "repeated", ["answer_blob"])
    if before:
        _carry_over(op.get_bind())
        op.drop_table("designs_before")
    if sqlite:
        op.execute(f"PRAGMA user_version = {_NOW}")


def _carry_over(connection: sa.Connection) -> None:
    """Designs in the order of their making, the answers as files, one at a time in memory."""
    (file,) = {row.file for row in connection.execute(sa.text("PRAGMA database_list")) if row.name == "main"}
    blobs = Blobs(Path(file).parent / "files")
    one = sa.text("SELECT * FROM designs_before WHERE seq > :seq ORDER BY seq LIMIT 1")
    into_designs = sa.text(
        "INSERT INTO designs (id, name, created_at, version, request, answer_blob, bytes, used_at) "
        "VALUES (:id, :name, :created_at, :version, :request, :answer_blob, :bytes, :used_at)"
    )
    into_ownerships = sa.text("INSERT INTO ownerships (seq, design_id, owner) VALUES (:seq, :id, 'local')")
    seq = 0
    while (row := connection.execute(one, {"seq": seq}).first()) is not None:
        seq = row.seq
        values = {name: getattr(row, name) for name in ("id", "name", "created_at", "version", "request")}
        answer = {"answer_blob": blobs.put(row.answer), "bytes": len(row.request) + len(row.answer)}
        connection.execute(into_designs, values | answer | {"used_at": time.time()})
        connection.execute(into_ownerships, {"seq": seq, "id": row.id})
