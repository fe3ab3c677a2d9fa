"""`tui-gcs vehicle list`, `show`, `failsafes`, `events`, `tasks` and `cancel`: what the station knows."""

import argparse
import math
import time
from collections.abc import Iterable, Iterator, Sequence

from msgspec.structs import asdict

from tui_gcs.cli.command_report import CommandReport, VehicleReport, finish
from tui_gcs.cli.exit_codes import CommandError, ReportCode
from tui_gcs.cli.vehicle.station_client import StationClient, reports_by_vehicle, say, tell_lines, tell_reply
from tui_gcs.cli.vehicle_numbers import listed, vehicle_ids
from tui_gcs.core.protocol.common import GetEvents, JournalEvent
from tui_gcs.core.protocol.event_scope import concerns
from tui_gcs.core.protocol.services import (
    CancelTask,
    FailsafeRow,
    GetTasks,
    GetVehicles,
    ReadFailsafes,
    TaskInfo,
    VehicleInfo,
)

MAX_EVENTS = 500


def run_list(station: StationClient, arguments: argparse.Namespace) -> int:
    """Print one line for each vehicle that the station knows."""
    vehicles = station.ask(GetVehicles()).vehicles
    if not arguments.json:
        if not vehicles:
            say("no vehicle was heard")
        for v in vehicles:
            armed = "ARMED" if v.armed else "-"
            say(f"{v.id:>4} {v.autopilot:<11} {v.firmware:<12} {v.mode:<10} {armed:<6} {v.freshness:<6} {_state(v)}")
    entries = tuple(VehicleReport(v.id, True, text=_state(v), data=asdict(v)) for v in vehicles)
    return finish(arguments, CommandReport(True, vehicles=entries))


def _state(v: VehicleInfo) -> str:
    problem = v.problems[0].text if v.problems and not v.ready else ""
    if not v.armed:
        return problem or ("ready" if v.ready else "not ready")
    # "ready" is said of a vehicle that can be started, never of one whose propellers turn.
    place = "in the air" if v.in_flight else "armed on the ground"
    return f"{place}; {problem}" if problem else place


def run_show(station: StationClient, arguments: argparse.Namespace) -> int:
    """Print everything about vehicles; unknown failsafes are read from them."""
    ids = vehicle_ids(arguments.ids)
    before = station.ask(GetVehicles(ids))
    unread = tuple(v.id for v in before.vehicles if not v.failsafes and v.freshness != "lost")
    if unread:
        station.carry_out(ReadFailsafes(unread))
    reply = station.ask(GetVehicles(ids))
    lines = (line for vehicle in reply.vehicles for line in _lines(vehicle))
    infos = {info.id: info for info in reply.vehicles}
    return tell_reply(arguments, reply, lines, reports_by_vehicle(reply, ids, lambda vehicle: asdict(infos[vehicle])))


def _lines(v: VehicleInfo) -> Iterator[str]:
    place = f" team {v.team}" if v.team else " in no team"
    yield f"vehicle {v.id}: {v.autopilot} {v.firmware} {v.type}{place}"
    network = f" network {v.network}" if v.network else ""
    yield f"  identity   system {v.system}{network} uid {v.uid or 'not told'}; {v.signing}"
    armed = "ARMED" + (", in the air" if v.in_flight else "") if v.armed else "disarmed"
    yield f"  state      {v.mode} {armed}; {v.freshness}, heard {v.heard_age_s:.1f} s ago"
    trip = f"round trip {v.rtt_s * 1e3:.0f} ms" if math.isfinite(v.rtt_s) else "round trip not measured"
    quality = f"{trip}; {v.loss_pct:.1f} % lost" if v.freshness != "lost" else "nothing is heard of it now"
    yield f"  links      {', '.join(v.links)}; {quality}"
    items = "mission not known" if v.mission_items is None else f"mission of {v.mission_items} items"
    current = f", at item {v.mission_current + 1}" if v.mission_items and v.mission_current is not None else ""
    params = "all parameters known" if v.params_complete else f"{v.params_known} parameters known"
    yield f"  holds      {items}{current}; {params}" + (f"; busy: {v.busy}" if v.busy else "")
    yield f"  health     {'armed' if v.armed else 'ready to arm' if v.ready else 'NOT READY'}"
    yield from (f"    {'!' if problem.blocks else '-'} {problem.text}" for problem in v.problems)
    if v.failsafes:
        yield from ["  failsafes", *_failsafes(v.failsafes)]


def _failsafes(rows: tuple[FailsafeRow, ...]) -> list[str]:
    return [f"    {'!' if row.warning else '-'} {row.when}: {row.does}" for row in rows]


def run_failsafes(station: StationClient, arguments: argparse.Namespace) -> int:
    """Read and print the failsafes of vehicles."""
    ended = station.carry_out(ReadFailsafes(vehicle_ids(arguments.ids)))
    return tell_lines(
        ended,
        lambda one: [f"vehicle {one.vehicle}", *_failsafes(one.result.failsafes)] if one.ok else [],
        arguments,
        "failsafes",
    )


def run_events(station: StationClient, arguments: argparse.Namespace) -> int:
    """Print the newest events of vehicles and the orders to them; with --follow new ones, too, a document for each."""
    ids = vehicle_ids(arguments.ids)
    if arguments.follow and arguments.output is not None:
        raise CommandError("--follow never ends, so there is no --output: redirect what is printed")
    reply = station.ask(GetVehicles(ids))
    if reply.results:
        text = f"{listed([r.vehicle for r in reply.results])}: {reply.results[0].text}"
        raise CommandError(text, ReportCode.REFUSED)
    entries = tuple(VehicleReport(vehicle, True) for vehicle in ids)
    after, last = 0, max(0, min(arguments.last, MAX_EVENTS))
    while True:
        events = station.ask(GetEvents(after=after)).events
        concerned = [event for event in events if concerns(event, ids)]
        shown = concerned[len(concerned) - last if last < len(concerned) else 0 :] if last else []
        if not arguments.json:
            _say_events(shown)
        elif shown and arguments.follow:
            finish(arguments, CommandReport(True, data={"events": shown}, vehicles=entries))
        if not arguments.follow:
            return finish(arguments, CommandReport(True, data={"events": shown}, vehicles=entries))
        after, last = max([after, *(event.seq for event in events)]), MAX_EVENTS
        station.pause()


def _say_events(events: Iterable[JournalEvent]) -> None:
    for event in events:
        clock = time.strftime("%H:%M:%S", time.localtime(event.wall_s))
        say(f"{clock} {event.source:<11} {_SEVERITY[event.severity & 7]:<9} {event.text}")


_SEVERITY = ("EMERGENCY", "ALERT", "CRITICAL", "ERROR", "warning", "notice", "info", "debug")


def run_tasks(station: StationClient, arguments: argparse.Namespace) -> int:
    """Print running and finished tasks."""
    tasks = station.ask(GetTasks()).tasks
    if not arguments.json:
        _say_tasks(tasks)
    of = {info.vehicle: [one for one in tasks if one.vehicle == info.vehicle] for info in tasks}
    entries = tuple(VehicleReport(vehicle, True, data={"tasks": of[vehicle]}) for vehicle in sorted(of))
    return finish(arguments, CommandReport(True, vehicles=entries))


def _say_tasks(tasks: Sequence[TaskInfo]) -> None:
    if not tasks:
        say("nothing was asked of any vehicle")
    for task in tasks:
        say(f"{task.number:>4} vehicle {task.vehicle:<4} {task.state:<9} {_far(task):<6} {task.what}  by {task.who}"
            + (f": {task.text}" if task.text else ""))  # fmt: skip


def _far(task: TaskInfo) -> str:
    return f"{100 * task.done // task.total} %" if task.total and not task.over else ""


def run_cancel(station: StationClient, arguments: argparse.Namespace) -> int:
    """Cancel a task by its number, whichever console began it."""
    reply = station.ask(CancelTask(arguments.task))
    if not arguments.json:
        say(reply.text)
    code = ReportCode.NONE if reply.ok else ReportCode.REFUSED
    return finish(arguments, CommandReport(reply.ok, code, reply.text, {"task": arguments.task}))
