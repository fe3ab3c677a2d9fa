"""The fleet frame: one immutable snapshot of all vehicles as it travels on the bus.

Positions are ENU metres about the scenario origin (z above home); unknown numbers are NaN.
"""

from dataclasses import dataclass
from enum import StrEnum
from operator import attrgetter
from typing import Annotated, NamedTuple

import msgspec

from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol.base import Message, Vec3
from tui_gcs.core.protocol.planning import Track
from tui_gcs.core.protocol.points import PointOfInterest

NOWHERE: Vec3 = (float("nan"), float("nan"), float("nan"))


class Phase(StrEnum):
    """What the station is doing with a vehicle."""

    GROUND = "ground"
    """Disarmed on the ground, or not under control of this station."""
    ARMING = "arming"
    TAKEOFF = "take-off"
    FLYING = "flying"
    """Airborne and following its team's planner."""
    HOLDING = "holding"
    BY_HAND = "by hand"
    """Airborne on courses of an operator, which the guard checks; `Resume` gives it back to its planner."""
    RETURNING = "returning"
    LANDING = "landing"
    TAKEN_OUT = "taken out"
    """Airborne but not steered by this station: it is lost, or in a mode that does not take set-points."""


class Freshness(StrEnum):
    """How recently a vehicle was heard. STALE: no position for 3 s; LOST: no frame of its autopilot for 3.5 s."""

    OK = "ok"
    STALE = "stale"
    LOST = "lost"


@dataclass(frozen=True)
class VisibleStep:
    """Marks a number that changes all the time: a change smaller than this looks the same on every screen."""

    step: float


class VisibleAge:
    """Marks an age in seconds: screens show whole seconds."""


class NotOnScreen:
    """Marks a value that repaints nothing when it alone changes."""


class VehicleRow(NamedTuple):
    """One vehicle of a fleet frame: the declaration of every value that a roster shows.

    `FleetFrame` has a column for each field, in the same order and with the same meaning. To add a value, declare it
    here and in `FleetFrame`, and read it from the vehicle in `core/station/fleet_frame.py`. It is shown by a line in
    `COLUMNS` of `widgets/fleet/roster.py`. The mark of a field gives the console (`feed/visible_changes.py`) the
    smallest change that is worth a repaint; unmarked: every change is.
    """

    id: int
    team: str
    autopilot: str
    vehicle_type: str
    mode: str
    armed: bool
    phase: Phase
    freshness: Freshness
    position_m: Annotated[Vec3, VisibleStep(0.1)]
    velocity_m_s: Annotated[Vec3, VisibleStep(0.1)]
    heading_deg: Annotated[float, VisibleStep(2.0)]
    lat_deg: Annotated[float, NotOnScreen]
    lon_deg: Annotated[float, NotOnScreen]
    alt_amsl_m: Annotated[float, NotOnScreen]
    battery_pct: Annotated[float, VisibleStep(1.0)]
    battery_v: Annotated[float, VisibleStep(0.1)]
    gps_fix: int
    satellites: int
    age_s: Annotated[float, VisibleAge]
    heard_age_s: Annotated[float, VisibleAge]
    loss_pct: Annotated[float, VisibleStep(0.1)]
    slot: str
    slot_error_m: Annotated[float, VisibleStep(0.1)]
    lag_s: Annotated[float, NotOnScreen]
    link: str
    signing: str
    problem: str
    layer_m: Annotated[float, NotOnScreen] = float("nan")
    goal_m: Annotated[Vec3, VisibleStep(1.0)] = NOWHERE
    goal_radius_m: Annotated[float, VisibleStep(1.0)] = 0.0
    camera: Annotated[bool | None, NotOnScreen] = None
    gimbal: Annotated[bool | None, NotOnScreen] = None
    battery_left_s: Annotated[float, VisibleStep(30.0)] = float("nan")
    home_s: Annotated[float, NotOnScreen] = float("nan")
    stop_pending: bool = False


class KeepOut(msgspec.Struct, frozen=True):
    """Where a lost vehicle may be, with the separation to be kept from it: a volume that others should not enter.

    It is everything within `radius_m` of the straight between two places, from one height to another.
    """

    vehicle: int
    begin_m: tuple[float, float]
    end_m: tuple[float, float]
    radius_m: float
    low_m: float
    high_m: float


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
    """The value of MAVLink's GPS_FIX_TYPE, 3 and above for a 3-D fix."""
    satellites: tuple[int, ...] = ()
    """Satellites in use; -1 when unknown."""
    age_s: tuple[float, ...] = ()
    """Seconds since the newest position."""
    heard_age_s: tuple[float, ...] = ()
    """Seconds since the newest frame of the autopilot, of any message."""
    loss_pct: tuple[float, ...] = ()
    slot: tuple[str, ...] = ()
    """The planner's name for this vehicle's place in its plan, e.g. "2/4"; empty without one."""
    slot_error_m: tuple[float, ...] = ()
    """Metres from the planned place at the time of its newest position."""
    lag_s: tuple[float, ...] = ()
    """Seconds that it is behind its plan; negative: ahead. NaN on a course that does not move, and before it has
    reached its slot."""
    link: tuple[str, ...] = ()
    signing: tuple[str, ...] = ()
    """How its frames are signed: "unsigned", "signed, not verified", "signed by us" or "unknown key"."""
    problem: tuple[str, ...] = ()
    """Why it is not commanded, e.g. two vehicles with one id or an unknown key; empty if it is."""
    layer_m: tuple[float, ...] = ()
    """The height above its home at which it flies for its team; NaN without a team."""
    goal_m: tuple[Vec3, ...] = ()
    """The place that its course leads to, or circles; NaN where its course has none."""
    goal_radius_m: tuple[float, ...] = ()
    """Radius of the circle that it flies about `goal_m`; 0 where it flies to the place itself."""
    camera: tuple[bool | None, ...] = ()
    """Whether a camera answered. False: it was asked and none answered, which is no proof; None: it was not asked."""
    gimbal: tuple[bool | None, ...] = ()
    """Whether a gimbal answered, with the same three values as `camera`."""
    battery_left_s: tuple[float, ...] = ()
    """Flight time until its battery is empty, in hover or at its speed limit, where it uses more; NaN while unknown."""
    home_s: tuple[float, ...] = ()
    """How long the way home and the landing take; NaN for vehicles that do not fly for a team."""
    stop_pending: tuple[bool, ...] = ()
    """Whether it was ordered to hold, to land or to disarm, and its telemetry does not confirm that yet."""
    tracks: tuple[Track, ...] = ()
    """Targets that the vehicles' sensors have detected, ordered by id."""
    points: tuple[PointOfInterest, ...] = ()
    """Open tasks from outside, in the order in which they came."""
    wind_m_s: tuple[float, float] | None = None
    """Where the air moves to (east, north), as the vehicles estimate it; None when none of them does."""
    keep_out: tuple[KeepOut, ...] = ()
    """Where lost vehicles may be, for as long as they may be there."""

    def rows(self) -> list[VehicleRow]:
        """All vehicles, one row each."""
        return list(map(VehicleRow._make, zip(*_columns(self), strict=True)))

    def row(self, vehicle: int) -> VehicleRow | None:
        """The row of one vehicle; None if the frame does not have it."""
        if vehicle not in self.ids:
            return None
        index = self.ids.index(vehicle)
        return VehicleRow(*(column[index] for column in _columns(self)))


def column_name(field: str) -> str:
    """The column of `FleetFrame` that holds this field of `VehicleRow`."""
    return "ids" if field == "id" else field


_columns = attrgetter(*map(column_name, VehicleRow._fields))


class PlannerFrame(msgspec.Struct, frozen=True):
    """The part of a fleet frame that planners work with, decoded from the same bytes.

    What it has not is skipped. Each team's worker decodes every frame that it steps on, five a second: a whole frame of
    250 vehicles (69 kB) takes 0.26 ms, this part of it 0.11 ms. In 20 teams that is 2.6 and 1.1 % of a core.
    """

    t_s: float
    ids: tuple[int, ...] = ()
    phase: tuple[Phase, ...] = ()
    freshness: tuple[Freshness, ...] = ()
    position_m: tuple[Vec3, ...] = ()
    velocity_m_s: tuple[Vec3, ...] = ()
    heading_deg: tuple[float, ...] = ()
    battery_pct: tuple[float, ...] = ()
    battery_left_s: tuple[float, ...] = ()
    home_s: tuple[float, ...] = ()
    age_s: tuple[float, ...] = ()
    tracks: tuple[Track, ...] = ()
    points: tuple[PointOfInterest, ...] = ()
    wind_m_s: tuple[float, float] | None = None
    keep_out: tuple[KeepOut, ...] = ()


AnyFrame = FleetFrame | PlannerFrame
"""A frame that a planner is stepped on."""
