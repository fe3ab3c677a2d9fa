"""Reads TOML tables key by key and notes every problem instead of stopping at the first one.

A library's decoder (`msgspec.convert`) stops at the first problem and knows no line numbers. The author of a
scenario, in the field, wants all of them at once, each with its line.
"""

import difflib
import math
import re
from collections.abc import Collection
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from msgspec import Meta, Struct

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.scenario.lines import Span, find_line

Point = tuple[float, float]
StructT = TypeVar("StructT", bound=Struct)

MAX_DISTANCE_M = 100_000.0
"""Positions and sizes beyond this are mistakes: the flat local frame is not true over such distances."""
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]{1,40}")
_PLAIN_TYPES = {str: "text", bool: "true or false", int: "a whole number", float: "a number"}


class Problems:
    """The problems of a file, one line each: `FILE: KEYPATH (line N): what is wrong; what is allowed`."""

    def __init__(self, where: str, spans: dict[str, Span] | None = None) -> None:
        self.where = printable(where, 200)
        self._spans = spans or {}
        self.lines: list[str] = []

    def add(self, path: str, wrong: str, allowed: str = "") -> None:
        """Note one problem at the key path `path`; "" stands for the whole file."""
        line = find_line(self._spans, path)
        place = f" (line {line})" if line is not None else ""
        key = f"{path}{place}: " if path else ""
        self.lines.append(f"{self.where}: {key}{wrong}" + (f"; {allowed}" if allowed else ""))


class Table:
    """One TOML table. Every getter notes a problem and returns a stand-in where a value is not allowed.

    After all getters, `done()` notes the keys that no getter asked for. `ok` is False once anything was wrong.
    """

    def __init__(self, problems: Problems, path: str, data: dict[str, Any]) -> None:
        self.problems = problems
        self.path = path
        self.data = data
        self.ok = True
        self._asked: set[str] = set()

    def at(self, key: str) -> str:
        """Return the key path of `key`."""
        return f"{self.path}.{key}" if self.path else key

    def wrong(self, key: str, wrong: str, allowed: str = "") -> None:
        """Note a problem with `key`; "" stands for the table itself."""
        self.ok = False
        self.problems.add(self.at(key) if key else self.path, wrong, allowed)

    def has(self, key: str) -> bool:
        """Return whether the key is there. Asking makes it a known key."""
        self._asked.add(key)
        return key in self.data

    def number(
        self, key: str, default: float | None = None, *, above: float = -math.inf, low: float = -math.inf, high: float
    ) -> float:
        """Return a finite number greater than `above`, from `low` to `high`; NaN where it is missing or wrong."""
        value = self._take(key, default)
        if value is None:
            return math.nan
        if isinstance(value, bool) or not isinstance(value, int | float):
            self.wrong(key, f"{shown(value)} is {kind_of(value)}", "must be a number")
        elif not (above < value and low <= value <= high):  # NaN fails too
            least = f"more than {above:g}" if above > low else f"{low:g}"
            self.wrong(key, f"{shown(value)} is out of range", f"must be a number from {least} to {high:g}")
        else:
            return float(value)
        return math.nan

    def integer(self, key: str, default: int | None = None, *, low: int, high: int) -> int:
        """Return a whole number from `low` to `high`; `low` where it is missing or wrong."""
        value = self._take(key, default)
        if value is None:
            return low
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            self.wrong(key, f"{shown(value)} is not allowed", f"must be a whole number from {low} to {high}")
            return low
        return value

    def boolean(self, key: str, default: bool) -> bool:
        """Return a truth value; `default` where it is missing or wrong."""
        value = self._take(key, default)
        if isinstance(value, bool):
            return value
        self.wrong(key, f"{shown(value)} is {kind_of(value)}", "must be true or false")
        return default

    def name(self, key: str, longest: int = 32) -> str:
        """Return printable text of 1 to `longest` characters without blanks at its ends; "" where it is wrong."""
        allowed = f"must be 1 to {longest} printable characters, no blanks at the ends"
        return self._text(key, rf"(?=\S)(?s:.){{1,{longest}}}(?<=\S)", "a name", allowed)

    def simple_name(self, key: str, longest: int = 32) -> str:
        """Return a name of letters, digits, `_` and `-`, which is safe as a part of a bus key or file name."""
        allowed = f"must be 1 to {longest} of A-Z a-z 0-9 _ -"
        return self._text(key, rf"[A-Za-z0-9_-]{{1,{longest}}}", "a simple name", allowed)

    def _text(self, key: str, pattern: str, what: str, allowed: str) -> str:
        value = self._take(key, None)
        if isinstance(value, str) and value.isprintable() and re.fullmatch(pattern, value):
            return value
        if value is not None:
            self.wrong(key, f"{shown(value)} is not {what}", allowed)
        return ""

    def choice(self, key: str, choices: Collection[str], default: str | None = None) -> str:
        """Return one of `choices`; "" where it is missing or wrong."""
        value = self._take(key, default)
        if value is None:
            return ""
        if isinstance(value, str) and value in choices:
            return value
        self.wrong(key, f"{shown(value)} is not known{nearest(value, choices)}", f"must be {one_of(choices)}")
        return ""

    def pairs(self, key: str, most: int) -> list[Point]:
        """Return a list of at most `most` pairs of finite numbers; wrong pairs are left out."""
        value = self._take(key, None)
        if value is None:
            return []
        if not isinstance(value, list) or len(value) > most:
            self.wrong(key, f"{shown(value)} is not a list of points", f"must be up to {most} pairs of numbers")
            return []
        good = [self._as_pair(f"{key}[{i + 1}]", item) for i, item in enumerate(value)]
        return [pair for pair in good if pair is not None]

    def pair(self, key: str) -> Point | None:
        """Return a pair of finite numbers, or None where it is missing or wrong."""
        return self._as_pair(key, self._take(key, None))

    def table(self, key: str, *, required: bool = False) -> "Table":
        """Return the table under `key`; an empty one where it is missing or wrong."""
        if not self.has(key):
            if required:
                self.wrong(key, "is missing", "must be a table")
            return Table(self.problems, self.at(key), {})
        value = self.data[key]
        if isinstance(value, dict):
            return Table(self.problems, self.at(key), value)
        self.wrong(key, f"{shown(value)} is {kind_of(value)}", f"must be a table: [{key}]")
        return Table(self.problems, self.at(key), {})

    def tables(self, key: str, most: int, *, least: int = 1) -> list["Table"]:
        """Return the array of tables under `key`; an empty list where its form or length is wrong."""
        value = self.data[key] if self.has(key) else []
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            self.wrong(key, f"{kind_of(value)} is not allowed", f"must be tables: [[{key}]]")
            return []
        if not least <= len(value) <= most:
            self.wrong(key, f"{len(value)} of them", f"must be {least} to {most} tables [[{key}]]")
            return []
        return [Table(self.problems, f"{self.at(key)}[{i + 1}]", item) for i, item in enumerate(value)]

    def struct(self, kind: type[StructT]) -> StructT:
        """Return a struct that has the keys of this table as fields, with its defaults for what is missing or wrong.

        Ranges and choices are those of the fields' annotations (`Meta`, `Literal`). It calls `done`.
        """
        preset = kind()
        read = {
            name: self._field(name, hint, getattr(preset, name))
            for name, hint in get_type_hints(kind, include_extras=True).items()
            if get_origin(hint) is not dict  # a table within this one, which the caller reads
        }
        self.done()
        return kind(**read) if self.ok else preset

    def _field(self, key: str, hint: Any, default: Any) -> Any:
        """Read one value by the annotation of its field: a number with limits, one of a few words, or a truth value."""
        if hint is bool:
            return self.boolean(key, default)
        if get_origin(hint) is Literal:
            return self.choice(key, get_args(hint), default)
        limits: Meta = get_args(hint)[1]
        above = -math.inf if limits.gt is None else limits.gt
        low = -math.inf if limits.ge is None else limits.ge
        high = math.inf if limits.le is None else limits.le
        return self.number(key, default, above=above, low=low, high=high)

    def done(self) -> None:
        """Note every key that no getter asked for, with the known key that is nearest to it."""
        for key in self.data:
            if key not in self._asked:
                allowed = f"known here: {', '.join(sorted(self._asked))}"
                first = f"{shown_key(key)}[1]" if _is_array_of_tables(self.data[key]) else shown_key(key)
                self.wrong(first, f"unknown key{nearest(key, self._asked)}", allowed)

    def _take(self, key: str, default: Any) -> Any:
        if self.has(key):
            return self.data[key]
        if default is None:
            self.wrong(key, "is missing", "this key is required")
        return default

    def _as_pair(self, key: str, value: Any) -> Point | None:
        if isinstance(value, list) and len(value) == 2 and all(_is_coordinate(v) for v in value):
            return float(value[0]), float(value[1])
        if value is not None:
            allowed = f"must be two numbers between -{MAX_DISTANCE_M:g} and {MAX_DISTANCE_M:g}"
            self.wrong(key, f"{shown(value)} is not a point", allowed)
        return None


def in_metres(table: Table, key: str, point: Point, frame: LocalFrame | None) -> Point | None:
    """Return `point` in ENU metres. Points in degrees must be on the globe and near the origin."""
    if not key.split("[")[0].endswith("_deg"):
        return point
    if abs(point[0]) > 90 or abs(point[1]) > 180:
        table.wrong(key, f"{list(point)} is not on the globe", "must be [latitude -90 to 90, longitude -180 to 180]")
        return None
    if frame is None:  # the origin's own problem is reported already
        table.ok = False
        return None
    x_m, y_m = frame.to_enu(*point)
    if max(abs(x_m), abs(y_m)) > MAX_DISTANCE_M:
        table.wrong(key, f"{list(point)} is far from the origin", f"must be within {MAX_DISTANCE_M / 1000:g} km of it")
        return None
    return x_m, y_m


def _is_coordinate(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= MAX_DISTANCE_M


def shown(value: Any) -> str:
    """Return a value as it may stand in an error message: one short line without unprintable characters."""
    if isinstance(value, int) and abs(value) > 10**18:
        return "a huge number"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict | list):
        return kind_of(value)
    return printable(repr(value) if isinstance(value, str) else str(value), 60)


def shown_key(key: str) -> str:
    """Return a key as TOML writes it: quoted unless it is a bare key."""
    return key if _BARE_KEY.fullmatch(key) else printable(repr(key), 60)


def printable(text: str, most: int) -> str:
    """Return `text` cut to `most` characters, with everything escaped that could disturb a terminal."""
    clean = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
    return clean if len(clean) <= most else clean[: most - 1] + "…"


def _is_array_of_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], dict)


def kind_of(value: Any) -> str:
    """Return the kind of a TOML value in words, for an error message."""
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list):
        return "a list"
    return _PLAIN_TYPES.get(type(value), "a date or time")


def nearest(word: Any, known: Collection[str]) -> str:
    """Return ` (did you mean X?)` where a known word is near, else an empty text."""
    close = difflib.get_close_matches(word, sorted(known), n=1) if isinstance(word, str) and len(word) < 100 else []
    return f" (did you mean {close[0]}?)" if close else ""


def one_of(choices: Collection[str]) -> str:
    """Return the choices as a text for an error message."""
    return ", ".join(choices) if len(choices) < 3 else "one of " + ", ".join(choices)
