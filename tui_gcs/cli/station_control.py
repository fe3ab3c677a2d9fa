"""`tui-gcs attach`, `status`, `stop`: control of a station that runs."""

import argparse
import sys
import threading
import time
from typing import TYPE_CHECKING

from tui_gcs.cli.common import join, need_terminal, running
from tui_gcs.cli.exit_codes import CommandError, ReportCode
from tui_gcs.cli.vehicle_numbers import named_vehicles
from tui_gcs.core.base.run_kind import RunKind

if TYPE_CHECKING:
    from tui_gcs.core.protocol.common import Alarm, FleetFrame, LinkStatus, StationStatus, TeamStatus

STATUS_WAIT_S = 3.0
STOP_LIMIT_S = 10.0


def run(arguments: argparse.Namespace) -> int:
    """Find the station that the arguments name, and do what they ask for."""
    kind = which(arguments.kind)
    if arguments.what == "attach":
        need_terminal(small=True)
        from tui_gcs.cli.console import attach, preferences

        return attach(kind, preferences(arguments))
    return _stop(kind, arguments) if arguments.what == "stop" else _status(kind, arguments)


def which(named: str | None) -> RunKind:
    """Return the kind of the station that runs, or that is named. Raises `CommandError`."""
    kinds = [RunKind(named.upper())] if named else [kind for kind in (RunKind.SIM, RunKind.LIVE) if running(kind)]
    if len(kinds) > 1:
        raise CommandError("a SIM and a LIVE station run: say which with --kind")
    if not kinds or not running(kinds[0]):
        raise CommandError("no station runs: `tui-gcs demo` or `tui-gcs fly` starts one")
    return kinds[0]


def _stop(kind: RunKind, arguments: argparse.Namespace) -> int:
    from tui_gcs.cli.command_report import CommandReport, finish
    from tui_gcs.core.protocol.bus import BusError
    from tui_gcs.core.protocol.common import Reply, Shutdown, decode, encode

    lost = named_vehicles(arguments.lost)
    bus = join(kind)
    try:
        reply = decode(bus.ask("gcs/req/cli", encode(Shutdown(lost=lost)), timeout_s=5.0), Reply)
    except BusError as error:
        raise CommandError(str(error)) from None
    finally:
        bus.close()
    if not arguments.json:
        sys.stdout.write(f"{kind}: {reply.text}\n")
    data = {"kind": kind.value}
    if not reply.ok:
        return finish(arguments, CommandReport(False, ReportCode.REFUSED, reply.text, data))
    end = time.monotonic() + STOP_LIMIT_S
    while running(kind):  # so that the next command finds nothing half-alive
        if time.monotonic() > end:
            raise CommandError(f"the {kind} station is still there after {STOP_LIMIT_S:.0f} s")
        time.sleep(0.05)
    return finish(arguments, CommandReport(True, ReportCode.NONE, reply.text, data))


def newest(kind: RunKind) -> tuple["StationStatus", "FleetFrame"]:
    """Return the newest status and fleet frame of the running station. Raises `CommandError`."""
    from tui_gcs.core.protocol import bus as keys
    from tui_gcs.core.protocol.common import FleetFrame, StationStatus, decode

    bus = join(kind)
    got: dict[str, bytes] = {}
    both = threading.Event()

    def take(key: str, data: bytes) -> None:
        got[key] = data
        if len(got) == 2:
            both.set()

    bus.subscribe(keys.FLEET, take)
    bus.subscribe(keys.STATUS, take)
    heard = both.wait(STATUS_WAIT_S)
    bus.close()
    if not heard:
        raise CommandError(f"the {kind} station publishes no status")
    return decode(got[keys.STATUS], StationStatus), decode(got[keys.FLEET], FleetFrame)


def _status(kind: RunKind, arguments: argparse.Namespace) -> int:
    import msgspec

    from tui_gcs.cli.command_report import CommandReport, VehicleReport, finish

    status, frame = newest(kind)
    if not arguments.json:
        sys.stdout.write(_words(status, frame))
    vehicles = tuple(VehicleReport(row.id, True, data=row._asdict()) for row in frame.rows())
    return finish(arguments, CommandReport(True, data=msgspec.structs.asdict(status), vehicles=vehicles))


def _link_words(link: "LinkStatus") -> str:
    """Return the line about a link: what came over it, and what is wrong with it."""
    network = f" network {link.network}" if link.network else ""
    wrong = {
        "lost in the kernel": link.kernel_drops,
        "not sent": link.send_refused,
        "junk bytes": link.bad,
        "bad CRC": link.bad_crc,
    }
    parts = [f"{count} {name}" for name, count in wrong.items() if count]
    parts += [part for part in (link.radio, link.error) if part]
    frames = f"{link.frames} frames, " if link.frames else ""
    traffic = f"{frames}{link.bytes_in / 1e3:.0f} kB in, {link.bytes_out / 1e3:.0f} kB out"
    return f"{link.name}{network}  {'up' if link.up else 'DOWN'}  {', '.join([traffic, *parts])}"


def count_lines(status: "StationStatus") -> list[str]:
    """Return a line for each kind of count since the start that is not empty, the largest number first."""
    from tui_gcs.core.base.text import clean

    counts = {"faults": status.faults, "guard vetoes": status.vetoes, "received, not used": status.dropped}
    return [
        f"{what}: " + ", ".join(f"{n:,} {clean(why)}" for why, n in sorted(of.items(), key=lambda item: -item[1]))
        for what, of in counts.items()
        if of
    ]


def _error_lines(team: "TeamStatus") -> list[str]:
    """Return what a team's planner reported when it failed."""
    lines = team.error.splitlines()
    return [f"planner of {team.name} failed, {team.worker}: {lines[-1]}", *(f"  {line}" for line in lines[:-1])]


def _alarm_words(alarm: "Alarm") -> str:
    """Return the line about an alarm: whether it was acknowledged, and what to do."""
    from tui_gcs.core.protocol.alarms import action_words

    return f"{alarm.level.name} {alarm.state}  {alarm.words()}  -> {action_words(alarm.action, {})}"


def _words(status: "StationStatus", frame: "FleetFrame") -> str:
    from tui_gcs.core.base.text import clean
    from tui_gcs.core.protocol.metric_names import all_words
    from tui_gcs.core.protocol.preflight import count_words

    minutes, seconds = divmod(int(status.mission_time_s), 60)
    lines = [
        f"{status.kind} {status.scenario}  {status.rounds[status.round_index]}  {status.run}"
        f"  T+{minutes:02}:{seconds:02}  heard {status.heard}/{status.vehicles}  armed {status.armed}"
    ]
    lines += [_alarm_words(alarm) for alarm in status.alarms]
    if status.preflight:
        lines.append(f"checks before a start: {count_words(status.preflight)}  (tui-gcs preflight)")
    lines += [f"planner {name}: {clean(file)}" for name, file in status.planner_files.items()]
    lines += [line for team in status.teams if team.error for line in _error_lines(team)]
    lines += [f"{t.planner} of {t.name}: {'; '.join(all_words(t.metrics))}" for t in status.teams if t.metrics]
    lines += [f"link {_link_words(link)}" for link in status.links]
    lines += [f"forward {_link_words(link)}" for link in status.forward]
    lines += count_lines(status)
    lines += [
        f"{row.id:>4} {row.team:<10} {row.mode:<10} {'armed' if row.armed else '-':<6}{row.phase:<10} "
        f"{row.position_m[2]:7.1f} m {row.battery_pct:4.0f} % {row.freshness:<6} {row.signing}"
        + f"  {row.link}"
        + (f"  {row.problem}" if row.problem else "")
        for row in frame.rows()
    ]
    return "\n".join(lines) + "\n"
