"""Arming, and why not: on the ground."""

from tests.conformance.borrow import borrow, give_back, have
from tests.conformance.field import Failed, Field, NotApplicable
from tests.conformance.pilot import Pilot
from tests.conformance.report import check
from tests.conformance.tidy import empty
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.core.uplink.actions import Outcome, RetryClass

SPOILERS: tuple[tuple[str, float], ...] = (
    ("BATT_ARM_VOLT", 99.0),
    ("COM_ARM_ODID", 2.0),
    ("ANGLE_MAX", 100.0),
    ("ATC_ANGLE_MAX", 1.0),
    ("COM_ARM_BAT_MIN", 0.9999),
)
"""A parameter of each that makes its pre-arm checks fail, whatever the version: minimum battery voltage to arm, a
Remote ID transmitter that is not there, an impossible lean angle."""
CHECKS_S = 5.0
"""Checks run once a second (ArduCopter), and are told every 2 s (PX4)."""


@check("arm and disarm", takes_s=15.0)
def arm(field: Field, vehicle: int) -> str:
    """It becomes ready, arms, says so in words, and disarms on the ground."""
    pilot = Pilot(field, vehicle)
    pilot.ready()
    reported = field.last_event
    armed_s = pilot.must(pilot.firmware.arm(pilot.vehicle, pilot.done))
    disarmed_s = pilot.must(pilot.firmware.disarm(pilot.vehicle))
    field.run(1.0)
    words = field.said(vehicle, reported)
    return f"armed {armed_s:.2f} s after the order, disarmed {disarmed_s:.2f} s after; it said: {'; '.join(words[:3])}"


@check("arm when it is armed", takes_s=15.0)
def arm_again(field: Field, vehicle: int) -> str:
    """A second order changes nothing, and is no failure."""
    pilot = Pilot(field, vehicle)
    pilot.armed()
    outcome, why, took_s = pilot.order(pilot.firmware.arm(pilot.vehicle, pilot.done))
    armed = pilot.vehicle.telemetry.armed
    pilot.must(pilot.firmware.disarm(pilot.vehicle))
    if outcome is not Outcome.CONFIRMED or not armed:
        raise Failed(f"the second order: {outcome.value} ({why}), armed: {armed}")
    return f"{outcome.value} after {took_s:.2f} s, still armed"


@check("refusal: take-off on the ground, disarmed", takes_s=15.0)
def take_off_disarmed(field: Field, vehicle: int) -> str:
    """Taking off without arming never counts as done, and it stays on the ground."""
    pilot = Pilot(field, vehicle)
    pilot.ready()
    v = pilot.vehicle
    outcome, why, took_s = pilot.order(pilot.firmware.take_off(v, pilot.height_m, pilot.done), 30.0)
    if outcome is Outcome.CONFIRMED or v.telemetry.armed:
        raise Failed(f"take-off while disarmed: {outcome.value}, armed: {v.telemetry.armed}")
    pilot.must(pilot.firmware.prepare(v, pilot.done))
    return f"{outcome.value} ({why or 'it says nothing'}) after {took_s:.1f} s"


@check("refusal: arming with a parameter that spoils it", takes_s=25.0)
def arm_spoiled(field: Field, vehicle: int) -> str:
    """A parameter makes its checks fail: it is shown as not ready, arming is refused with the reason; then it heals."""
    pilot = Pilot(field, vehicle)
    pilot.ready()
    held = have(field, vehicle, [name for name, _ in SPOILERS])
    tried = []
    for name, value in SPOILERS:
        if name not in held:
            continue
        borrow(field, vehicle, {name: value})
        field.run(CHECKS_S)
        shown = pilot.problems()
        outcome, why, took_s = pilot.order(pilot.firmware.arm(pilot.vehicle, pilot.done))
        if outcome is Outcome.CONFIRMED:
            tried.append(f"{name} {value:g}: it arms all the same")
            pilot.must(pilot.firmware.disarm(pilot.vehicle))
            give_back(field, vehicle)
            continue
        if not why.partition(": ")[2]:
            raise Failed(f"{name} {value:g}: {outcome.value} after {took_s:.1f} s, without a reason ({why})")
        give_back(field, vehicle)
        healed_s = field.until(lambda: not pilot.problems(), 40.0, pilot.why_not_ready)
        reported = f"{name} {value:g}: {outcome.value} ({why}) after {took_s:.2f} s; shown: {shown or 'nothing'}"
        return f"{reported}; ready {healed_s:.0f} s after it was put back"
    raise NotApplicable("; ".join(tried) or f"it has none of {', '.join(name for name, _ in SPOILERS)}")


@check("refusal: arming where the mode does not allow it", takes_s=15.0)
def arm_refused(field: Field, vehicle: int) -> str:
    """In its mission mode without a mission it does not arm, and the operator learns why."""
    pilot = Pilot(field, vehicle)
    pilot.ready()
    v, modes = pilot.vehicle, field.station.services.modes
    empty(field, vehicle, PlanKind.MISSION)
    number = modes.number(v, "mission") or modes.number(v, "auto")
    if number is None:
        raise Failed("no word for its mission mode")
    pilot.order(pilot.firmware.mode(v, number, "mission mode", RetryClass.SET))
    field.run(2.0)
    outcome, why, took_s = pilot.order(pilot.firmware.arm(v, pilot.done))
    armed = v.telemetry.armed
    pilot.must(pilot.firmware.prepare(v, pilot.done))
    if armed:
        raise Failed("it armed")
    if not why:
        raise Failed(f"{outcome.value} after {took_s:.1f} s, without a reason")
    return f"{outcome.value} after {took_s:.2f} s: {why}"
