"""`tui-gcs planner log`: what the planners of the running station print and log, read through its bus."""

import argparse
import sys
import time
from datetime import UTC, datetime

import msgspec

from tui_gcs.cli.command_report import CommandReport, finish
from tui_gcs.cli.common import ask, join
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.planner.parser import LOG_LEVELS
from tui_gcs.cli.station_control import which
from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.bus import Bus
from tui_gcs.core.protocol.planner_log import GetPlannerLog, PlannerLogFilter, PlannerLogLine, PlannerLogPiece
from tui_gcs.core.protocol.services import ServiceReply

LOOK_S = 0.5
"""Time between two looks for new lines."""
MAX_LINES = 10_000


def run(arguments: argparse.Namespace) -> int:
    """Print the newest lines that fit, and with `--follow` those that come."""
    if not 0 <= arguments.lines <= MAX_LINES:
        raise CommandError(f"--lines: from 0 to {MAX_LINES}")
    if arguments.follow and (arguments.json or arguments.output):
        raise CommandError("--follow does not end by itself: leave out --json and --output")
    shown = PlannerLogFilter(arguments.words, arguments.team, LOG_LEVELS.index(arguments.level))
    bus = join(which(arguments.kind))
    try:
        newest = piece_of(bus, GetPlannerLog())
        lines = newest_lines(bus, newest, shown, arguments.lines)
        if not arguments.json:
            sys.stdout.write("".join(map(text_of, lines)))
        if arguments.follow:
            follow(bus, newest.end, shown)
    finally:
        bus.close()
    if newest.left_out:
        sys.stderr.write(f"{newest.left_out} lines were left out, because planners printed too many\n")
    rows = [msgspec.structs.asdict(line) | {"level": line.level.value} for line in lines]
    return finish(arguments, CommandReport(True, data={"file": newest.path, "lines": rows}))


def piece_of(bus: Bus, request: GetPlannerLog) -> PlannerLogPiece:
    """Return the piece that a request asks for. Raises `CommandError`."""
    reply = ask(bus, request, ServiceReply)
    if reply.planner_log is None:
        raise CommandError(clean(reply.text))
    return reply.planner_log


def newest_lines(bus: Bus, newest: PlannerLogPiece, shown: PlannerLogFilter, most: int) -> list[PlannerLogLine]:
    """Return the newest lines that fit, `most` of them, oldest first; older pieces are asked for as needed."""
    found = [line for line in newest.lines if shown.passes(line)]
    piece = newest
    while len(found) < most and not piece.is_oldest:
        piece = piece_of(bus, GetPlannerLog(piece.begin))
        found = [line for line in piece.lines if shown.passes(line)] + found
    return found[max(0, len(found) - most) :]


def follow(bus: Bus, place: int, shown: PlannerLogFilter) -> None:
    """Print new lines until Ctrl-C. Raises `CommandError` when the station is gone."""
    try:
        while True:
            piece = piece_of(bus, GetPlannerLog(place, newer=True))
            place = piece.end
            sys.stdout.write("".join(text_of(line) for line in piece.lines if shown.passes(line)))
            sys.stdout.flush()
            if not piece.lines:
                time.sleep(LOOK_S)
    except KeyboardInterrupt:
        return


def text_of(line: PlannerLogLine) -> str:
    """Return a line as it is printed; its texts were cleaned by the station."""
    when = datetime.fromtimestamp(line.wall_s, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    return f"{when} {line.team} {line.planner} {line.level:<8} {line.text}\n"
