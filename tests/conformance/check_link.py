"""Who is there, what it says, how often: before anything is asked of it."""

from tests.conformance.field import Failed, Field
from tests.conformance.report import check
from tui_gcs.core.mavlink.mode_names import mode_name
from tui_gcs.core.protocol.common import Freshness

WATCH_S = 10.0
GLOBAL_POSITION_INT, HEARTBEAT = 33, 0


@check("discovery: identity")
def identity(field: Field, vehicle: int) -> str:
    """Type, firmware, hardware id and mode are known."""
    v = field.vehicle(vehicle)
    took_s = field.until(lambda: v.identity.identified, 10.0, "AUTOPILOT_VERSION")
    mode = mode_name(v.autopilot, v.type, v.telemetry.custom_mode)
    if mode.startswith("mode "):
        raise Failed(f"no name for its mode: {mode}")
    uid = v.identity.uid or "none"
    return f"autopilot {v.autopilot}, type {v.type}, uid {uid}, mode {mode}, identified after {took_s:.1f} s"


@check("discovery: heartbeats at 1 Hz", takes_s=11.0)
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


@check("streams: position at the rate we asked for", takes_s=11.0)
def position_rate(field: Field, vehicle: int) -> str:
    """GLOBAL_POSITION_INT comes as often as the rate controller wants it, and with nothing lost on the way."""
    v = field.vehicle(vehicle)
    wanted_hz = field.station.comms.rates.plan(v.link).get(GLOBAL_POSITION_INT, 0.0)
    if not wanted_hz:
        raise Failed("the station does not ask for positions on this link")
    before = v.path.slots[GLOBAL_POSITION_INT].count
    field.run(WATCH_S)
    rate_hz = (v.path.slots[GLOBAL_POSITION_INT].count - before) / WATCH_S
    if rate_hz < 0.7 * wanted_hz:
        raise Failed(f"{rate_hz:.1f} Hz, asked for {wanted_hz:g} Hz")
    return f"{rate_hz:.1f} Hz, asked for {wanted_hz:g} Hz"


@check("streams: what an operator needs")
def telemetry(field: Field, vehicle: int) -> str:
    """Position, home, battery, GPS, mode and health are known, none of them old."""
    v, now = field.vehicle(vehicle), field.clock.now
    field.until(lambda: v.telemetry.home_m is not None, 30.0, "HOME_POSITION")
    field.until(lambda: v.telemetry.battery_v > 0.0 or v.telemetry.battery_pct >= 0.0, 30.0, "its battery")
    field.until(
        lambda: v.telemetry.gps_fix >= 3 and now() - v.telemetry.position_s < 2.0,
        60.0,
        lambda: f"a GPS fix (now {v.telemetry.gps_fix})",
    )
    health = field.station.services.health.of(v)
    why = "; ".join(problem.text for problem in health.problems[:2])
    charge = f"{v.telemetry.battery_v:.1f} V, {v.telemetry.battery_pct:.0f} %"
    gps = f"GPS fix {v.telemetry.gps_fix}, {v.telemetry.satellites} satellites"
    return f"{gps}; {charge}; {'ready' if health.ready else f'not ready: {why}'}"


@check("time: TIMESYNC both ways", takes_s=12.0)
def timesync(field: Field, vehicle: int) -> str:
    """It answers our question of time; the round trip is known."""
    v, times = field.vehicle(vehicle), field.station.services.link_timing
    field.until(lambda: times.of(v) is not None, 25.0, "an answer to TIMESYNC")
    measured = times.of(v)
    assert measured is not None
    return f"round trip {1e3 * measured.best_rtt_s:.1f} ms at best, {1e3 * measured.rtt_s:.1f} ms the last"
