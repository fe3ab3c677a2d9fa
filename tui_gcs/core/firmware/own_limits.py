"""What an autopilot flies at most, whatever set-points ask for: parameters of its own limit it.

ArduCopter: WPNAV_SPEED and WPNAV_ACCEL in cm, in newer releases WP_SPD and WP_ACC in m; asked for 12 and for 20 m/s a
real one flew 10.3 with the 10 m/s that it is shipped with. PX4 (parameters.json of 1.17): MPC_XY_VEL_MAX in m/s, and
MPC_TILTMAX_AIR in degrees of lean. Climbs are limited by WPNAV_SPEED_UP or WP_SPD_UP, and by MPC_TKO_SPEED; heights by
FENCE_ALT_MAX and GF_MAX_VER_DIST above home, where such a fence is on.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

from tui_gcs.core.base.float32 import whole_number
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4, autopilot_name

GRAVITY_M_S2 = 9.80665
MIN_BELIEVED = 0.5
"""In m/s and m/s²: with less a vehicle could hardly move, and nothing could be planned with it."""
MAX_ALTITUDE_FENCE = 1
"""The bit of FENCE_TYPE with which an ArduCopter keeps below FENCE_ALT_MAX."""


class OwnLimits(NamedTuple):
    """What one vehicle flies at most by itself; inf where that is not known."""

    speed_m_s: float = math.inf
    accel_m_s2: float = math.inf


class AskedMotion(NamedTuple):
    """What a scenario asks of a vehicle."""

    speed_m_s: float
    accel_m_s2: float
    climb_m_s: float = 0.0
    """The slowest climb with which it still reaches its layer in time."""
    layer_m: float = 0.0
    """The height of its layer above its home."""


class LimitParameter(NamedTuple):
    """A parameter that limits a motion."""

    name: str
    shipped: float
    """Its value in a new vehicle."""
    in_si: Callable[[float], float] = float
    """Returns a value of it in m/s or m/s²."""

    @property
    def shipped_si(self) -> float:
        """What a new vehicle flies at most, in m/s or m/s²."""
        return self.in_si(self.shipped)


def _of_centimetres(value: float) -> float:
    return value / 100.0


def _of_lean(value_deg: float) -> float:
    return math.inf if value_deg >= 90.0 else GRAVITY_M_S2 * math.tan(math.radians(max(value_deg, 0.0)))


Parameters = Mapping[int, tuple[LimitParameter, ...]]
"""By MAV_AUTOPILOT. A vehicle has one of them: the others are its names in newer releases."""
SPEED: Parameters = {
    AUTOPILOT_ARDUPILOT: (LimitParameter("WPNAV_SPEED", 1000.0, _of_centimetres), LimitParameter("WP_SPD", 10.0)),
    AUTOPILOT_PX4: (LimitParameter("MPC_XY_VEL_MAX", 12.0),),
}
ACCEL: Parameters = {
    AUTOPILOT_ARDUPILOT: (LimitParameter("WPNAV_ACCEL", 250.0, _of_centimetres), LimitParameter("WP_ACC", 2.5)),
    AUTOPILOT_PX4: (LimitParameter("MPC_TILTMAX_AIR", 45.0, _of_lean),),
}
CLIMB: Parameters = {
    AUTOPILOT_ARDUPILOT: (LimitParameter("WPNAV_SPEED_UP", 250.0, _of_centimetres), LimitParameter("WP_SPD_UP", 2.5)),
    AUTOPILOT_PX4: (LimitParameter("MPC_TKO_SPEED", 1.5),),
}
_FENCES = {
    AUTOPILOT_ARDUPILOT: ("FENCE_ENABLE", "FENCE_TYPE", "FENCE_ALT_MAX"),
    AUTOPILOT_PX4: ("GF_ACTION", "GF_MAX_VER_DIST"),
}
SIMULATED_PX4 = OwnLimits(8.0, 2.5)
"""The air of PX4's own simulator takes 1 m/s² per m/s of the 9.8 m/s² that 45 degrees of lean give. With
these two, of which patrols use 0.985 and 0.88, all of it is used. Asked for 12 m/s it flies 9.8 and falls behind."""


def limit_names(autopilot: int) -> tuple[str, ...]:
    """Return the names of the parameters that limit its motion."""
    known = [parameter.name for table in (SPEED, ACCEL, CLIMB) for parameter in table.get(autopilot, ())]
    return (*known, *_FENCES.get(autopilot, ()))


def own_limits(autopilot: int, values: Mapping[str, float], *, simulated: bool = False) -> OwnLimits:
    """Return what a vehicle flies at most by the parameters that were read of it, else as a new one would.

    A value with which it could hardly move is not believed.
    """
    found = OwnLimits(_most(SPEED, autopilot, values), _most(ACCEL, autopilot, values))
    if simulated and autopilot == AUTOPILOT_PX4:
        return OwnLimits(*map(min, found, SIMULATED_PX4))
    return found


def _most(table: Parameters, autopilot: int, values: Mapping[str, float]) -> float:
    known = table.get(autopilot, ())
    for parameter in known:
        most = parameter.in_si(values.get(parameter.name, 0.0))
        if most >= MIN_BELIEVED:
            return most
    return known[0].shipped_si if known else math.inf


def limit_problems(autopilot: int, values: Mapping[str, float], asked: AskedMotion) -> list[str]:
    """Return why a vehicle does not fly what it is asked to, by the parameters that were read of it."""
    return [
        *_below(SPEED, autopilot, values, "flies {:g} m/s at most ({})", asked.speed_m_s),
        *_below(ACCEL, autopilot, values, "accelerates with {:.3g} m/s2 at most ({})", asked.accel_m_s2),
        *_below(CLIMB, autopilot, values, "climbs {:g} m/s at most ({})", asked.climb_m_s),
        *_fence(autopilot, values, asked.layer_m),
    ]


def _below(table: Parameters, autopilot: int, values: Mapping[str, float], text: str, asked: float) -> Iterator[str]:
    for parameter in table.get(autopilot, ()):
        most = parameter.in_si(values.get(parameter.name, math.inf))
        if most < asked:
            yield f"{text.format(most, parameter.name)}, the scenario asks for {asked:g}"


def _fence(autopilot: int, values: Mapping[str, float], layer_m: float) -> Iterator[str]:
    *switches, ceiling = _FENCES.get(autopilot, ("",))
    top_m = values.get(ceiling, 0.0)
    on = all(values.get(name, 0.0) > 0.0 for name in switches) and top_m > 0.0
    if autopilot == AUTOPILOT_ARDUPILOT:
        on = on and bool((whole_number(values["FENCE_TYPE"]) or 0) & MAX_ALTITUDE_FENCE)
    if on and top_m < layer_m:
        yield f"its own fence ends at {top_m:g} m ({ceiling}), its layer is {layer_m:g} m"


def shipped_problems(speed_m_s: float, accel_m_s2: float, autopilots: tuple[int, ...] = tuple(SPEED)) -> list[str]:
    """Return which autopilots as shipped do not fly limits of a scenario, and by which parameter."""
    found = []
    for autopilot in autopilots:
        name, speed, accel = autopilot_name(autopilot), SPEED[autopilot][0], ACCEL[autopilot][0]
        if speed.shipped_si < speed_m_s:
            unless = f"{speed.shipped_si:g} m/s at most unless {speed.name} is raised"
            found.append(f"limits.speed_m_s {speed_m_s:g}: {name} flies {unless}")
        if accel.shipped_si < accel_m_s2:
            unless = f"{accel.shipped_si:.3g} m/s2 at most unless {accel.name} is raised"
            found.append(f"limits.accel_m_s2 {accel_m_s2:g}: {name} accelerates with {unless}")
    own = SIMULATED_PX4
    if AUTOPILOT_PX4 in autopilots and (speed_m_s > own.speed_m_s or accel_m_s2 > own.accel_m_s2):
        most = f"{own.speed_m_s:g} m/s and {own.accel_m_s2:g} m/s2"
        found.append(f"simulated PX4s fly {most} at most: their air takes the rest of their lean (MPC_TILTMAX_AIR)")
    return found
