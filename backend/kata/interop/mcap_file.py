"""Write a table of samples as MCAP: one JSON message per sample, with its schema. Foxglove and the mcap library can read it."""

from collections.abc import Iterator, Mapping
from datetime import datetime
from pathlib import Path
from typing import Any, Final

import msgspec
from arro3.core import DataType, Table

_ROWS_AT_ONCE: Final = 10_000
"""Rows that are converted at a time. All samples of an hour as Python numbers would take 200 MB."""


def write_mcap(table: Table, topic: str, begins_at: datetime, origin: Mapping[str, str], path: Path) -> None:
    """Write one message for each row of ``table``. The log time of a message is ``begins_at`` plus ``time_s``. Missing values are left out.

    ``origin`` becomes the metadata record ``origin``.
    """
    from mcap.writer import Writer  # Imported here, because the service would start 0.2 s later.

    begins_ns = int(begins_at.replace(microsecond=0).timestamp()) * 1_000_000_000 + begins_at.microsecond * 1000
    encode = msgspec.json.Encoder().encode
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(library="Kata")
        schema_id = writer.register_schema(f"kata.{topic}", "jsonschema", encode(_json_schema(table)))
        channel_id = writer.register_channel(topic, "json", schema_id)
        for number, sample in enumerate(_samples(table)):
            at_ns = begins_ns + round(sample["time_s"] * 1_000_000_000)
            writer.add_message(channel_id, at_ns, encode(sample), at_ns, number)
        writer.add_metadata("origin", dict(origin))
        writer.finish()  # type: ignore[no-untyped-call]  # The library declares no result.


def _samples(table: Table) -> Iterator[dict[str, float]]:
    names = table.schema.names
    for start in range(0, table.num_rows, _ROWS_AT_ONCE):
        rows = table.slice(start, min(_ROWS_AT_ONCE, table.num_rows - start))
        for row in zip(*(rows[name].to_pylist() for name in names), strict=True):
            yield {name: value for name, value in zip(names, row, strict=True) if value is not None}


def _json_schema(table: Table) -> dict[str, Any]:
    fields = [table.schema.field(name) for name in table.schema.names]
    properties = {
        field.name: {
            "type": "integer" if field.type == DataType.int8() else "number",
            "description": "; ".join(f"{key.decode()}: {value.decode()}" for key, value in field.metadata.items()),
        }
        for field in fields
    }
    return {"type": "object", "properties": properties, "required": ["time_s"]}
