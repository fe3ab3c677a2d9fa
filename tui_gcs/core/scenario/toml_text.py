"""A TOML text that is edited by lines, so that comments, order, number formats and line ends stay as they were.

A value is replaced in its own lines (by tomlkit, which keeps their comment), new keys go below the last key of their
table, whole tables in or out. Tables are named by key paths that count from 1, as in `lines`: `round[2].zone[1]`.
Why this is not tomlkit's own document: page 11 of `docs/decisions`.
"""

import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import tomlkit

from tui_gcs.core.scenario.lines import Span, map_lines
from tui_gcs.core.scenario.load import ScenarioError

Value = float | int | bool | str | list[Any]


class TomlText:
    """A TOML text and edits of it by key path.

    An edit raises `ScenarioError` where the text is written in a way that is not edited here, such as a key inside an
    inline table. Several edits that belong together go into `all_or_nothing`.
    """

    def __init__(self, text: str) -> None:
        """Take a TOML text. Raises `ScenarioError` if it is not valid TOML."""
        self.text = text
        self.data = _loads(text)

    @contextmanager
    def all_or_nothing(self) -> Iterator[None]:
        """Restore the text if one of the edits within cannot be made."""
        before, done = (self.text, self.data), False
        try:
            yield
            done = True
        finally:
            if not done:
                self.text, self.data = before

    # Places: where tables and keys stand

    def table(self, path: str) -> dict[str, Any]:
        """The table at a key path as plain data; empty if there is none."""
        table: Any = self.data
        for step in filter(None, path.replace("]", "").replace("[", ".").split(".")):
            table = table[int(step) - 1] if isinstance(table, list) else table.get(step, {})
        return table if isinstance(table, dict) else {}

    def tables(self, path: str, key: str) -> list[dict[str, Any]]:
        """The array of tables under `key` of the table at `path`; empty if it is anything else."""
        found = self.table(path).get(key, [])
        return found if isinstance(found, list) and all(isinstance(t, dict) for t in found) else []

    def has_header(self, path: str) -> bool:
        """Whether the table at `path` has a header line of its own."""
        span = map_lines(self.text).get(path)
        return span is not None and self._lines()[span.first].lstrip().startswith("[")

    def is_inline(self, key: str) -> bool:
        """Whether the top-level `key` holds a table in braces."""
        span = map_lines(self.text).get(key)
        return isinstance(self.data.get(key), dict) and span is not None and not self.has_header(key)

    def last_line_of(self, path: str) -> int:
        """The line, from 0, of the last key of the table at `path`, without the tables in it."""
        return self._span(path).last

    def last_line_under(self, path: str) -> int:
        """The line, from 0, of the last key of the table at `path` and of all tables in it."""
        return self._spans_under(path)[-1].last

    def last_written_line(self) -> int:
        """The last line, from 0, that is not blank."""
        lines = self._lines()
        return next(number for number in reversed(range(len(lines))) if lines[number].strip())

    def _span(self, path: str, known: Mapping[str, Span] | None = None) -> Span:
        spans = map_lines(self.text) if known is None else known
        if path not in spans:
            header = path.replace("]", "").split("[")[0]
            raise ScenarioError(
                [f"scenario: {path} is not edited here; write it under a header of its own, [{header}]"]
            )
        return spans[path]

    def _spans_under(self, path: str) -> list[Span]:
        """The spans of the table at `path` and of all tables with a header of their own in it, in file order."""
        self._span(path)
        lines = self._lines()
        inside = [span for at, span in map_lines(self.text).items() if at == path or at.startswith(f"{path}.")]
        return sorted(span for span in inside if lines[span.first].lstrip().startswith("["))

    # Edits

    def apply(self, path: str, values: Mapping[str, Any], owned: Iterable[str] = ()) -> None:
        """Set `values` in the table at `path` and remove its other `owned` keys."""
        have = self.table(path)
        for key, value in values.items():
            if key not in have:
                self._insert_after(self._span(path).last, [_key_line(key, value)])
            elif not _same(have[key], value):
                self.replace_values([(path, key)], value)
        for key in owned:
            if key in have and key not in values:
                span = self._span(_join(path, key))
                self._commit([*self._lines()[: span.first], *self._lines()[span.last + 1 :]])

    def replace_values(self, places: Iterable[tuple[str, str]], value: Value) -> None:
        """Put `value` under each of these (table path, key)."""
        lines, known = self._lines(), map_lines(self.text)
        spans = [(self._span(_join(path, key), known), path, key) for path, key in places]
        for span, path, key in sorted(spans, reverse=True):  # from the last on: lines above keep their numbers
            end = "\r" if lines[span.last].endswith("\r") else ""
            fragment = tomlkit.parse("\n".join(lines[span.first : span.last + 1]).replace("\r", ""))
            if key not in fragment:
                raise ScenarioError([f"scenario: {_join(path, key)} is not edited here; write it as {key} = value"])
            fragment[key] = value
            lines[span.first : span.last + 1] = [line + end for line in fragment.as_string().split("\n")]
        self._commit(lines)

    def insert_table(self, after_line: int, header: str, values: Mapping[str, Any]) -> None:
        """Insert a blank line and a table behind a line, counted from 0."""
        self._insert_after(after_line, ["", header, *(_key_line(k, v) for k, v in values.items())])

    def copy_tables(self, path: str, after_path: str) -> None:
        """Insert a copy of the table at `path` and the tables in it behind those at `after_path`, without comments."""
        lines = self._lines()
        copied: list[str] = []
        for span in self._spans_under(path):
            copied += ["", *(line.rstrip("\r") for line in lines[span.first : span.last + 1])]
        self._insert_after(self.last_line_under(after_path), copied)

    def remove_tables(self, path: str) -> None:
        """Remove the table at `path` and those in it, each with the blank line behind it. Comments around them stay."""
        lines = self._lines()
        for span in reversed(self._spans_under(path)):
            last = span.last + (span.last + 1 < len(lines) and not lines[span.last + 1].strip())
            del lines[span.first : last + 1]
        self._commit(lines)

    def _insert_after(self, line: int, new: list[str]) -> None:
        lines = self._lines()
        end = "\r" if lines[line].endswith("\r") else ""
        if line == len(lines) - 1:  # the file's last line has no line end; the new last line shall have one
            new = [*new, ""]
        self._commit([*lines[: line + 1], *(text + end if text or end else text for text in new), *lines[line + 1 :]])

    def _lines(self) -> list[str]:
        return self.text.split("\n")

    def _commit(self, lines: list[str]) -> None:
        text = "\n".join(lines)
        self.data = _loads(text)  # raises before anything is changed
        self.text = text


def _loads(text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise ScenarioError([f"scenario: not valid TOML: {error}"]) from None


def _join(path: str, key: str) -> str:
    return f"{path}.{key}" if path else key


def _key_line(key: str, value: Value) -> str:
    table = tomlkit.document()
    table[key] = value
    return table.as_string().rstrip("\n")


def _same(old: Any, new: Any) -> bool:
    """Compare as TOML does: 1 and 1.0 are the same number, true is not 1."""
    if isinstance(old, bool) or isinstance(new, bool):
        return old is new
    return bool(old == new)
