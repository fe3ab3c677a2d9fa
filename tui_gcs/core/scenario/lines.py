"""Maps the key paths of a TOML text to its lines, for error messages and for edits that keep comments.

Key paths count from 1, as an author does: `round[2].zone[1].radius_m` is in the second round's first zone. Only tables
with a header of their own and plain `key = value` lines are mapped; keys inside inline tables are not.
"""

import re
from typing import NamedTuple

_HEADER = re.compile(r"\s*(\[\[?)\s*([\w-]+(?:\s*\.\s*[\w-]+)*)\s*\]\]?\s*(?:#.*)?$")
_KEY = re.compile(r"\s*([\w-]+(?:\.[\w-]+)*)\s*=")
_STRING_OR_COMMENT = re.compile(r'"(?:\\.|[^"\\])*"|\'[^\']*\'|#.*$')


class Span(NamedTuple):
    """The first and last line, from 0. A table's span is its header and its own keys, without what follows them."""

    first: int
    last: int


def map_lines(text: str) -> dict[str, Span]:
    """Return the spans of all tables and keys by key path; none if the text has multi-line strings."""
    if '"""' in text or "'''" in text:
        return {}
    spans: dict[str, Span] = {}
    counts: dict[str, int] = {}
    table = key = ""
    depth = 0
    for number, line in enumerate(text.split("\n")):
        if depth > 0:
            spans[key] = spans[key]._replace(last=number)
        elif header := _HEADER.match(line):
            table = _table_path(header[2], header[1] == "[[", counts)
            spans.setdefault(table, Span(number, number))
            continue
        elif found := _KEY.match(line):
            key = f"{table}.{found[1]}" if table else found[1]
            spans[key] = Span(number, number)
        else:
            continue
        depth = max(0, depth + _brackets(line))
        spans[table] = Span(spans[table].first if table in spans else number, number)
    return spans


def find_line(spans: dict[str, Span], path: str) -> int | None:
    """Return the line, from 1, of `path` or of the innermost table around it that is mapped; None if there is none."""
    while path:
        if path in spans:
            return spans[path].first + 1
        path = path[: max(path.rfind("."), path.rfind("["), 0)]
    return None


def _table_path(header: str, is_array: bool, counts: dict[str, int]) -> str:
    """Turn `round.zone` into `round[1].zone[2]`, and count the tables of every array on the way."""
    steps = [step.strip() for step in header.split(".")]
    path = ""
    for i, step in enumerate(steps):
        path = f"{path}.{step}" if path else step
        if is_array and i == len(steps) - 1:
            counts[path] = counts.get(path, 0) + 1
        if path in counts:
            path = f"{path}[{counts[path]}]"
    return path


def _brackets(line: str) -> int:
    """Return how many brackets this line leaves open; brackets in strings and comments do not count."""
    bare = _STRING_OR_COMMENT.sub("", line)
    return bare.count("[") + bare.count("{") - bare.count("]") - bare.count("}")
