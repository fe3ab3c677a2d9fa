"""`tui-gcs preflight`: the checks before a start of the running station; acknowledging and signing them."""

import argparse
import sys
import time
from textwrap import wrap

from tui_gcs.cli.command_report import CommandReport, finish
from tui_gcs.cli.common import join, login_name
from tui_gcs.cli.exit_codes import CommandError, ReportCode
from tui_gcs.cli.station_control import which
from tui_gcs.core.protocol.bus import BusError
from tui_gcs.core.protocol.common import PROTOCOL, AnyRequest, Hello, Reply, StationStatus, decode, encode
from tui_gcs.core.protocol.preflight import (
    CHECKLIST,
    FAILSAFES,
    STOPS,
    AcknowledgeCheck,
    Check,
    CheckState,
    ReadChecks,
    SignOff,
    TickItem,
    count_words,
    well,
)
from tui_gcs.core.protocol.zenoh_bus import ZenohBus

READ_S = 15.0
"""How long vehicles get to report what the station does not know yet."""
LOOK_S = 0.5
ASK_S = 5.0
CELLS = 80


def run(arguments: argparse.Namespace) -> int:
    """Read the checks, acknowledge, sign and print them. The exit code is 0 only if no check refuses a start."""
    kind = which(arguments.kind)
    bus = join(kind)
    try:
        status = _read(bus, anew=arguments.read_again)
        operator = arguments.operator or login_name()
        for name in arguments.acknowledge:
            _acknowledge(bus, status, name, operator)
        for text in arguments.tick:
            _tick(bus, status, text, operator)
        status = _status(bus)
        if arguments.sign:
            _done(_ask(bus, SignOff(operator, status.revision)))
            status = _status(bus)
    finally:
        bus.close()
    checks = status.preflight
    if not arguments.json:
        sys.stdout.write(words(checks))
    stops = [check.name for check in checks if check.state in STOPS]
    code = ReportCode.FAILED if stops else ReportCode.NONE
    text = f"a start is refused by: {', '.join(stops)}" if stops else "no check refuses a start"
    return finish(arguments, CommandReport(not stops, code, text, {"checks": checks}))


def words(checks: tuple[Check, ...]) -> str:
    """Return the list of checks as text; checks that pass are listed by name only."""
    if not checks:
        return "no vehicle of a team is on the ground: there is nothing to check\n"
    quiet = (CheckState.OK, CheckState.NOT_NEEDED)
    lines = [f"checks before a start: {count_words(checks)}"]
    for check in checks:
        if check.state in quiet:
            continue
        lines += wrap(f"{check.state.upper():<13}{check.words()}", CELLS, subsequent_indent=" " * 13)
        if check.todo:
            lines += wrap(f"-> {check.todo}", CELLS, initial_indent=" " * 13, subsequent_indent=" " * 16)
    for state in quiet:
        if names := well(checks, state):
            lines += wrap(f"{state.upper():<13}{', '.join(names)}", CELLS, subsequent_indent=" " * 13)
    return "\n".join(lines) + "\n"


def _read(bus: ZenohBus, *, anew: bool) -> StationStatus:
    """Have the station read from the vehicles what it does not know, and wait for that."""
    _ask(bus, ReadChecks(anew=anew))
    end_s = time.monotonic() + READ_S
    while True:
        status = _status(bus)
        waits = any(check.state is CheckState.UNKNOWN for check in status.preflight)
        if not waits or time.monotonic() > end_s:
            return status
        time.sleep(LOOK_S)


def _acknowledge(bus: ZenohBus, status: StationStatus, name: str, operator: str) -> None:
    """Accept everything that this check reports as it is."""
    if name not in FAILSAFES:
        raise CommandError(f"--acknowledge {name!r}: what can be acknowledged: {', '.join(FAILSAFES)}")
    for check in status.preflight:
        if check.name == name and check.state is CheckState.FAIL:
            _done(_ask(bus, AcknowledgeCheck(check.name, check.text, operator, check.vehicles)))


def _tick(bus: ZenohBus, status: StationStatus, text: str, operator: str) -> None:
    """Tick the item of the scenario's checklist that is meant by its text, or by how only it begins."""
    items = [check.text for check in status.preflight if check.name == CHECKLIST]
    meant = [item for item in items if item == text] or [item for item in items if item.startswith(text)]
    if len(meant) != 1:
        wrong = "is the beginning of several items" if meant else "is no item of the checklist"
        raise CommandError(f"--tick {text!r} {wrong}; there are: {'; '.join(items) or 'none'}")
    _done(_ask(bus, TickItem(meant[0], operator)))


def _done(reply: Reply) -> None:
    if not reply.ok:
        raise CommandError(reply.text, ReportCode.REFUSED)
    sys.stderr.write(f"{reply.text}\n")


def _status(bus: ZenohBus) -> StationStatus:

    reply = _ask(bus, Hello(protocol=PROTOCOL, who="cli"))
    if reply.status is None:
        raise CommandError(reply.text)
    return reply.status


def _ask(bus: ZenohBus, request: AnyRequest) -> Reply:

    try:
        return decode(bus.ask("gcs/req/cli", encode(request), timeout_s=ASK_S), Reply)
    except BusError as error:
        raise CommandError(str(error)) from None
