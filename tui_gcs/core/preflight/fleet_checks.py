"""Checks before a start about the fleet and the station as a whole."""

import time
from collections.abc import Iterator

from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.mavlink.enum_names import autopilot_name
from tui_gcs.core.protocol.common import Freshness, Phase
from tui_gcs.core.protocol.preflight import Check, CheckState
from tui_gcs.core.records.rehearsal_store import RehearsalRecord
from tui_gcs.core.station.assembly import StationParts

_REHEARSE = "`tui-gcs rehearse` with this file and these planners"


def complete(parts: StationParts) -> Iterator[Check]:
    """Lines about vehicles of the scenario that were never heard, or are LOST on the ground."""
    now = parts.records.clock.now()
    heard = {v.id for v in parts.picture.fleet.vehicles.values() if v.freshness(now) is not Freshness.LOST}
    expected = parts.active.scenario.vehicle_count
    here = [flight.vehicle for flight in parts.flight.flights if flight.vehicle in heard]
    absent = tuple(v for team in parts.active.scenario.teams for v in team.vehicles if v not in heard)
    if len(here) < expected:
        text = f"{len(here)} of the scenario's {expected} are heard"
        yield Check("heard", CheckState.WARN, text, "switch the others on, or start without them", absent)


def links(parts: StationParts) -> Iterator[Check]:
    """Lines about links that have failed."""
    for link in parts.comms.links.values():
        if link.error:
            yield Check("links", CheckState.WARN, f"{link.name} is DOWN: {link.error}", "see its cable, or its address")


def recording(parts: StationParts) -> Check:
    """The line about the telemetry log and the journal."""
    problems = [p for p in (parts.records.recorder.error, parts.records.journal.error) if p]
    if problems:
        return Check("recording", CheckState.WARN, f"NOT RECORDING: {'; '.join(problems)}", "make room on the disk")
    return Check("recording", CheckState.OK, parts.records.recorder.path.name)


def rehearsal(parts: StationParts, found: RehearsalRecord | None) -> Check:
    """The line that compares what would be flown with `found`, the newest rehearsal of exactly that."""
    if found is None:
        return Check("rehearsal", CheckState.FAIL, "this plan was not rehearsed, or was changed since", _REHEARSE)
    when = time.strftime("%Y-%m-%d %H:%M", time.localtime(found.wall_s))
    good = f"{found.checks_good} of {found.checks} checks held"
    if not found.passed:
        text = f"rehearsed {when} and NOT passed: {good}" + (f" ({found.problem})" if found.problem else "")
        return Check("rehearsal", CheckState.FAIL, text, f"change the plan, then {_REHEARSE}")
    text = f"passed {when}: {good}" + (f" with {found.conditions}" if found.conditions else "")
    if other := _others(parts, found):
        return Check("rehearsal", CheckState.WARN, f"{text}; {other}", "rehearse it with --autopilot of that kind")
    return Check("rehearsal", CheckState.OK, text)


def _others(parts: StationParts, found: RehearsalRecord) -> str:
    """Autopilots that will fly and were not rehearsed."""
    rehearsed = {"ardupilot", "px4"} if found.autopilots == "mixed" else {found.autopilots}
    heard = [v for f in parts.flight.flights if (v := parts.picture.fleet.vehicles.get(f.vehicle)) is not None]
    flown = {autopilot_name(vehicle.autopilot).casefold() for vehicle in heard}
    missing = ", ".join(sorted(flown - rehearsed))
    return f"but with {found.autopilots} only, not with {missing}" if missing else ""


def on_ground(parts: StationParts) -> tuple[int, ...]:
    """The vehicles of teams that a start could be about."""
    return tuple(flight.vehicle for flight in parts.flight.flights if flight.phase is Phase.GROUND)


def is_live(parts: StationParts) -> bool:
    """Whether checks that only real vehicles need are made."""
    return parts.config.kind is RunKind.LIVE
