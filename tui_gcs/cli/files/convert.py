"""`tui-gcs convert`: converts one file into another format, and reports what the other format cannot hold."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from tui_gcs.cli.command_report import CommandReport, finish
from tui_gcs.cli.exit_codes import CommandError, ReportCode
from tui_gcs.cli.files.file_access import (
    MAX_CELLS,
    may_write,
    missions_in,
    options_for,
    put,
    read_any,
    tell,
    written_data,
    written_text,
)

if TYPE_CHECKING:
    from tui_gcs.core.formats.file_types import Format


def run(arguments: argparse.Namespace) -> int:
    """Write the other file; the exit code is 0 if everything is in it, 1 if something had to be left out."""
    from tui_gcs.core.base.text import clean
    from tui_gcs.core.formats.content import FormatError

    source, target = Path(arguments.source), Path(arguments.target)
    target_format = _target(target, arguments.to)
    if (missions := missions_in(source)) is not None:
        from tui_gcs.cli.files.convert_missions import convert_missions

        return convert_missions(arguments, missions, target_format)
    if arguments.vehicle is not None:
        raise CommandError(f"--vehicle {arguments.vehicle}: only the missions screen's own file holds several vehicles")
    may_write(target, force=arguments.force)
    read = read_any(source, arguments.kind, arguments.home_line)
    from tui_gcs.core.formats.conversion import convert  # geometry, which a file that cannot be read does not wait for

    try:
        written = convert(read, target_format, options_for(arguments, target.stem))
    except FormatError as error:
        raise CommandError(f"{clean(str(source), MAX_CELLS)}: {clean(str(error), MAX_CELLS)}") from None
    put(target, written.data, force=arguments.force)
    text = written_text(target, written, target_format.text)
    if not arguments.json:
        tell(written)
        sys.stdout.write(f"{text}\n")
    code = ReportCode.FAILED if written.left_out else ReportCode.NONE
    return finish(arguments, CommandReport(not written.left_out, code, text, written_data(target, written)))


def _target(target: Path, to: str | None) -> "Format":
    from tui_gcs.core.formats.file_types import BY_NAME, KNOWN, format_of

    found = BY_NAME[to] if to is not None else format_of(target.name)
    if found is None:
        raise CommandError(f"{target}: an ending that names the format is needed ({KNOWN}), or --to FORMAT")
    return found
