"""The fleet as it travels: one immutable snapshot of all vehicles. Part of `messages`, which says how.

Positions are ENU metres about the scenario origin (z above home); unknown numbers are NaN.
"""

from enum import StrEnum
from operator import attrgetter
from typing import NamedTuple

from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol.base import Message, Vec3
from tui_gcs.core.protocol.planning import Track

NOWHERE: Vec3 = (float("nan"), float("nan"), float("nan"))


class Phase(StrEnum):
    """What the station is doing with a vehicle."""

    GROUND = "ground"
    """Disarmed on the ground, or nothing to do with us."""
    ARMING = "arming"
    TAKEOFF = "take-off"
    FLYING = "flying"
    """Airborne and following its team's planner."""
    HOLDING = "holding"
    BY_HAND = "by hand"
    """Airborne, on courses of an operator, judged by the guard; `Resume` gives it back to its planner."""
    RETURNING = "returning"
    LANDING = "landing"
    TAKEN_OUT = "taken out"
    """Airborne but not ours to steer: lost, or in a mode that does not take set-points."""


class Freshness(StrEnum):
    """Stale: no position for 3 s. LOST: no frame at all for 3.5 s."""

    OK = "ok"
    STALE = "stale"
    LOST = "lost"


class VehicleRow(NamedTuple):
    """One vehicle of a fleet frame; the columns of `FleetFrame` in the same order."""

    id: int
    team: str
    autopilot: str
    vehicle_type: str
    mode: str
    armed: bool
    phase: Phase
    freshness: Freshness
    position_m: Vec3
    velocity_m_s: Vec3
    heading_deg: float
    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    battery_pct: float
    battery_v: float
    gps_fix: int
    satellites: int
    age_s: float
    heard_age_s: float
    loss_pct: float
    slot: str
    slot_error_m: float
    lag_s: float
    link: str
    signing: str
    problem: str
    layer_m: float = float("nan")
    goal_m: Vec3 = NOWHERE
    goal_radius_m: float = 0.0
    camera: bool | None = None
    gimbal: bool | None = None


class FleetFrame(Message, frozen=True):
    """One immutable snapshot of all vehicles, struct of arrays; published at 10 Hz."""

    seq: int
    t_s: float
    wall_s: float
    kind: RunKind
    ids: tuple[int, ...] = ()
    team: tuple[str, ...] = ()
    autopilot: tuple[str, ...] = ()
    vehicle_type: tuple[str, ...] = ()
    mode: tuple[str, ...] = ()
    armed: tuple[bool, ...] = ()
    phase: tuple[Phase, ...] = ()
    freshness: tuple[Freshness, ...] = ()
    position_m: tuple[Vec3, ...] = ()
    velocity_m_s: tuple[Vec3, ...] = ()
    heading_deg: tuple[float, ...] = ()
    lat_deg: tuple[float, ...] = ()
    lon_deg: tuple[float, ...] = ()
    alt_amsl_m: tuple[float, ...] = ()
    battery_pct: tuple[float, ...] = ()
    battery_v: tuple[float, ...] = ()
    gps_fix: tuple[int, ...] = ()
    """MAVLink GPS_FIX_TYPE."""
    satellites: tuple[int, ...] = ()
    """-1 when unknown."""
    age_s: tuple[float, ...] = ()
    """Age of the newest position."""
    heard_age_s: tuple[float, ...] = ()
    """Age of the newest frame of any kind."""
    loss_pct: tuple[float, ...] = ()
    slot: tuple[str, ...] = ()
    """What the planner calls this vehicle's place, e.g. "2/4"; empty without one."""
    slot_error_m: tuple[float, ...] = ()
    """Distance from the planned place at the time of its newest position."""
    lag_s: tuple[float, ...] = ()
    """How much later than planned it comes by; negative: earlier. NaN where its course does not move, and until it is
    on its slot: before, there is nothing to be late for."""
    link: tuple[str, ...] = ()
    signing: tuple[str, ...] = ()
    """What signatures are worth: "unsigned", "signed, not verified", "signed by us", "unknown key"."""
    problem: tuple[str, ...] = ()
    """Why it is not commanded (two vehicles with one id, an unknown key); empty if it is."""
    layer_m: tuple[float, ...] = ()
    """The height above its home that it flies at for its team; NaN without a team."""
    goal_m: tuple[Vec3, ...] = ()
    """The place that it is being flown to, or round; NaN where its course has none."""
    goal_radius_m: tuple[float, ...] = ()
    """Of the circle about `goal_m` that it flies; 0: it goes there."""
    camera: tuple[bool | None, ...] = ()
    """Whether a camera showed; False: it was asked and showed none (which is no proof), None: nobody knows."""
    gimbal: tuple[bool | None, ...] = ()
    """As `camera`."""
    tracks: tuple[Track, ...] = ()
    """What the vehicles' sensors have found, ordered by id."""
    wind_m_s: tuple[float, float] | None = None
    """Where the air moves to (east, north), as the fleet estimates it; None when nobody knows."""

    def rows(self) -> list[VehicleRow]:
        """The vehicles one by one."""
        return list(map(VehicleRow._make, zip(*_columns(self), strict=True)))

    def row(self, vehicle: int) -> VehicleRow | None:
        """One vehicle, if the frame has it."""
        if vehicle not in self.ids:
            return None
        index = self.ids.index(vehicle)
        return VehicleRow(*(column[index] for column in _columns(self)))


_columns = attrgetter(*("ids" if name == "id" else name for name in VehicleRow._fields))
