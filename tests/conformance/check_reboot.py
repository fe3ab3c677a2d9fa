"""Reboot: the station sees it, and everything is as before. On the ground, and last."""

from tests.conformance.borrow import read
from tests.conformance.field import Failed, Field, NotApplicable
from tests.conformance.pilot import Pilot
from tests.conformance.report import check
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.uplink.actions import MavCommand, Outcome, RetryClass

REBOOT = 246
POSITION = 33
WATCH_S = 5.0
READY_S = 120.0
KEPT = ("RTL_ALT", "RTL_RETURN_ALT", "WPNAV_SPEED", "MAV_SYS_ID")


def boot_ms(vehicle: Vehicle) -> int:
    """Its boot clock in its newest position, good or not: it has none before GPS."""
    return int(vehicle.path.slots[POSITION].values()[0])


@check("reboot on the ground", takes_s=75.0)
def reboot(field: Field, vehicle: int) -> str:
    """It is told to reboot: the station sees it, forgets what it knew, asks for streams anew; it gets ready again."""
    pilot = Pilot(field, vehicle)
    pilot.ready()
    v, station = pilot.vehicle, field.station
    name = next((n for n in KEPT if n in station.services.params.table(vehicle).params), "")
    before, booted_ms, reboots = (read(field, vehicle, name) if name else 0.0), boot_ms(v), v.integrity.reboots
    began_s = field.clock.now()
    order = MavCommand(REBOOT, (1.0,))
    action = station.comms.command_encoder.action(
        v.id, "reboot", RetryClass.START, order, lambda v: v.integrity.reboots > reboots, pilot.done, confirm_s=30.0
    )  # what is pending for a vehicle ends when it reboots, this order, too
    outcome, why, _ = pilot.order(action, 45.0)
    if outcome is Outcome.REFUSED:
        raise NotApplicable(f"it refuses to reboot: {why}")
    if v.integrity.reboots <= reboots:
        raise Failed(f"reboot: {outcome.value} ({why or 'no reason given'})")
    seen_s = field.clock.now() - began_s
    wanted_hz = station.comms.rates.plan(v.link).get(POSITION, 1.0)
    rate = [0.0]

    def streams() -> bool:
        count, since_s = v.path.slots[POSITION].count if POSITION in v.path.slots else 0, field.clock.now()
        field.run(WATCH_S)
        after = v.path.slots[POSITION].count if POSITION in v.path.slots else 0
        rate[0] = (after - count) / (field.clock.now() - since_s)
        return rate[0] >= 0.7 * wanted_hz

    field.until(streams, 60.0, lambda: f"positions at {wanted_hz:g} Hz again (now {rate[0]:.1f} Hz)")
    streams_s = field.clock.now() - began_s - WATCH_S
    if boot_ms(v) >= booted_ms:
        raise Failed(f"its boot clock was {booted_ms} ms before, and is {boot_ms(v)} ms now")
    kept = read(field, vehicle, name) if name else 0.0
    if kept != before:
        raise Failed(f"{name} was {before:g} before, and is {kept:g} now")
    field.until(lambda: not pilot.problems(), READY_S, pilot.why_not_ready)
    return (
        f"seen after {seen_s:.1f} s, {rate[0]:.1f} Hz of positions after {streams_s:.1f} s, "
        f"ready after {field.clock.now() - began_s:.0f} s; {name or 'no parameter'} as before"
    )
