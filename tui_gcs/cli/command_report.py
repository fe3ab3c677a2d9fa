"""How commands report to scripts: one document, by `--json` and `--output FILE`.

The shape is that of `CommandReport`; `vehicles` has one `VehicleReport` for each vehicle. What `data` holds for each
command stands in docs/reference/json.md, and the JSON schema beside it.
"""

import argparse
import contextlib
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, TextIO

import msgspec

from tui_gcs.cli.common import check_writable
from tui_gcs.cli.exit_codes import CANNOT, FAILED, OK, CommandError, ReportCode
from tui_gcs.core.base import regular_file
from tui_gcs.core.base.text import clean

MAX_REPLY_CELLS = 400


class VehicleReport(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The result for one vehicle."""

    vehicle: int
    ok: bool
    code: ReportCode = ReportCode.NONE
    text: str = ""
    data: dict[str, Any] = {}
    """What concerns this vehicle alone."""


class CommandReport(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The result of a command: `ok` only if all of it succeeded, as exit code 0 means."""

    ok: bool
    code: ReportCode = ReportCode.NONE
    text: str = ""
    data: dict[str, Any] = {}
    """What concerns no single vehicle."""
    vehicles: tuple[VehicleReport, ...] = ()
    """One entry for each vehicle that the command concerns, in the order in which they were named."""


def finish(arguments: argparse.Namespace, report: CommandReport, code: int | None = None) -> int:
    """Print the document if `--json` asks for it, write it if `--output` does, and return the exit code.

    The exit code is `code` if it is given, else 0 or 1 by `ok`; 2 if the file cannot be written.
    """
    exit_code = code if code is not None else OK if report.ok else FAILED
    if arguments.json:
        write_line(getattr(arguments, "standard_output", sys.stdout), report)
    # The result was printed before: a full disk takes nothing but the file.
    if arguments.output is not None and not _written(arguments.output, report):
        return CANNOT
    return exit_code


def finish_reply(arguments: argparse.Namespace, *, ok: bool, text: str) -> int:
    """Print what a station did, or on stderr why it refused, and report it; return the exit code."""
    shown = clean(text, MAX_REPLY_CELLS)
    if not (ok and arguments.json):
        (sys.stdout if ok else sys.stderr).write(f"{shown}\n")
    return finish(arguments, CommandReport(ok, ReportCode.NONE if ok else ReportCode.REFUSED, shown))


def check_output(arguments: argparse.Namespace) -> None:
    """Check before a long command that its document can be written to a file. Raises `CommandError`."""
    try:
        check_writable(arguments.output)
    except CommandError:
        arguments.output = None  # the error is not written there either
        raise


def write_line(stream: TextIO, report: CommandReport) -> None:
    """Write a document in one line. Numbers that are not finite are null: JSON has none."""
    stream.write(msgspec.json.encode(report).decode() + "\n")
    stream.flush()


def cannot_run(arguments: argparse.Namespace, error: BaseException, text: str, exit_code: int = CANNOT) -> int:
    """Report that a command could not run, where it takes `--json`; return the exit code."""
    if hasattr(arguments, "json") and hasattr(arguments, "output"):
        code = error.code if isinstance(error, CommandError) else ReportCode.CANNOT_RUN
        code = ReportCode.CANCELLED if isinstance(error, KeyboardInterrupt) else code
        finish(arguments, CommandReport(False, code, text), exit_code)
    return exit_code


@contextlib.contextmanager
def document_alone(arguments: argparse.Namespace) -> Iterator[None]:
    """Keep the standard output for the document, with `--json`: all else that is printed meanwhile goes to stderr."""
    if not getattr(arguments, "json", False):
        yield
        return
    arguments.standard_output = sys.stdout
    with contextlib.redirect_stdout(sys.stderr):
        yield


def of_vehicles(
    vehicles: Iterable[VehicleReport], text: str = "", data: Mapping[str, Any] | None = None
) -> CommandReport:
    """Return a report that is ok if there are vehicles and all of them are.

    Its code, and its text where none is given, are those of the first vehicle that is not ok. A command that found no
    vehicle at all has failed.
    """
    entries = tuple(vehicles)
    if not entries:
        return CommandReport(False, ReportCode.FAILED, text, dict(data or {}))
    bad = next((entry for entry in entries if not entry.ok), None)
    if bad is None:
        return CommandReport(True, ReportCode.NONE, text, dict(data or {}), entries)
    return CommandReport(False, bad.code, text or f"vehicle {bad.vehicle}: {bad.text}", dict(data or {}), entries)


def _written(file: str, report: CommandReport) -> bool:
    try:
        regular_file.check_writable(Path(file))  # a pipe without a reader would be waited for
        Path(file).write_bytes(msgspec.json.format(msgspec.json.encode(report), indent=2) + b"\n")
    except OSError as error:
        sys.stderr.write(f"tui-gcs: {file}: cannot be written ({error.strerror}); the result is as printed above\n")
        return False
    return True
