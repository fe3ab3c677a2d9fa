"""Who is there, what it says, how often: before anything is asked of it."""

from tests.conformance.field import Failed, Field
from tests.conformance.report import check
from tui_gcs.core.firmware.modes import mode_name
from tui_gcs.core.messages import Freshness

WATCH_S = 10.0
GLOBAL_POSITION_INT, HEARTBEAT = 33, 0


@check("discovery: identity")
def identity(field: Field, vehicle: int) -> str:
    """Type, firmware, hardware id and mode are known."""
    v = field.vehicle(vehicle)
    took_s = field.until(lambda: v.identified, 10.0, "AUTOPILOT_VERSION")
    mode = mode_name(v.autopilot, v.type, v.custom_mode)
    if mode.startswith("mode "):
        raise Failed(f"no name for its mode: {mode}")
    return (
        f"autopilot {v.autopilot}, type {v.type}, uid {v.uid or 'none'}, mode {mode}, identified after {took_s:.1f} s"
    )


@check("discovery: heartbeats at 1 Hz")
def heartbeats(field: Field, vehicle: int) -> str:
    """A heartbeat a second, none lost, never shown as LOST."""
    v = field.vehicle(vehicle)
    before = v.path.slots[HEARTBEAT].count
    lost = 0
    for _ in range(round(WATCH_S * 5)):
        field.run(0.2)
        lost += v.freshness(field.clock.now()) is Freshness.LOST
    rate_hz = (v.path.slots[HEARTBEAT].count - before) / WATCH_S
    if lost or not 0.7 <= rate_hz <= 1.5:
        raise Failed(f"{rate_hz:.1f} heartbeats a second, LOST in {lost} of {WATCH_S * 5:.0f} looks")
    return f"{rate_hz:.1f} Hz, never LOST"


@check("streams: position at the rate we asked for")
def position_rate(field: Field, vehicle: int) -> str:
    """GLOBAL_POSITION_INT comes as often as the rate desk wants it, and with nothing lost on the way."""
    v = field.vehicle(vehicle)
    wanted_hz = field.station.rates.plan(v.link).get(GLOBAL_POSITION_INT, 0.0)
    if not wanted_hz:
        raise Failed("the station does not ask for positions on this link")
    before = v.path.slots[GLOBAL_POSITION_INT].count
    field.run(WATCH_S)
    rate_hz = (v.path.slots[GLOBAL_POSITION_INT].count - before) / WATCH_S
    if rate_hz < 0.7 * wanted_hz:
        raise Failed(f"{rate_hz:.1f} Hz, asked for {wanted_hz:g} Hz")
    return f"{rate_hz:.1f} Hz, asked for {wanted_hz:g} Hz"
