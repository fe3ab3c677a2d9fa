"""Rows of a screen as tab-separated text for the clipboard: a line of titles, then a line for each row.

A row is copied with all its values, whatever has room on the screen, under the names that the station's messages have:
they carry the units. A spreadsheet takes the text as a table.

Text of vehicles is hostile, and what is pasted into a shell is executed: every cell is cleaned, so that tabs and line
ends are only those that are written here.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum

from msgspec import Struct

from tui_gcs.core.base.text import clean

MAX_COPIED_BYTES = 74_994
"""The longest text of an OSC 52 sequence: some terminals stop at 100,000 bytes (hterm, osc52.vim); base64 takes 4/3."""
MAX_COPIED_CELLS = 2000
"""The longest value of a row: a journal line or a list of vehicles fits."""

Record = Mapping[str, object]
"""The values of a row by their titles."""


def record_of(row: object) -> dict[str, object]:
    """Return the values of a message, dataclass or named tuple by name; those of a row inside it stand beside its own.

    A name that occurs twice is preceded by the name of the row inside.
    """
    record: dict[str, object] = {}
    for name, value in _named_values(row):
        if isinstance(value, Struct) or is_dataclass(value) or hasattr(value, "_fields"):
            for inner, each in record_of(value).items():
                record[f"{name}_{inner}" if inner in record else inner] = each
        else:
            record[name] = value
    return record


def _named_values(row: object) -> list[tuple[str, object]]:
    if isinstance(row, Struct):
        return [(name, getattr(row, name)) for name in row.__struct_fields__]
    if is_dataclass(row):
        return [(field.name, getattr(row, field.name)) for field in fields(row)]
    if isinstance(row, tuple) and hasattr(row, "_fields"):
        return list(zip(row._fields, row, strict=True))
    raise TypeError(f"{type(row).__name__} has no named values: its list declares `record`")


def cell_text(value: object) -> str:
    """Return a value as the text of one cell; "" for an unknown number."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.10g}" if math.isfinite(value) else ""
    if value is None:
        return ""
    if isinstance(value, Enum):
        return cell_text(value.value)
    if isinstance(value, Mapping):
        return clean(", ".join(f"{key}={cell_text(each)}" for key, each in value.items()), MAX_COPIED_CELLS)
    if isinstance(value, (tuple, list, frozenset, set)):
        return clean(", ".join(map(cell_text, value)), MAX_COPIED_CELLS)
    return clean(str(value), MAX_COPIED_CELLS)


def tab_separated(records: Sequence[Record]) -> tuple[str, int]:
    """Return the text of these rows, and how many of them fit into `MAX_COPIED_BYTES`: all but of large lists."""
    titles = list(dict.fromkeys(title for record in records for title in record))
    lines = ["\t".join(map(cell_text, titles))]
    used = len(lines[0].encode())
    for record in records:
        line = "\t".join(cell_text(record.get(title)) for title in titles)
        used += 1 + len(line.encode())
        if used > MAX_COPIED_BYTES:
            break
        lines.append(line)
    return "\n".join(lines), len(lines) - 1
