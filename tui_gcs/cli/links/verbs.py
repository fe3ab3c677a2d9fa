"""The verbs of `tui-gcs link` and `tui-gcs forward`: one question to the running station each."""

import argparse
import math
import sys

import msgspec

from tui_gcs.cli.command_report import CommandReport, finish, finish_reply
from tui_gcs.cli.common import ask, join
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.station_control import which
from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.bus import Bus
from tui_gcs.core.protocol.link_report import (
    AddLink,
    AddPartner,
    CloseLink,
    ClosePartner,
    GetLinks,
    LinkReport,
    LinkRow,
    PartnerRow,
    SetLinkRate,
)
from tui_gcs.core.protocol.services import LinkChange, ServiceReply

ADVICE = ": the station may still do it; `list` shows"
NO_LIMIT = "none"
MAX_CELLS = 400


def run(arguments: argparse.Namespace) -> int:
    """Ask the running station; the exit code is 0 only if it did what was asked."""
    # What is wrong with a number is said without a station.
    change = None if arguments.what == "list" else change_of(arguments)
    bus = join(which(arguments.kind))
    try:
        if change is None:
            return show(report_of(bus), arguments)
        reply = ask(bus, change, ServiceReply, ADVICE)
    finally:
        bus.close()
    return finish_reply(arguments, ok=reply.ok, text=reply.text)


def change_of(arguments: argparse.Namespace) -> LinkChange:
    """Return the request that the arguments mean. Raises `CommandError`."""
    address = arguments.address.strip()
    if arguments.subject == "forward":
        return AddPartner(address, arguments.commands) if arguments.what == "add" else ClosePartner(address)
    if arguments.what == "rate":
        return SetLinkRate(address, bytes_per_s(arguments.bytes_per_s))
    return AddLink(address) if arguments.what == "add" else CloseLink(address)


def bytes_per_s(text: str) -> int | None:
    """Return the rate that was typed; None: no limit. Raises `CommandError`."""
    if text.casefold() == NO_LIMIT:
        return None
    if text.isascii() and text.isdecimal() and len(text) <= 12:
        return int(text)
    raise CommandError(f"{clean(text, 40)!r} is no rate: whole bytes per second, or none")


def report_of(bus: Bus) -> LinkReport:
    """Return links and partners as they are now. Raises `CommandError`."""
    reply = ask(bus, GetLinks(), ServiceReply, ADVICE)
    if reply.link_report is None:
        raise CommandError(clean(reply.text, MAX_CELLS) or "the station says nothing of its links")
    return reply.link_report


def show(report: LinkReport, arguments: argparse.Namespace) -> int:
    """Print links or partners, a line each."""
    rows: tuple[LinkRow | PartnerRow, ...] = report.links if arguments.subject == "link" else report.partners
    if not arguments.json:
        lines = [link_line(row) if isinstance(row, LinkRow) else partner_line(row) for row in rows]
        nothing = "the station has no link" if arguments.subject == "link" else "nothing is forwarded"
        sys.stdout.write("".join(f"{line}\n" for line in lines or [nothing]))
    name = "links" if arguments.subject == "link" else "partners"
    return finish(arguments, CommandReport(True, data={name: [msgspec.structs.asdict(row) for row in rows]}))


def link_line(row: LinkRow) -> str:
    """Return a link in one line."""
    limit = "no limit" if row.capacity_bytes_per_s is None else f"{row.capacity_bytes_per_s} B/s"
    options = [option for option, is_set in (("secure", row.secure), ("highlatency", row.high_latency)) if is_set]
    options += [f"network={row.network}"] if row.network else []
    traffic = f"{row.bytes_in / 1e3:.0f} kB in, {row.bytes_out / 1e3:.0f} kB out"
    parts = [f"{row.vehicles} vehicles", limit, *options, traffic, *([row.error] if row.error else []), origin(row)]
    return clean(f"{row.name}  {'up' if row.up else 'DOWN'}  {', '.join(parts)}", MAX_CELLS)


def partner_line(row: PartnerRow) -> str:
    """Return an endpoint and one station there in one line."""
    may = "commands are judged" if row.takes_commands else "listens"
    others = "others, or gone" if row.refused or row.passed else "nobody yet"
    heard = f", heard {row.heard_age_s:.0f} s ago" if row.address and math.isfinite(row.heard_age_s) else ""
    who = f"{row.address} {' '.join(row.systems)}".strip() + heard if row.address else others
    counts = f"{row.bytes_out / 1e3:.0f} kB out, {row.bytes_in / 1e3:.0f} kB in, {row.passed} frames reached vehicles"
    refused = ", ".join(f"{reason} {count}" for reason, count in sorted(row.refused.items()))
    parts = [may, who, counts, *([f"refused: {refused}"] if refused else []), *([row.error] if row.error else [])]
    return clean(f"{row.endpoint}  {'up' if row.up else 'DOWN'}  {'; '.join([*parts, origin(row)])}", MAX_CELLS)


def origin(row: LinkRow | PartnerRow) -> str:
    """Return who opened a link or an endpoint, and for how long."""
    if not row.is_added:
        return "given at the start"
    return "added, kept" if row.is_kept else "added, until the station ends"
