"""The tables, as SQLAlchemy knows them; `migrations` brings a database to them.

Times are seconds since 1970, UTC. A column that ends in ``_blob`` holds the digest of a file of `service.store.blobs`.
"""

from __future__ import annotations

from sqlalchemy import (
    BigInteger,
    Column,
    Double,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    PrimaryKeyConstraint,
    String,
    Table,
    Text,
    UniqueConstraint,
)

metadata = MetaData()

#: Counts up with time. SQLite counts by itself only in a column of this very type.
_SEQ = BigInteger().with_variant(Integer, "sqlite")
_DIGEST = String(64)

designs = Table(
    "designs",
    metadata,
    Column("id", String(32), primary_key=True),
    Column("name", Text, nullable=False),
    Column("created_at", Text, nullable=False),
    Column("version", Text, nullable=False),
    Column("request", LargeBinary, nullable=False),
    Column("answer_blob", _DIGEST, nullable=False, index=True),
    Column("parts_blob", _DIGEST, index=True),
    Column("bytes", BigInteger, nullable=False),
    Column("used_at", Double, nullable=False),
    Index("designs_by_use", "used_at", "id", "bytes"),
)

#: One row: which store this is. The directory of the files says the same.
identity = Table("identity", metadata, Column("id", String(32), primary_key=True))

#: Who posted which design: its owners see it, in the order of their posting.
ownerships = Table(
    "ownerships",
    metadata,
    Column("seq", _SEQ, primary_key=True, autoincrement=True),
    Column("design_id", String(32), ForeignKey("designs.id", ondelete="CASCADE"), nullable=False),
    Column("owner", String(64), nullable=False),
    UniqueConstraint("design_id", "owner"),
    Index("ownerships_by_owner", "owner", "seq"),
    sqlite_autoincrement=True,
)

jobs = Table(
    "jobs",
    metadata,
    Column("seq", _SEQ, primary_key=True, autoincrement=True),
    Column("id", String(32), nullable=False, unique=True),
    Column("owner", String(64), nullable=False),
    Column("kind", String(40), nullable=False),
    Column("state", String(12), nullable=False, index=True),
    Column("spec", LargeBinary, nullable=False),
    Column("done", Integer, nullable=False),
    Column("total", Integer, nullable=False),
    Column("revision", Integer, nullable=False),
    Column("attempts", Integer, nullable=False),
    Column("result", Text),
    Column("result_blob", _DIGEST, index=True),
    Column("error", Text),
    Column("created_at", Double, nullable=False),
    Column("started_at", Double),
    Column("finished_at", Double),
    sqlite_autoincrement=True,
)

#: What is finished of a job: kept so that it is not done twice.
chunks = Table(
    "chunks",
    metadata,
    Column("job_id", String(32), ForeignKey("jobs.id", ondelete="CASCADE"), nullable=False),
    Column("number", Integer, nullable=False),
    Column("result_blob", _DIGEST, nullable=False, index=True),
    PrimaryKeyConstraint("job_id", "number"),
)

#: Roles that one process at a time has.
leases = Table(
    "leases",
    metadata,
    Column("name", String(40), primary_key=True),
    Column("holder", String(64), nullable=False),
    Column("until", Double, nullable=False),
)

keys = Table(
    "keys",
    metadata,
    Column("id", String(16), primary_key=True),
    Column("name", Text, nullable=False),
    Column("digest", _DIGEST, nullable=False),
    Column("scope", String(8), nullable=False),
    Column("requests_per_minute", Integer),
    Column("max_stored_bytes", BigInteger),
    Column("created_at", Double, nullable=False),
    Column("revoked_at", Double),
)

#: Answers to requests that named an ``Idempotency-Key``; without a status while the first of them is answered.
repeated = Table(
    "repeated",
    metadata,
    Column("owner", String(64), nullable=False),
    Column("key", String(200), nullable=False),
    Column("request_digest", _DIGEST, nullable=False),
    Column("created_at", Double, nullable=False, index=True),
    Column("status", Integer),
    Column("headers", Text),
    Column("answer_blob", _DIGEST, index=True),
    PrimaryKeyConstraint("owner", "key"),
)
