"""Missions flown."""

import math

from tests.conformance.field import Failed, Field
from tests.conformance.pilot import flying
from tests.conformance.plans import finished, place
from tests.conformance.report import check
from tests.conformance.tidy import empty
from tui_gcs.core.plans.model import TAKE_OFF, WAYPOINT, Plan, PlanKind

LEG_M = 25.0
ITEM_LIMIT_S = 60.0


def a_square(field: Field, vehicle: int, height_m: float) -> Plan:
    """Take off, then the corners of a square north-east of the vehicle."""
    v = field.vehicle(vehicle)
    corners = ((0.0, LEG_M), (LEG_M, LEG_M), (LEG_M, 0.0))
    points = [place(v, x, y, height_m, WAYPOINT) for x, y in corners]
    return Plan(PlanKind.MISSION, (place(v, 0.0, 0.0, height_m, TAKE_OFF), *points))


@check("mission: flown item by item", takes_s=110.0)
def flown(field: Field, vehicle: int) -> str:
    """A mission put there in the air is flown: every item shows, pause stops it, it goes on where it was."""
    missions = field.station.services.missions
    with flying(field, vehicle) as pilot:
        v = pilot.vehicle
        finished(field, missions.upload(vehicle, a_square(field, vehicle, pilot.height_m + 3.0)))
        began_s = field.clock.now()
        pilot.must(pilot.firmware.mission_start(v, pilot.done))
        field.until(lambda: (missions.state(vehicle).current or 0) >= 2, ITEM_LIMIT_S, "item 3 is flown to")
        pilot.must(pilot.firmware.hold(v, lambda: v.telemetry.position_m))
        field.until(lambda: v.telemetry.ground_speed_m_s < 0.5, 15.0, "it stands after the pause")
        at, paused_at = missions.state(vehicle).current, v.telemetry.position_m
        field.run(3.0)
        drift_m = math.dist(v.telemetry.position_m, paused_at)
        pilot.must(pilot.firmware.mission_continue(v))
        field.until(lambda: missions.state(vehicle).reached == 3, 2 * ITEM_LIMIT_S, "the last item is reached")
        took_s = field.clock.now() - began_s
    empty(field, vehicle, PlanKind.MISSION)
    if drift_m > 2.0:
        raise Failed(f"moved {drift_m:.1f} m while paused, allowed 2 m")
    return f"4 items in {took_s:.0f} s; paused before item {(at or 0) + 1}, moved {drift_m:.1f} m in 3 s, went on"


@check("mission: the next item chosen in flight", takes_s=80.0)
def chosen(field: Field, vehicle: int) -> str:
    """While it flies its mission it is sent to the last item: it goes there, and leaves the others out."""
    missions = field.station.services.missions
    with flying(field, vehicle) as pilot:
        v = pilot.vehicle
        finished(field, missions.upload(vehicle, a_square(field, vehicle, pilot.height_m + 3.0)))
        pilot.must(pilot.firmware.mission_start(v, pilot.done))
        field.until(lambda: (missions.state(vehicle).current or 0) >= 1, ITEM_LIMIT_S, "item 2 is flown to")
        pilot.ended.clear()
        why = missions.set_current(vehicle, 3, pilot.done)
        if why:
            raise Failed(f"item 4: {why}")
        took_s = field.until(lambda: bool(pilot.ended), 20.0, "an end of choosing item 4")
        field.until(lambda: missions.state(vehicle).reached == 3, ITEM_LIMIT_S, "item 4 is reached")
    empty(field, vehicle, PlanKind.MISSION)
    return f"item 4 is current {took_s:.2f} s after it was asked for, and reached"
