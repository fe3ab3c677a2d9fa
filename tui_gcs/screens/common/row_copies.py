"""Copying by OSC 52: the terminal takes a text into the clipboard of the operator's computer, also over SSH.

Every copy of the console is made by `copy_rows` or `copy_text`, which clean it. Textual writes it in base64, so that
no byte of it is part of the escape sequence.
"""

from collections.abc import Sequence
from typing import Any

from textual.app import App

from tui_gcs.core.base.text import clean
from tui_gcs.widgets.basics.copied_rows import MAX_COPIED_BYTES, Record, cell_text, tab_separated
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run

COPIED = "copied to the terminal's clipboard"
MAX_KEPT_LINES = 2
"""Lines of an earlier report that stay above that of a copy: panels have seven."""
MAX_LINE_CELLS = 5000
"""The longest line: a path of this computer has up to 4096 bytes."""
MAX_NAME_CELLS = 40


def copy_rows(app: App[Any], records: Sequence[Record]) -> Run:
    """Copy these rows as tab-separated text, and return what is to be reported."""
    text, fitting = tab_separated(records)
    if not fitting:
        return ("there is no row to copy" if not records else "the row is too long to be copied", Ink.CAUTION)
    app.copy_to_clipboard(text)
    what = _name_of(records[0]) if len(records) == 1 else f"{fitting} rows"
    if fitting < len(records):
        return _said(f"ONLY the first {fitting} of {len(records)} rows fit", text), Ink.CAUTION
    return _said(what, text), Ink.NORMAL


def _name_of(record: Record) -> str:
    """Return the first value that says something, with its title."""
    values = ((title, cell_text(value)) for title, value in record.items())
    title, text = next(((title, text) for title, text in values if text), ("row", ""))
    return clean(f"{title.replace('_', ' ')} {text}".strip(), MAX_NAME_CELLS)


def copy_text(app: App[Any], what: str, text: str) -> Run:
    """Copy `text`, line by line cleaned, and return what is to be reported; `what` is what it is, in words."""
    safe = "\n".join(clean(line, MAX_LINE_CELLS) for line in text.splitlines())
    size = len(safe.encode())
    if size > MAX_COPIED_BYTES:
        return f"NOT copied: {what} has {size} bytes, terminals take {MAX_COPIED_BYTES}", Ink.CAUTION
    app.copy_to_clipboard(safe)
    return _said(what, safe), Ink.NORMAL


def _said(what: str, text: str) -> str:
    # The size first: on some screens there is one short line for it.
    return f"{len(text.encode())} bytes {COPIED}: {what}"


def below_report(report: Sequence[Run], text: str, ink: Ink) -> tuple[Run, ...]:
    """Return the first lines of a report without those of copies, and below them the line of a copy.

    Whoever answers a question that was not asked by `y` must still see why it was not.
    """
    kept = [line for line in report if COPIED not in line[0]]
    return (*kept[:MAX_KEPT_LINES], (clean(text, MAX_LINE_CELLS), ink))
