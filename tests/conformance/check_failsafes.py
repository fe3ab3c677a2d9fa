"""What vehicles do by themselves: provoked by their own parameters, which are put back afterwards. They fly."""

import math

from tests.conformance.borrow import borrow, give_back, have, read
from tests.conformance.field import Failed, Field, NotApplicable
from tests.conformance.pilot import Pilot, flying
from tests.conformance.plans import a_polygon, finished
from tests.conformance.report import check
from tests.conformance.tidy import empty
from tui_gcs.core.plans.model import Plan, PlanKind
from tui_gcs.core.uplink.actions import MavCommand

SILENCE_S = 12.0
OWN_SYSTEM = 255
BATTERY_RESET = 42651
"""MAV_CMD_BATTERY_RESET: ArduPilot's battery failsafe stays until then (docs/autopilots.md)."""
FENCE_M, FENCE_SPEED_M_S, FENCE_FLIGHT_S = 40.0, 5.0, 25.0
MAX_TEXTS = 5
FENCE_BEYOND_M = 30.0
"""It is noticed outside, and braking takes its way: 15 m from 5 m/s were measured on both."""


@check("our heartbeats stop in flight", takes_s=80.0)
def silence(field: Field, vehicle: int) -> str:
    """12 s without a word from us: what it does then by its present parameters, and that it obeys again."""
    with flying(field, vehicle) as pilot:
        v = pilot.vehicle
        field.run(3.0)  # the mode of a take-off ends by itself
        mode, place = v.telemetry.custom_mode, v.telemetry.position_m
        with field.unheard(vehicle):
            field.run(SILENCE_S)
            word, changed = pilot.mode, v.telemetry.custom_mode != mode
        moved_m = math.dist(place, v.telemetry.position_m)
        field.run(2.0)
        landed = pilot.down()
    did = "changed to" if changed else "stays in"
    return f"{did} {word}, moved {moved_m:.1f} m; landed {landed:.0f} s after the order"


@check("failsafe: the station is lost", takes_s=100.0)
def station_lost(field: Field, vehicle: int) -> str:
    """With its failsafe set to return: how long after our last word it returns, and that it obeys us again then."""
    listens = have(field, vehicle, ["MAV_GCS_SYSID", "SYSID_MYGCS"])
    if any(int(value) != OWN_SYSTEM for value in listens.values()):
        raise NotApplicable(f"it listens to another station than ours: {listens}")
    if have(field, vehicle, ["FS_GCS_ENABLE"]):
        borrow(field, vehicle, {"FS_GCS_ENABLE": 1})
        promised = read(field, vehicle, "FS_GCS_TIMEOUT") + 2.0 if have(field, vehicle, ["FS_GCS_TIMEOUT"]) else 10.0
    elif have(field, vehicle, ["NAV_DLL_ACT"]):
        borrow(field, vehicle, {"NAV_DLL_ACT": 2, "COM_DL_LOSS_T": 5})
        promised = 5.0 + 5.0 + sum(have(field, vehicle, ["COM_FAIL_ACT_T"]).values())
    else:
        raise NotApplicable("it has neither FS_GCS_ENABLE nor NAV_DLL_ACT")
    with flying(field, vehicle) as pilot:
        reported = field.last_event
        with field.unheard(vehicle):
            took_s = field.until(lambda: pilot.mode == "RTL", promised + 10.0, lambda: f"RTL (it is in {pilot.mode})")
        field.run(3.0)
        after = pilot.mode
        words = _words(field, vehicle, reported)
    return f"RTL {took_s:.1f} s after our last word, in {after} 3 s after the next one; it said: {words}"


@check("failsafe: battery", takes_s=100.0)
def battery(field: Field, vehicle: int) -> str:
    """A limit above the present charge: it lands by itself, and that is shown; afterwards it is ready again."""
    pilot = Pilot(field, vehicle)
    v = pilot.vehicle
    if have(field, vehicle, ["BATT_LOW_VOLT", "BATT_FS_LOW_ACT"]).keys() >= {"BATT_LOW_VOLT", "BATT_FS_LOW_ACT"}:
        ready, trip = (
            {"BATT_FS_LOW_ACT": 1, "BATT_LOW_TIMER": 2},
            {"BATT_LOW_VOLT": lambda: v.telemetry.battery_v + 2.0},
        )
    elif have(field, vehicle, ["COM_LOW_BAT_ACT"]):
        ready, trip = {"COM_LOW_BAT_ACT": 2}, {"BAT_CRIT_THR": lambda: 0.99}
    else:
        raise NotApplicable("it has neither BATT_FS_LOW_ACT nor COM_LOW_BAT_ACT")
    if not v.telemetry.battery_v > 1.0:
        raise NotApplicable("it has no battery monitor")
    borrow(field, vehicle, ready)
    with flying(field, vehicle):
        reported = field.last_event
        borrow(field, vehicle, {name: value() for name, value in trip.items()})
        took_s = field.until(
            lambda: pilot.firmware.is_landing(v), 40.0, lambda: f"landing by itself (it is in {pilot.mode})"
        )
        status = v.telemetry.system_status
        words = _words(field, vehicle, reported)
        down_s = field.until(lambda: not v.telemetry.armed, 120.0, "landed and disarmed by itself")
    healed = _heal_battery(field, pilot)
    landed = f"lands {took_s:.1f} s after the limit was set (status {status}), disarmed {down_s:.0f} s after"
    return f"{landed}; it said: {words}; {healed}"


def _heal_battery(field: Field, pilot: Pilot) -> str:
    """Put the limits back, and have a failsafe that stays on forgotten."""
    give_back(field, pilot.system)
    field.run(3.0)
    shown = pilot.problems()
    pilot.asked("battery reset", MavCommand(BATTERY_RESET, (1.0, 100.0)))
    ready_s = field.until(lambda: not pilot.problems(), 60.0, pilot.why_not_ready)
    return f"afterwards: {shown or 'nothing'}, ready {ready_s:.0f} s later"


@check("failsafe: fence", takes_s=130.0)
def fence(field: Field, vehicle: int) -> str:
    """Flown against a fence of 80 m x 80 m set to return: how far it gets beyond, and that it comes back."""
    pilot = Pilot(field, vehicle)
    v = pilot.vehicle
    if have(field, vehicle, ["FENCE_ENABLE"]):
        borrow(field, vehicle, {"FENCE_ACTION": 1, "FENCE_TYPE": 4})
        on = {"FENCE_ENABLE": 1.0}
    elif have(field, vehicle, ["GF_ACTION"]):
        borrow(field, vehicle, {"GF_ACTION": 3})
        on = {}
    else:
        raise NotApplicable("it has neither FENCE_ENABLE nor GF_ACTION")
    plan = Plan(PlanKind.FENCE, a_polygon(v, FENCE_M))
    finished(field, field.station.services.missions.upload(vehicle, plan))
    borrow(field, vehicle, on)
    try:
        return _against(field, pilot)
    finally:
        if v.telemetry.armed:
            pilot.down()
        empty(field, vehicle, PlanKind.FENCE)


def _against(field: Field, pilot: Pilot) -> str:
    v, reported = pilot.vehicle, field.last_event
    with flying(field, pilot.system):
        home = v.telemetry.position_m
        farthest = [-FENCE_M]

        def beyond_m() -> float:
            farthest[0] = max(farthest[0], v.telemetry.position_m[1] - home[1] - FENCE_M)
            return v.telemetry.position_m[1] - home[1] - FENCE_M

        for _ in pilot.fly((0.0, FENCE_SPEED_M_S, 0.0), FENCE_FLIGHT_S):
            beyond_m()
            if not pilot.firmware.is_steerable(v):
                break
        pilot.firmware.release(v)
        word = pilot.mode
        if farthest[0] <= 0.0 and pilot.firmware.is_steerable(v):
            speed = f"{v.telemetry.ground_speed_m_s:.1f} m/s"
            return f"does not cross it: comes to {-farthest[0]:.1f} m before it, {speed} in {word}"
        field.until(lambda: beyond_m() < -2.0, 40.0, lambda: f"back inside (it is {beyond_m():.0f} m outside, {word})")
        back = f"{word}, back inside in {pilot.mode}" if pilot.mode != word else f"{word}, back inside"
        words = _words(field, pilot.system, reported)
    if farthest[0] > FENCE_BEYOND_M:
        raise Failed(f"{farthest[0]:.0f} m beyond its fence, allowed {FENCE_BEYOND_M:g} m; {word}; it said: {words}")
    return f"at most {farthest[0]:.1f} m beyond, then {back}; it said: {words}"


def _words(field: Field, vehicle: int, since: int) -> str:
    """What the vehicle itself said lately; its texts may follow its heartbeat by a moment."""
    field.run(1.0)
    return "; ".join(field.said(vehicle, since)[-MAX_TEXTS:]) or "nothing"
