"""Checks before a start about single vehicles; the checklist groups vehicles of which the same is true."""

from collections.abc import Iterator
from dataclasses import dataclass

from tui_gcs.core.firmware.own_limits import AskedMotion
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.start_controller import MIN_CLIMB_M_S
from tui_gcs.core.plans.model import Plan, PlanKind, fence_shapes
from tui_gcs.core.preflight.readiness import Readiness
from tui_gcs.core.protocol.preflight import FAILSAFES, CheckState
from tui_gcs.core.services.plans.plan_table import HeldPlan
from tui_gcs.core.services.vehicle.failsafe_service import FailsafeLine
from tui_gcs.core.station.assembly import StationParts

BAD_LOSS_PCT = 20.0
"""The share of lost frames from which on the list mentions a vehicle's link."""
TODO = {
    "heard": "switch it on, look at its link; or start without it",
    "ids": "give each vehicle an id and a key of its own; or start without it",
    "gps": "wait, or move it to where it sees the sky",
    "battery": "charge or change it",
    "arming": "see `tui-gcs vehicle show`; or start without it",
    "place": "carry it to its place, or change the scenario",
    "planner": "see the planner's error on the fly screen",
}
"""The advice for each check that keeps a vehicle on the ground."""
_READ = "it is read when the list is opened; R reads it again"
_SET = "set the parameter; or acknowledge the finding"
_UPLOAD = "upload ours, or clear it: `tui-gcs vehicle plan`"


@dataclass(frozen=True)
class CheckFinding:
    """The result of one check for one vehicle."""

    name: str
    """The name of the check."""
    state: CheckState
    text: str
    todo: str = ""
    hard: bool = False


def standing(readiness: Readiness, vehicle_id: int) -> Iterator[CheckFinding]:
    """Reasons of `Readiness`, one line for each check: those that block, or else those that are only to be known."""
    listed: set[str] = set()
    for group in readiness.groups(vehicle_id):
        for name in dict.fromkeys(reason.check for reason in group):
            if name in listed:
                continue
            listed.add(name)
            reasons = [reason for reason in group if reason.check == name]
            blocking = [reason for reason in reasons if reason.blocks]
            text = "; ".join(dict.fromkeys(reason.text for reason in blocking or reasons))
            state = CheckState.FAIL if blocking else CheckState.WARN
            yield CheckFinding(name, state, text, TODO[name] if blocking else "", hard=bool(blocking))


def link_quality(vehicle: Vehicle) -> Iterator[CheckFinding]:
    """A line if many of its frames are lost on the way."""
    if vehicle.loss_pct >= BAD_LOSS_PCT:
        text = f"a fifth of its frames or more are lost on {vehicle.link}"
        yield CheckFinding("links", CheckState.WARN, text, "bring antennas nearer, or give it a second link")


def failsafes(parts: StationParts, vehicle: Vehicle) -> Iterator[CheckFinding]:
    """Failsafes of a vehicle that do nothing, do something dangerous, or are not known: they must be acknowledged."""
    service = parts.services.failsafes
    lines = service.report(vehicle)
    for name in FAILSAFES:
        about = [line for line in lines if line.check == name]
        bad = [line for line in about if line.warning]
        if not service.known(vehicle):
            yield CheckFinding(name, CheckState.UNKNOWN, "its parameters are not read yet", _READ)
        elif bad:
            yield CheckFinding(name, CheckState.FAIL, _words(bad), _SET)
        elif about:
            yield CheckFinding(name, CheckState.OK, _words(about))


def own_limits(parts: StationParts, vehicle: Vehicle) -> Iterator[CheckFinding]:
    """A line if the vehicle's own parameters keep it from flying what the scenario asks of it."""
    kind, flight = parts.active.scenario.class_of(vehicle.id), parts.flight.flights.get(vehicle.id)
    asked = AskedMotion(kind.speed_m_s, kind.accel_m_s2, MIN_CLIMB_M_S, flight.layer_m if flight else 0.0)
    if problems := parts.services.failsafes.limit_problems(vehicle, asked):
        todo = "raise the parameter, or lower the scenario's limit"
        yield CheckFinding("planner", CheckState.WARN, "; ".join(problems), todo)


def plans_on_board(parts: StationParts, vehicle: Vehicle) -> Iterator[CheckFinding]:
    """Whether fence, mission and rally points on board are those that this station put there."""
    plans = parts.services.missions.registry
    held = plans.state(vehicle.id).held
    yield _fence(held[PlanKind.FENCE])
    for kind in (PlanKind.MISSION, PlanKind.RALLY):
        if plans.to_read(vehicle.id, kind):
            yield CheckFinding(
                "mission", CheckState.UNKNOWN, f"{kind.word} that was uploaded: not read again yet", _READ
            )
        else:
            yield from _mission(kind, held[kind])


def _fence(held: HeldPlan) -> CheckFinding:
    if broken := _broken(PlanKind.FENCE, held):
        return broken
    if not held.known or held.plan is None:
        return CheckFinding("fence", CheckState.UNKNOWN, "not read yet", _READ)
    count = len(fence_shapes(held.plan.items))
    shapes = f"{count} shape{'s' if count != 1 else ''}"
    if not count:
        text = "no fence on board: nothing but this station keeps it inside"
        return CheckFinding("fence", CheckState.WARN, text, "upload one: `tui-gcs vehicle plan upload --kind fence`")
    if held.ours:
        return CheckFinding("fence", CheckState.OK, f"{shapes}, as uploaded and read back")
    return CheckFinding("fence", CheckState.FAIL, f"{shapes} on board that this station did not put there", _UPLOAD)


def _mission(kind: PlanKind, held: HeldPlan) -> Iterator[CheckFinding]:
    if broken := _broken(kind, held):
        yield broken
    elif held.known and held.plan is not None and held.plan.items:
        yield _whole(kind, held.plan, ours=held.ours)


def _whole(kind: PlanKind, plan: Plan, *, ours: bool) -> CheckFinding:
    count = f"{kind.word} of {len(plan.items)} items"
    if ours:
        return CheckFinding("mission", CheckState.OK, f"{count}, as uploaded and read back")
    return CheckFinding("mission", CheckState.WARN, f"{count} that this station did not put there", _UPLOAD)


def _broken(kind: PlanKind, held: HeldPlan) -> CheckFinding | None:
    """A plan of ours that is on board only in part, or was changed since; None if neither."""
    name = "fence" if kind is PlanKind.FENCE else "mission"
    if held.partial:
        return CheckFinding(
            name, CheckState.FAIL, f"{kind.word}: the upload failed, only its beginning is there", _UPLOAD
        )
    if held.stale and (held.ours or kind is PlanKind.FENCE):
        return CheckFinding(name, CheckState.FAIL, f"{kind.word} on board was changed: {held.stale}", _UPLOAD)
    return None


def _words(lines: list[FailsafeLine]) -> str:
    return "; ".join(f"{line.when}: {line.does}" for line in lines)
