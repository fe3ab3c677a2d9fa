"""Vehicles in few words, as they are now: for dialogs and the panel of results."""

from tui_gcs.core.protocol.common import Freshness, Phase, VehicleRow
from tui_gcs.feed.feed import Feed
from tui_gcs.widgets.basics.number_text import number, phase_words, speed_m_s


def rows_of(feed: Feed) -> dict[int, VehicleRow]:
    """Return the newest row of every vehicle, by id."""
    return {row.id: row for row in feed.frame.rows()} if feed.frame is not None else {}


def now_words(row: VehicleRow | None) -> str:
    """Describe a vehicle as it is now, in a few words."""
    if row is None:
        return "never heard"
    if row.freshness is Freshness.LOST:
        return f"LOST {number(row.heard_age_s, 0)} s"
    state = "ARMED" if row.armed else "disarmed"
    if row.freshness is Freshness.STALE:
        return f"{phase_words(row)} {row.mode} {state} {_no_position(row)}"
    motion = f"{number(row.position_m[2], 0)} m {number(speed_m_s(row.velocity_m_s), 1)} m/s"
    return f"{phase_words(row)} {row.mode} {state} {motion} {number(row.battery_pct, 0)} %"


def _no_position(row: VehicleRow) -> str:
    # Height and speed of an old position are not those of now: they are not shown.
    return f"no position for {number(row.age_s, 0)} s"


def brief_words(row: VehicleRow | None) -> str:
    """Describe a vehicle in even fewer words: one that moves is armed."""
    if row is None or row.freshness is Freshness.LOST:
        return now_words(row)
    if not row.armed:
        return f"{row.phase} {row.mode} disarmed"
    if row.phase is Phase.GROUND:
        return f"{row.phase} {row.mode} ARMED"
    if row.freshness is Freshness.STALE:
        return f"{phase_words(row)} {row.mode} {_no_position(row)}"
    motion = f"{number(row.position_m[2], 0)} m {number(speed_m_s(row.velocity_m_s), 1)} m/s"
    return f"{phase_words(row)} {row.mode} {motion}"
