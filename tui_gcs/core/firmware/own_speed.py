"""How fast an autopilot flies at most, whatever set-points ask for: a parameter of its own limits it.

ArduCopter: WPNAV_SPEED in cm/s, in newer releases WP_SPD in m/s; asked for 12 and for 20 m/s a real one flew 10.3 with
the 10 that it is shipped with. PX4: MPC_XY_VEL_MAX in m/s, shipped with 12 (parameters.json of 1.17).
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4, autopilot_name

MIN_SPEED_M_S = 1.0


class SpeedParameter(NamedTuple):
    """A parameter that limits the horizontal speed."""

    name: str
    m_s: float
    """What one unit of it is."""
    shipped: float
    """Its value in a new vehicle."""


PARAMETERS: Mapping[int, tuple[SpeedParameter, ...]] = {
    AUTOPILOT_ARDUPILOT: (SpeedParameter("WPNAV_SPEED", 0.01, 1000.0), SpeedParameter("WP_SPD", 1.0, 10.0)),
    AUTOPILOT_PX4: (SpeedParameter("MPC_XY_VEL_MAX", 1.0, 12.0),),
}
"""By MAV_AUTOPILOT; a vehicle has one of them."""


def shipped_speed_m_s(autopilot: int) -> float:
    """Return what a new vehicle flies at most; inf where that is not known."""
    known = PARAMETERS.get(autopilot, ())
    return known[0].m_s * known[0].shipped if known else math.inf


def speed_names(autopilot: int) -> tuple[str, ...]:
    """Return the names of the parameters that limit its speed."""
    return tuple(parameter.name for parameter in PARAMETERS.get(autopilot, ()))


def own_speed_m_s(autopilot: int, values: Mapping[str, float]) -> float:
    """Return what a vehicle flies at most by the parameters that were read of it, else as a new one would.

    A value with which it could hardly move is not believed: nothing could be planned with it.
    """
    for parameter in PARAMETERS.get(autopilot, ()):
        if values.get(parameter.name, 0.0) * parameter.m_s >= MIN_SPEED_M_S:
            return values[parameter.name] * parameter.m_s
    return shipped_speed_m_s(autopilot)


def speed_problem(autopilot: int, values: Mapping[str, float], asked_m_s: float) -> str:
    """Return why a vehicle does not fly as fast as it is asked to, by the parameters that it has; or ""."""
    for parameter in PARAMETERS.get(autopilot, ()):
        most_m_s = values.get(parameter.name, math.inf) * parameter.m_s
        if most_m_s < asked_m_s:
            return f"flies {most_m_s:g} m/s at most ({parameter.name}), the scenario asks for {asked_m_s:g}"
    return ""


def shipped_problems(asked_m_s: float) -> list[str]:
    """Return which autopilots as shipped do not fly as fast, and by which parameter."""
    slow = {a: known[0].name for a, known in PARAMETERS.items() if shipped_speed_m_s(a) < asked_m_s}
    return [
        f"{autopilot_name(autopilot)} flies {shipped_speed_m_s(autopilot):g} m/s at most unless {name} is raised"
        for autopilot, name in slow.items()
    ]
