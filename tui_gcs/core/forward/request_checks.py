"""Checks of requests by other stations: where a command or mission item leads, and whether that is allowed.

What cannot be read with certainty (a height whose zero is not known, half a place) is refused. Numbers: MAV_CMD,
MAV_FRAME of common.xml. How autopilots read heights: ArduCopter 4.7 and PX4 1.17, measured.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

from shapely.geometry import LineString, Point

from tui_gcs.core.firmware.foreign_command_policy import foreign_command_policy
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.forward.foreign_missions import ForeignCommand, ForeignMission
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.guard.guard import SPEED_TOLERANCE, Guard
from tui_gcs.core.guard.motion_prediction import MotionModel, VehicleState
from tui_gcs.core.guard.permission import OrderClass
from tui_gcs.core.mavlink.dialect import MavlinkMessage
from tui_gcs.core.motion.course import PositionTarget
from tui_gcs.core.protocol.common import Vec3

AMSL_FRAMES = frozenset({0, 5})
"""MAV_FRAME_GLOBAL and its _INT twin: heights above sea level."""
# Terrain frames are not read: without terrain data ArduCopter sinks into the ground.
RELATIVE_FRAMES = frozenset({3, 6})
"""MAV_FRAME_GLOBAL_RELATIVE_ALT and its _INT twin: heights above home."""
BAND_TOLERANCE_M = 0.5
"""The same as the guard's."""
MAX_RADIUS_M = 10_000.0
"""Largest radius of a circle to fly."""


MISSION_UNSUPPORTED_FRAME, MISSION_UNSUPPORTED, MISSION_NO_SPACE, MISSION_INVALID_SEQUENCE = 2, 3, 4, 13
MISSION_DENIED, MISSION_CANCELLED = 14, 15
"""MAV_MISSION_RESULT."""
QUIET = frozenset({"log read", "message rates", "mission read", "mission upload item", "parameter read", "request"})
"""What is passed on without an event; the uplink journals it."""


ParameterCheck = Callable[[Vehicle, str, int, float], str]
"""Returns why a parameter of a vehicle may not have the value of a PARAM_SET, by its id, type and value; or ""."""


def no_parameter_problem(vehicle: Vehicle, name: str, kind: int, value: float) -> str:
    """Know of no range of any parameter."""
    return ""


class ForeignRefusal(Exception):
    """Why a request is not passed on, in the operator's words."""

    def __init__(self, why: str, mission_result: int = MISSION_DENIED) -> None:
        super().__init__(why)
        self.mission_result = mission_result


class Ruling(NamedTuple):
    """The request may be passed on as `what`, in the operator's words, or not, because of `why_not`."""

    what: str = ""
    why_not: str = ""
    order_class: OrderClass = OrderClass.SET
    mission_result: int = MISSION_DENIED
    """MAV_MISSION_RESULT that answers a refused message of the mission protocol."""
    arms: bool = False
    """Whether it arms the vehicle."""

    @property
    def quiet(self) -> bool:
        """Whether it only reads, or is one of many frames of something that was reported: it then makes no event."""
        return self.what in QUIET


def stop(what: str) -> Ruling:
    """A hold, return, landing or disarming: it is never vetoed, nor held up by other requests."""
    return Ruling(what, order_class=OrderClass.STOP)


def start(what: str) -> Ruling:
    """An order by which a vehicle on the ground begins to fly."""
    return Ruling(what, order_class=OrderClass.START)


@dataclass(frozen=True)
class ForeignRequest:
    """One message of another station for one vehicle, and what is needed to check it."""

    message: MavlinkMessage
    vehicle: Vehicle
    guard: Guard
    local: LocalFrame
    """The scenario's frame, for degrees."""
    others: Iterable[Vehicle]
    """Vehicles to keep clear of; the vehicle itself may be among them."""
    now: float
    plan: ForeignMission
    """The mission that other stations have put on the vehicle."""
    upload: ForeignMission | None = None
    """The upload of this sender to the vehicle as far as it was collected, None while there is none."""
    parameter_problem: ParameterCheck = no_parameter_problem

    @property
    def name(self) -> str:
        """MAVLink's name of the message."""
        return self.message.name

    @property
    def fields(self) -> dict[str, Any]:
        """The values of the message by name."""
        return self.message.fields


def require_integer(value: float, most: int) -> int:
    """`value` as a whole number from 0 to `most`. Raises `ForeignRefusal`."""
    # Autopilots round and cut such numbers differently.
    if not (0 <= value <= most and value == int(value)):
        raise ForeignRefusal(f"{value:g} is no whole number within 0…{most}")
    return int(value)


def require_speed(request: ForeignRequest, speed_m_s: float) -> None:
    """Raise `ForeignRefusal` for a speed above the scenario's limit.

    A negative one, or NaN, keeps the present speed.
    """
    limit = request.guard.limits_of(request.vehicle.id).speed_m_s
    if speed_m_s > limit * SPEED_TOLERANCE:
        raise ForeignRefusal(f"{speed_m_s:.1f} m/s asked, {limit:.1f} allowed")


def place_m(request: ForeignRequest, order: ForeignCommand) -> tuple[float, float] | None:
    """(x, y) in ENU metres of a command's place, None for the vehicle's own.

    Raises:
        ForeignRefusal: it is no place on Earth.
    """
    place = order.degrees()
    if place is None:
        return None
    lat_deg, lon_deg = place
    if not (abs(lat_deg) <= 90 and abs(lon_deg) <= 180):
        raise ForeignRefusal("its latitude and longitude are no place")
    x, y = request.local.to_enu(lat_deg, lon_deg)
    return float(x), float(y)


def command_height_m(request: ForeignRequest, order: ForeignCommand) -> float:
    """Height above home to which a command (no mission item) leads; NaN where it gives none.

    ArduPilot goes by the frame, and takes a COMMAND_LONG's height as above home. PX4 takes every height as above sea
    level, whatever the frame.

    Raises:
        ForeignRefusal: another frame or autopilot, or the zero of its height is not known.
    """
    policy = foreign_command_policy(request.vehicle)
    if math.isnan(order.param(7)):
        return math.nan
    if policy.heights_above_sea:
        if order.frame is not None and order.frame not in AMSL_FRAMES:
            raise ForeignRefusal("PX4 takes every height as above sea level: send it so (frame 0 or 5)")
        return _above_home_m(request.vehicle, order.param(7))
    if order.frame is None:
        if not policy.heights_above_home:
            raise ForeignRefusal("how this autopilot takes the height is not known")
        return order.param(7)
    return framed_height_m(request, order)


def framed_height_m(request: ForeignRequest, order: ForeignCommand) -> float:
    """Height above home by the command's frame. Raises `ForeignRefusal` for a frame that is not read."""
    if order.frame in RELATIVE_FRAMES:
        return order.param(7)
    if order.frame in AMSL_FRAMES:
        return _above_home_m(request.vehicle, order.param(7))
    why = f"heights in frame {order.frame} cannot be checked: use above home (3, 6) or sea level (0, 5)"
    raise ForeignRefusal(why, MISSION_UNSUPPORTED_FRAME)


def _above_home_m(vehicle: Vehicle, alt_amsl_m: float) -> float:
    # Both heights come in one message, so their difference is the height of its home.
    home_amsl_m = vehicle.telemetry.alt_amsl_m - vehicle.telemetry.alt_rel_m
    if math.isnan(home_amsl_m):
        raise ForeignRefusal("its home's height above sea level is not known yet")
    return alt_amsl_m - home_amsl_m


def require_inside(request: ForeignRequest, xy_m: tuple[float, float], radius_m: float = 0.0) -> None:
    """Raise `ForeignRefusal` unless the place, and the circle around it, lie inside the allowed region."""
    where = f"({xy_m[0]:.0f}, {xy_m[1]:.0f}) m"
    if not request.guard.inside((*xy_m, 0.0)):
        raise ForeignRefusal(f"{where} is outside the operating area")
    if radius_m == 0:
        return
    if not radius_m <= MAX_RADIUS_M or not request.guard.allowed.covers(Point(xy_m).buffer(radius_m)):
        raise ForeignRefusal(f"a circle of {radius_m:.0f} m about {where} leaves the operating area")


def require_band(request: ForeignRequest, height_m: float, *, climbing: bool = False) -> None:
    """Raise `ForeignRefusal` unless the height lies in the area's altitude band; `climbing`: only not above it."""
    area = request.guard.area
    low = 0.0 if climbing else area.alt_min_m - BAND_TOLERANCE_M
    if not low <= height_m <= area.alt_max_m + BAND_TOLERANCE_M:
        band = f"{area.alt_min_m:.0f}-{area.alt_max_m:.0f} m"
        raise ForeignRefusal(f"{height_m:.1f} m above home is outside the altitude band {band}")


def require_way(request: ForeignRequest, xy_m: tuple[float, float], start_m: tuple[float, float] | None = None) -> None:
    """Raise `ForeignRefusal` if the straight way there leaves the area. From outside, what leads inside is allowed.

    `start_m`: the beginning of the way; the vehicle's place if None.
    """
    start = start_m or here_m(request.vehicle)
    way = LineString([start, xy_m])
    if way.length > 0 and request.guard.inside((*start, 0.0)) and not request.guard.allowed.covers(way):
        from_m = f"from ({start_m[0]:.0f}, {start_m[1]:.0f}) m " if start_m else ""
        raise ForeignRefusal(f"the straight way {from_m}there leaves the operating area")


def require_apart(request: ForeignRequest, goal_m: Vec3) -> None:
    """Raise `ForeignRefusal` if another vehicle is at the goal, or comes too close on the way in the next seconds."""
    me, limits = request.vehicle, request.guard.limits
    goes = VehicleState(
        me.id,
        me.telemetry.position_m,
        me.telemetry.velocity_m_s,
        MotionModel.FOLLOWS,
        PositionTarget(goal_m, request.guard.limits_of(me.id).speed_m_s),
    )
    others = []
    for other in request.others:
        if other.id == me.id or not other.telemetry.airborne or not other.telemetry.has_position():
            continue
        level = math.dist(goal_m[:2], other.telemetry.position_m[:2])
        upright = abs(goal_m[2] - other.telemetry.position_m[2])
        if level < limits.separation_horizontal_m and upright < limits.separation_vertical_m:
            raise ForeignRefusal(f"vehicle {other.id} is there")
        others.append(VehicleState(other.id, other.telemetry.position_m, other.telemetry.velocity_m_s))
    verdict = request.guard.separation(goes, others, request.now)
    if not verdict.ok:
        raise ForeignRefusal(verdict.text)


def means_here(request: ForeignRequest, order: ForeignCommand) -> bool:
    """Whether a command names no place. ArduPilot takes 0, 0 for that, others fly there."""
    place = order.degrees()
    return place is None or (place == (0.0, 0.0) and foreign_command_policy(request.vehicle).zero_is_here)


def here_m(vehicle: Vehicle) -> tuple[float, float]:
    """The vehicle's place. Raises `ForeignRefusal` while that is not known."""
    if not vehicle.telemetry.has_position():
        raise ForeignRefusal("where it is, is not known")
    return vehicle.telemetry.position_m[:2]
