"""Samples in blocks of a minute, with an overview of those that last longer

Samples of before stay as they are, each in one piece: they can be read so.

Revision ID: 0006
Revises: 0005
"""

import json
import zlib

import numpy as np
import sqlalchemy as sa
from alembic import op

from kata.database.arrays import Floats, SampleColumn, UnreadableError
from kata.database.series import Series, unpack

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None

_KEYS = {"recording": "recording_id", "run": "run_id"}


def upgrade() -> None:
    for kind, key in _KEYS.items():
        op.add_column(f"{kind}_samples", sa.Column("overview", sa.LargeBinary(), nullable=True))
        op.create_table(
            f"{kind}_sample_blocks",
            sa.Column(key, sa.Uuid(), nullable=False),
            sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
            sa.Column("data", sa.LargeBinary(), nullable=False),
            sa.ForeignKeyConstraint(
                [key],
                [f"{kind}_samples.{key}"],
                name=f"fk_{kind}_sample_blocks_{key}_{kind}_samples",
                ondelete="CASCADE",
            ),
            sa.PrimaryKeyConstraint(key, "number", name=f"pk_{kind}_sample_blocks"),
        )


def downgrade() -> None:
    for kind, key in _KEYS.items():
        _in_one_piece(kind, key)
        op.drop_table(f"{kind}_sample_blocks")
        op.drop_column(f"{kind}_samples", "overview")
    _each("run_corrections", "run_id", lambda _, data: _as_before(Series(data)))


def _in_one_piece(kind: str, key: str) -> None:
    blocks = sa.table(f"{kind}_sample_blocks", sa.column(key, sa.Uuid()), sa.column("number"), sa.column("data"))
    connection = op.get_bind()

    def joined(identity, head):
        found = sa.select(blocks.c.number, blocks.c.data).where(blocks.c[key] == identity)
        return _as_before(Series(head, {row.number: row.data for row in connection.execute(found)}))

    _each(f"{kind}_samples", key, joined)


def _each(name: str, key: str, changed) -> None:
    """Change one row at a time: all samples of a clinic do not fit into memory."""
    rows = sa.table(name, sa.column(key, sa.Uuid()), sa.column("data", sa.LargeBinary()))
    connection = op.get_bind()
    for identity in connection.execute(sa.select(rows.c[key])).scalars().all():
        mine = rows.c[key] == identity
        data = connection.execute(sa.select(rows.c.data).where(mine)).scalar_one()
        connection.execute(sa.update(rows).where(mine).values(data=changed(identity, data)))


def _as_before(series: Series) -> bytes:
    """Return the samples in the format of the previous version. Damaged samples stay unchanged."""
    if b'"kata-samples/1"' in series.head[:40]:
        return series.head
    try:
        arrays = unpack(series)
    except UnreadableError:
        return series.head
    columns = [SampleColumn(name, _UNITS[name.rpartition("_")[2]], _RESOLUTIONS.get(name, 1e-4)) for name in arrays]
    return _encoded(arrays, columns)


_UNITS = {"s": "s", "deg": "deg", "nm": "Nm", "phase": "", "gain": "1", "back": "1"}
_FINE = ("time_s", "path_s", "correction_deg", "played_deg", "error_deg", "gain", "fell_back")
_RESOLUTIONS = dict.fromkeys(_FINE, 1e-6) | {"phase": 1.0}


def _encoded(arrays: dict[str, Floats], columns: list[SampleColumn]) -> bytes:
    """Encode samples as the previous version did."""
    parts = [_packed(arrays[column.name], column.resolution) for column in columns]
    body = b"".join(parts)
    described = [
        {"name": one.name, "unit": one.unit, "resolution": one.resolution, "shape": list(arrays[one.name].shape), "bytes": len(part)}
        for one, part in zip(columns, parts, strict=True)
    ]  # fmt: skip
    header = {"format": "kata-samples/1", "crc32": zlib.crc32(body), "columns": described}
    return json.dumps(header).encode() + b"\n" + body


def _packed(values: Floats, resolution: float) -> bytes:
    missing = np.isnan(values)
    steps = np.where(missing, 0, np.rint(values / resolution)).astype(np.int64)
    steps[missing] = np.iinfo(np.int64).min
    with np.errstate(over="ignore"):
        differences = np.diff(steps, axis=0, prepend=np.zeros_like(steps[:1]))
    return zlib.compress(differences.astype("<i8").view(np.uint8).reshape(-1, 8).T.tobytes(), 6)
