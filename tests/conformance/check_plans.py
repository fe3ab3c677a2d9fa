"""Missions, fences and rally points that vehicles store. On the ground."""

import re

from tests.conformance.field import Failed, Field, NotApplicable
from tests.conformance.plans import (
    a_fence,
    a_mission,
    a_polygon,
    ended,
    finished,
    place,
    refusal,
    some_rally_points,
)
from tests.conformance.report import check
from tests.conformance.tidy import empty
from tui_gcs.core.firmware.plan_dialects import dialect_of
from tui_gcs.core.missions.plan_compare import compare
from tui_gcs.core.plans.model import LAND, POLYGON_OUT, TAKE_OFF, WAYPOINT, Plan, PlanItem, PlanKind

ITEMS, MANY_ITEMS = 40, 1000
TOO_MANY = 132
"""PX4 stores 64 and 32 (docs/autopilots.md); ArduPilot what its memory holds."""
LOSS, LOST_ITEMS = 0.10, 100


def read_back(field: Field, vehicle: int, plan: Plan) -> float:
    """What it holds is what was sent; how long reading took.

    Raises:
        Failed: It is not.
    """
    job = field.station.services.missions.download(vehicle, plan.kind)
    took_s = finished(field, job)
    if job.plan is None:
        raise Failed("nothing was read")
    compared = compare(plan, job.plan, dialect_of(field.vehicle(vehicle)))
    if not compared.same:
        raise Failed(f"what was read is not what was sent: {compared.differences[:3]}")
    return took_s


def _round_trip(field: Field, vehicle: int, plan: Plan) -> str:
    missions = field.station.services.missions
    up_s = finished(field, missions.upload(vehicle, plan))
    down_s = read_back(field, vehicle, plan)
    cleared_s = finished(field, missions.clear(vehicle, plan.kind))
    none = missions.download(vehicle, plan.kind)
    finished(field, none)
    if none.plan is None or none.plan.items:
        raise Failed("after clearing it is not empty")
    return f"{len(plan.items)} items up and compared in {up_s:.2f} s, down {down_s:.2f} s, cleared {cleared_s:.2f} s"


@check("mission: round trip")
def mission(field: Field, vehicle: int) -> str:
    """A mission of 40 items is put there, compared, read and cleared."""
    return _round_trip(field, vehicle, a_mission(field.vehicle(vehicle), ITEMS))


@check("fence: round trip")
def fence(field: Field, vehicle: int) -> str:
    """A polygon and a circle."""
    return _round_trip(field, vehicle, a_fence(field.vehicle(vehicle)))


@check("rally: round trip")
def rally(field: Field, vehicle: int) -> str:
    """Three rally points."""
    return _round_trip(field, vehicle, some_rally_points(field.vehicle(vehicle)))


@check("mission: 1000 items", takes_s=45.0)
def thousand(field: Field, vehicle: int) -> str:
    """1000 items up, down and compared; a vehicle with less room says so, and as many as fit are taken then."""
    v, missions = field.vehicle(vehicle), field.station.services.missions
    first = missions.upload(vehicle, a_mission(v, MANY_ITEMS))
    ended(field, first)
    items, why = MANY_ITEMS, ""
    if first.error:
        why = first.error
        reported = re.search(r"(\d+) items", " ".join(v.reasons_since(first.begun_s)) or why)
        items = min(int(reported[1]) - 2, MANY_ITEMS) if reported else MANY_ITEMS // 2
        empty(field, vehicle, PlanKind.MISSION)
    try:
        result = _round_trip(field, vehicle, a_mission(v, items))
    finally:
        empty(field, vehicle, PlanKind.MISSION)
    return f"{result}; {MANY_ITEMS} it refused: {why}" if why else result


@check("mission: what the vehicle rejects is told")
def rejected(field: Field, vehicle: int) -> str:
    """A command that no autopilot knows: the upload fails with a reason, and it is known what is on board then."""
    v = field.vehicle(vehicle)
    plan = Plan(PlanKind.MISSION, (place(v, 0, 0, 15.0, TAKE_OFF), place(v, 30, 0, 15.0, 9999), PlanItem(LAND)))
    try:
        return refusal(field, field.station.services.missions.upload(vehicle, plan), "a mission with command 9999")
    finally:
        empty(field, vehicle, PlanKind.MISSION)


@check("mission: one that cannot be flown")
def infeasible(field: Field, vehicle: int) -> str:
    """A mission that begins with landing: PX4 acknowledges it, and then says that it cannot be flown."""
    v = field.vehicle(vehicle)
    plan = Plan(PlanKind.MISSION, (place(v, 10, 0, 0.0, LAND), place(v, 30, 0, 15.0, WAYPOINT)))
    job = field.station.services.missions.upload(vehicle, plan)
    ended(field, job)
    try:
        if not job.error:
            held = read_back(field, vehicle, plan)
            raise NotApplicable(f"it takes missions unjudged: one that begins with a landing is held ({held:.2f} s)")
    finally:
        empty(field, vehicle, PlanKind.MISSION)
    return job.error


@check("fence: two corners are no fence")
def two_corners(field: Field, vehicle: int) -> str:
    """A polygon of two points is refused with a reason, and the fence from before stays."""
    v, missions = field.vehicle(vehicle), field.station.services.missions
    before = a_fence(v)
    finished(field, missions.upload(vehicle, before))
    try:
        why = refusal(field, missions.upload(vehicle, Plan(PlanKind.FENCE, a_polygon(v, 100.0, 2))), "two corners")
        read_back(field, vehicle, before)
    finally:
        empty(field, vehicle, PlanKind.FENCE)
    return f"{why}; the fence from before is still there"


@check("fence and rally: more than fit", takes_s=10.0)
def too_many(field: Field, vehicle: int) -> str:
    """132 corners and 132 rally points: held and right, or refused with a reason; never "uploaded" with less."""
    v, missions = field.vehicle(vehicle), field.station.services.missions
    said = []
    shapes = tuple(item for k in range(TOO_MANY // 3) for item in _triangle(field, vehicle, k))
    for plan in (Plan(PlanKind.FENCE, shapes), some_rally_points(v, TOO_MANY)):
        job = missions.upload(vehicle, plan)
        ended(field, job)
        try:
            if not job.error:
                read_back(field, vehicle, plan)
            said.append(f"{len(plan.items)} {plan.kind.word} items: {job.error or 'held'}")
        finally:
            empty(field, vehicle, plan.kind)
    return "; ".join(said)


def _triangle(field: Field, vehicle: int, number: int) -> tuple[PlanItem, ...]:
    """A small triangle to be kept out of, far from where anybody flies."""
    v, east_m = field.vehicle(vehicle), 1500.0 + 10.0 * number
    corners = ((east_m, 1500.0), (east_m + 5.0, 1500.0), (east_m, 1505.0))
    return tuple(place(v, x, y, 0.0, POLYGON_OUT, params=(3.0, 0.0, 0.0, 0.0)) for x, y in corners)


@check("mission: cancelled in the middle")
def cancelled(field: Field, vehicle: int) -> str:
    """A cancelled upload ends at once, and the next one is right."""
    v = field.vehicle(vehicle)
    missions, jobs = field.station.services.missions, field.station.comms.jobs
    job = missions.upload(vehicle, a_mission(v, 200))
    field.until(lambda: job.done > 3 or job.over, 60.0, "the upload begins")
    if job.over:
        raise NotApplicable("the upload was over before it could be cancelled")
    done = job.done
    jobs.cancel(vehicle)
    field.run(2.0)
    plan = a_mission(v, 5)
    up_s = finished(field, missions.upload(vehicle, plan))
    finished(field, missions.clear(vehicle, PlanKind.MISSION))
    return f"cancelled after {done} of 200 items; the next upload was right after {up_s:.2f} s"


@check("mission: over a link that loses 10 %", takes_s=30.0)
def lossy(field: Field, vehicle: int) -> str:
    """A tenth of all datagrams is lost, each way: the mission is there and right, or it is said that it is not."""
    if field.air.stream:
        raise NotApplicable("a stream link loses nothing")
    if field.alone():
        raise NotApplicable("several vehicles are behind one address")
    v = field.vehicle(vehicle)
    plan = a_mission(v, LOST_ITEMS)
    with field.air.losing(v.address, LOSS, vehicle) as (up, down):
        job = field.station.services.missions.upload(vehicle, plan)
        took_s = ended(field, job)
    try:
        if not job.error:
            read_back(field, vehicle, plan)
    finally:
        empty(field, vehicle, PlanKind.MISSION)
    lost = f"lost {up.tally.lost} of {up.tally.taken} up, {down.tally.lost} of {down.tally.taken} down"
    reported = f"said to have failed: {job.error}" if job.error else "there and right"
    return f"{LOST_ITEMS} items {reported} after {took_s:.1f} s ({lost})"
