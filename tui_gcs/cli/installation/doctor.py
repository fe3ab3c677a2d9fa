"""`tui-gcs doctor`: what this computer lacks for flying, and the command that mends it."""

import argparse
import os
import sys

from tui_gcs.cli.command_report import CommandReport, finish
from tui_gcs.cli.exit_codes import ReportCode
from tui_gcs.cli.installation.checks import Diagnosis, Level, all_checks
from tui_gcs.core.base.text import clean

MAX_CELLS = 500


def run(arguments: argparse.Namespace) -> int:
    """Check, print a line for each finding, and return 0 only if nothing is bad."""
    found = all_checks(os.environ, sys.stdin.isatty() and sys.stdout.isatty())
    bad = [finding.subject for finding in found if finding.level is Level.BAD]
    if not arguments.json:
        sys.stdout.write("".join(map(_lines, found)))
    entries = [{"subject": f.subject, "level": f.level, "text": f.text, "mend": f.mend} for f in found]
    text = f"to be mended: {', '.join(bad)}" if bad else "nothing is to be mended"
    code = ReportCode.FAILED if bad else ReportCode.NONE
    return finish(arguments, CommandReport(not bad, code, text, {"checks": entries}))


def _lines(finding: Diagnosis) -> str:
    line = f"{finding.level:<5}{finding.subject:<14}{clean(finding.text, MAX_CELLS)}\n"
    return line + (f"{'':<19}mend: {clean(finding.mend, MAX_CELLS)}\n" if finding.mend else "")
