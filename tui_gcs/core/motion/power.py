"""How the power that a vehicle uses depends on its speed."""

from tui_gcs.core.scenario.model import VehicleClass


def use_pct_s(kind: VehicleClass, speed_m_s: float) -> float:
    """Return which share of a full battery, in percent, a vehicle of this class uses in a second at this speed.

    Two powers are known of a class: in hover, and at its speed limit. Between them the power is taken to change with
    the square of the speed. A class without powers uses 1 % a second at every speed: only shares of it mean something.
    """
    power = kind.power
    if power is None:
        return 1.0
    share = min(speed_m_s / kind.speed_m_s, 1.0)
    power_w = power.hover_w + (power.cruise_w - power.hover_w) * share * share
    return 100.0 * power_w / (3600.0 * power.capacity_wh)


def most_use_pct_s(kind: VehicleClass) -> float:
    """Return the use at the speed, hover or the speed limit, at which a vehicle of this class uses more."""
    return max(use_pct_s(kind, 0.0), use_pct_s(kind, kind.speed_m_s))
