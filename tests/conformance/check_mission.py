"""Missions flown, and what stands in their way."""

import math

from tests.conformance.check_data import finished, place
from tests.conformance.check_flight import Pilot, flying
from tests.conformance.field import Failed, Field
from tests.conformance.report import check
from tui_gcs.core.plan import TAKE_OFF, WAYPOINT, Plan, PlanKind
from tui_gcs.core.services.order import Retry

LEG_M = 25.0
ITEM_LIMIT_S = 60.0


def a_square(field: Field, vehicle: int) -> Plan:
    """Take off, then the corners of a square north-east of the vehicle."""
    v = field.vehicle(vehicle)
    corners = ((0.0, LEG_M), (LEG_M, LEG_M), (LEG_M, 0.0))
    points = [place(v, x, y, 15.0, WAYPOINT) for x, y in corners]
    return Plan(PlanKind.MISSION, (place(v, 0.0, 0.0, 15.0, TAKE_OFF), *points))


@check("mission: flown item by item")
def flown(field: Field, vehicle: int) -> str:
    """A mission put there in the air is flown: every item shows, pause stops it, it goes on where it was."""
    missions = field.station.services.missions
    with flying(field, vehicle) as pilot:
        v = pilot.vehicle
        plan = a_square(field, vehicle)
        finished(field, missions.upload(vehicle, plan))
        began_s = field.clock.now()
        pilot.must(pilot.firmware.mission_start(v, pilot.done))
        pilot.ended.clear()
        field.until(lambda: (missions.state(vehicle).current or 0) >= 2, ITEM_LIMIT_S, "item 3 is flown to")
        pilot.must(pilot.firmware.mission_pause(v))
        field.until(lambda: v.ground_speed_m_s < 0.5, 15.0, "it stands after the pause")
        at, paused_at = missions.state(vehicle).current, v.position_m
        field.run(3.0)
        drift_m = math.dist(v.position_m, paused_at)
        pilot.must(pilot.firmware.mission_continue(v))
        field.until(lambda: missions.state(vehicle).reached == 3, 2 * ITEM_LIMIT_S, "the last item is reached")
        took_s = field.clock.now() - began_s
    finished(field, missions.clear(vehicle, PlanKind.MISSION))
    if drift_m > 2.0:
        raise Failed(f"moved {drift_m:.1f} m while paused")
    return f"4 items in {took_s:.0f} s; paused before item {(at or 0) + 1}, moved {drift_m:.1f} m in 3 s, went on"


@check("refusal: arming where the mode does not allow it")
def arm_refused(field: Field, vehicle: int) -> str:
    """In its mission mode without a mission it does not arm, and the operator learns why."""
    pilot = Pilot(field, vehicle)
    v = pilot.vehicle
    pilot.down()
    services = field.station.services
    finished(field, services.missions.clear(vehicle, PlanKind.MISSION))
    number = services.modes.number(v, "mission") or services.modes.number(v, "auto")
    if number is None:
        raise Failed("no word for its mission mode")
    pilot.order(pilot.firmware.mode(v, number, "mission mode", Retry.SET))
    field.run(2.0)
    outcome, why, took_s = pilot.order(pilot.firmware.arm(v, pilot.done))
    armed = v.armed
    pilot.must(pilot.firmware.prepare(v, pilot.done))
    if armed:
        raise Failed("it armed")
    if not why:
        raise Failed(f"{outcome.value} after {took_s:.1f} s, without a reason")
    return f"{outcome.value} after {took_s:.2f} s: {why}"
