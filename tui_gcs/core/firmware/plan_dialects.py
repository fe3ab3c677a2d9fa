"""Plan dialects: how each autopilot wants plans sent, what it keeps of them, and what it does not take.

Measured on real ArduCopter and PX4 (docs/autopilots.md "Missions, fence, rally" and "Mission / fence / rally"); which
parameters are kept is what came back. A dialect turns a plan into the items that travel and back, and reduces items to
what the vehicle keeps of them, so that what was sent and what is held can be compared.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4
from tui_gcs.core.plans.model import (
    AMSL,
    ARDUPILOT_HERE,
    CIRCLES,
    FENCE_COMMANDS,
    HERE,
    JUMP,
    LAND,
    LOITER_TIME,
    LOITER_TO_ALT,
    LOITER_TURNS,
    LOITER_UNLIMITED,
    MISSION_FRAME,
    PLACES,
    PLAIN_FRAME,
    POLYGON_IN,
    POLYGONS,
    RALLY_POINT,
    RETURN,
    ROI_LOCATION,
    SPLINE,
    TAKE_OFF,
    TERRAIN,
    VTOL_LAND,
    VTOL_TAKE_OFF,
    WAYPOINT,
    Plan,
    PlanItem,
    PlanKind,
    fence_shapes,
    float32,
)

MISSION_MODES = frozenset({"AUTO", "AUTO_RTL", "MISSION"})
"""Modes in which the plan on board is being flown."""
ROI_NONE, SET_ROI = 197, 201
"""DO_SET_ROI_NONE; DO_SET_ROI, which is superseded by it and by DO_SET_ROI_LOCATION."""
OLD_ROI = {ROI_LOCATION: 3.0, ROI_NONE: 0.0}
"""The MAV_ROI in the first parameter of DO_SET_ROI that means the same."""
CMD_SET_CURRENT = 224
"""MAV_CMD_DO_SET_MISSION_CURRENT."""

Rule = Callable[[float], float]
Rules = tuple[Rule, Rule, Rule, Rule]


def _same(value: float) -> float:
    return value


def _dropped(value: float) -> float:
    return 0.0


def _whole(value: float) -> float:
    return float(math.trunc(value)) if math.isfinite(value) else 0.0


def _flag(value: float) -> float:
    return 1.0 if value > 0 else 0.0


def _sign(value: float) -> float:
    return -1.0 if value < 0 else 1.0


def _yaw(value: float) -> float:
    """Degrees from 0 up; NaN leaves the heading to the autopilot."""
    # Twice: a hair below 0 is 360.0 after the first time.
    return value % 360.0 % 360.0 if math.isfinite(value) else value


def _turns(value: float) -> float:
    """ArduPilot keeps whole turns up to 255, and parts of one turn in 256ths."""
    return math.trunc(value * 256.0) / 256.0 if 0 < value < 1 else min(255.0, _whole(value))


def _radius(value: float) -> float:
    """ArduPilot keeps whole metres up to 255, then tens of metres."""
    size = abs(value)
    kept = math.trunc(size) if size <= 255 else 10 * min(255, math.trunc(size * 0.1 + 1e-6))
    return math.copysign(kept, value) if math.isfinite(value) else 0.0


NOTHING: Rules = (_dropped, _dropped, _dropped, _dropped)
FIRST: Rules = (_same, _dropped, _dropped, _dropped)
EVERYTHING: Rules = (_same, _same, _same, _same)


@dataclass(frozen=True)
class PlanDialect:
    """How one autopilot handles plans."""

    name: str
    has_home: bool = False
    """Item 0 of a mission is home: not a part of the plan."""
    patience_s: float = 0.0
    """How long an item is left to the vehicle to request again before it is sent again by itself."""
    gives_up_s: float = math.inf
    """After this long without a question the vehicle forgets that it is being read."""
    reports_on_request: bool = False
    """MISSION_CURRENT does not come by itself, but on request."""
    checks_after_upload: bool = False
    """An accepted mission is checked only then: MISSION_CURRENT shows whether it can be flown."""
    rejections: frozenset[int] = frozenset()
    """Ids of EVENTs that report that the mission on board cannot be flown."""
    sets_by_command: bool = True
    """DO_SET_MISSION_CURRENT is understood; else the MISSION_SET_CURRENT message."""
    most: tuple[int | None, int | None, int | None] = (None, None, None)
    """Largest number of items of a mission, fence, rally plan, where known."""
    most_vertices: int | None = None
    """Largest number of vertices of one fence polygon."""
    plain_numbers: bool = False
    """NaN is no number for it: a parameter that is not set is 0."""
    terrain: bool = True
    """Heights above the ground are understood."""
    terrain_blind: bool = False
    """Heights above the ground are flown without terrain data as well: into the ground."""
    home_inside: bool = False
    """A fence that does not contain home is dropped after it was accepted."""
    fence_text: str = ""
    """How its text begins when it has dropped a part of a fence."""
    kept: "dict[int, Rules] | None" = None
    """What is kept of a command's parameters; None: all of them. Commands not listed are kept, or come back as 0."""
    z_tolerance_m: float = 0.001
    old_roi: bool = False
    """A region of interest travels as the superseded command."""
    commands: frozenset[int] | None = None
    """Commands that it takes in a mission; None: not known."""
    here: frozenset[int] = ARDUPILOT_HERE
    """Commands that it does where it is then if their latitude and longitude are 0; to the others it would fly."""

    def to_wire(self, plan: Plan) -> tuple[PlanItem, ...]:
        """The items as they are sent, seq 0 first."""
        items = plan.items
        if plan.kind is PlanKind.FENCE:  # PX4 takes the vertices of a polygon after a circle for circles
            shapes = sorted(fence_shapes(items), key=lambda shape: shape.command not in POLYGONS)
            items = tuple(item for shape in shapes for item in shape.items)
        sent = tuple(self._plain(self._framed(item, +self._home_items(plan.kind))) for item in map(self._as_old, items))
        return (HOME_PLACE_HOLDER, *sent) if self._home_items(plan.kind) else sent

    def from_wire(self, kind: PlanKind, items: tuple[PlanItem, ...]) -> Plan:
        """The plan that a vehicle sent."""
        shift = self._home_items(kind)
        return Plan(kind, tuple(self._as_new(self._framed(item, -shift)) for item in items[shift:]))

    def index_of(self, seq: int) -> int:
        """Index in the plan of a mission's seq; -1 is ArduPilot's home."""
        return seq - self._home_items(PlanKind.MISSION)

    def seq_of(self, index: int) -> int:
        """Seq of an index in the plan."""
        return index + self._home_items(PlanKind.MISSION)

    def wire_count(self, plan: Plan) -> int:
        """How many items of a plan travel."""
        return len(plan.items) + self._home_items(plan.kind)

    def _home_items(self, kind: PlanKind) -> int:
        return int(self.has_home and kind is PlanKind.MISSION)

    def _framed(self, item: PlanItem, shift: int) -> PlanItem:
        """An item with its frame as every autopilot takes it, and with jumps that count home, or not."""
        if item.command in FENCE_COMMANDS:
            return replace(item, frame=AMSL, z=0.0)
        frame = PLAIN_FRAME.get(item.frame, item.frame)
        if item.command not in PLACES and item.x == 0 and item.y == 0:
            frame = MISSION_FRAME
        if item.command == JUMP:
            return replace(item, frame=frame, params=(item.params[0] + shift, *item.params[1:]))
        return replace(item, frame=frame)

    def _as_old(self, item: PlanItem) -> PlanItem:
        if not self.old_roi or item.command not in OLD_ROI:
            return item
        return replace(item, command=SET_ROI, params=(OLD_ROI[item.command], 0.0, 0.0, 0.0))

    def _as_new(self, item: PlanItem) -> PlanItem:
        if not self.old_roi or item.command != SET_ROI:
            return item
        is_place = bool(item.x or item.y)
        for command, roi in OLD_ROI.items():
            if item.params[0] == roi and is_place == (command == ROI_LOCATION):
                return replace(item, command=command, params=(0.0, 0.0, 0.0, 0.0))
        return item

    def _plain(self, item: PlanItem) -> PlanItem:
        if not self.plain_numbers or item.command not in PLACES:
            return item
        one, two, three, four = (0.0 if math.isnan(value) else value for value in item.params)
        return replace(item, params=(one, two, three, four))

    def stored(self, kind: PlanKind, item: PlanItem) -> PlanItem:
        """What the vehicle is known to keep of an item: comparisons reduce both sides to that."""
        item = self._as_new(item)
        rules = self.rules(item.command)
        one, two, three, four = (rule(float32(value)) for rule, value in zip(rules, item.params, strict=True))
        kept = replace(self._framed(item, 0), params=(one, two, three, four), z=float32(item.z))
        if kind is not PlanKind.MISSION or self.has_home:
            # It comes back always true, or always false, whatever was sent.
            kept = replace(kept, autocontinue=True)  # always true, or always false, whatever was sent
        if self.has_home and item.command not in PLACES:
            kept = replace(kept, frame=MISSION_FRAME if kept.frame == AMSL else kept.frame)
            if self.is_listed(item.command):
                kept = replace(kept, frame=MISSION_FRAME, x=0, y=0, z=0.0)
        if self.has_home and kind is PlanKind.RALLY:
            kept = replace(kept, z=_whole(kept.z))
        return kept

    def rules(self, command: int) -> Rules:
        """What is kept of a command's four parameters."""
        return EVERYTHING if self.kept is None else self.kept.get(command, EVERYTHING)

    def is_listed(self, command: int) -> bool:
        """Whether it is known what is kept of a command: else what comes back as 0 was simply not kept."""
        return self.kept is None or command in self.kept

    def problems(self, plan: Plan, home_deg: tuple[float, float] | None) -> list[str]:
        """Why this autopilot would refuse or spoil `plan`; `home_deg` is (latitude, longitude), None if unknown."""
        found = []
        most = self.most[plan.kind]
        if most is not None and self.wire_count(plan) > most:
            home = " (home is one of them)" if self._home_items(plan.kind) else ""
            found.append(f"{self.wire_count(plan)} items, {self.name} holds {most}{home}")
        if not self.terrain and any(PLAIN_FRAME.get(item.frame) == TERRAIN for item in plan.items):
            found.append(f"{self.name} knows no heights above the ground")
        nowhere = [i for i, item in enumerate(plan.items, 1) if item.has_no_place and item.command not in self.here]
        if nowhere:
            found.append(f"item {nowhere[0]} has no place (0, 0): {self.name} would fly there")
        if plan.kind is PlanKind.FENCE:
            found += self._fence_problems(plan, home_deg)
        return found

    def _fence_problems(self, plan: Plan, home_deg: tuple[float, float] | None) -> list[str]:
        found = []
        for shape in fence_shapes(plan.items):
            if self.most_vertices is not None and len(shape.items) > self.most_vertices:
                found.append(f"{shape.text}: {self.name} takes {self.most_vertices}")
            if self.home_inside and home_deg is not None and not _allows(shape.command, shape.items, home_deg):
                found.append(f"{shape.text}: home is outside of what it allows, {self.name} would drop it")
        return found

    def flies_blind(self, plan: Plan) -> bool:
        """Whether a plan is dangerous unless the vehicle has terrain data."""
        above_ground = any(PLAIN_FRAME.get(item.frame) == TERRAIN for item in plan.items)
        return self.terrain_blind and plan.kind is PlanKind.MISSION and above_ground

    def flies_mission(self, vehicle: Vehicle) -> bool:
        """Whether the vehicle is flying its mission now."""
        mode = vehicle.mode_name
        return vehicle.telemetry.armed and mode in MISSION_MODES


HOME_PLACE_HOLDER = PlanItem(WAYPOINT, AMSL)
"""Sent as item 0: ArduPilot puts its real home there, whatever is sent."""


def _allows(command: int, items: tuple[PlanItem, ...], at_deg: tuple[float, float]) -> bool:
    """Whether a fence shape lets a vehicle be at (latitude, longitude)."""
    if command in CIRCLES:
        north_m = (at_deg[0] - items[0].lat_deg) * 111_195.0
        east_m = (at_deg[1] - items[0].lon_deg) * 111_195.0 * math.cos(math.radians(at_deg[0]))
        return (math.hypot(north_m, east_m) <= items[0].params[0]) == (command not in OUTSIDE)
    if command in POLYGONS:
        return _is_inside(items, at_deg) == (command == POLYGON_IN)
    return True


OUTSIDE = frozenset({5002, 5004})
"""Exclusion polygons and circles."""


def _is_inside(items: tuple[PlanItem, ...], at_deg: tuple[float, float]) -> bool:
    """Whether a point is inside a polygon by the even-odd rule, in degrees."""
    lat, lon = at_deg
    inside = False
    for a, b in zip(items, (*items[1:], items[0]), strict=True):
        if (a.lat_deg > lat) != (b.lat_deg > lat):
            crossing = a.lon_deg + (lat - a.lat_deg) / (b.lat_deg - a.lat_deg) * (b.lon_deg - a.lon_deg)
            inside ^= lon < crossing
    return inside


GENERIC = PlanDialect("this autopilot", patience_s=2.0)

_ARDUPILOT_KEPT: dict[int, Rules] = {
    WAYPOINT: (_whole, _dropped, _dropped, _dropped),
    LOITER_UNLIMITED: (_dropped, _dropped, _whole, _dropped),
    LOITER_TURNS: (_turns, _dropped, _radius, _flag),
    LOITER_TIME: (_whole, _dropped, _sign, _flag),
    RETURN: NOTHING,
    LAND: (_whole, _dropped, _dropped, _sign),
    TAKE_OFF: (_whole, _dropped, _dropped, _dropped),
    LOITER_TO_ALT: (_dropped, _whole, _dropped, _flag),
    SPLINE: (_whole, _dropped, _dropped, _dropped),
    VTOL_TAKE_OFF: NOTHING,
    VTOL_LAND: (_whole, _dropped, _dropped, _dropped),
    93: (_same, _whole, _whole, _whole),
    112: FIRST,
    114: FIRST,
    115: (_same, _same, _whole, _whole),
    JUMP: (_whole, _whole, _dropped, _dropped),
    178: (_whole, _same, _same, _dropped),
    206: (_same, _dropped, _whole, _dropped),
    ROI_LOCATION: NOTHING,
    ROI_NONE: NOTHING,
    207: (_whole, _dropped, _dropped, _dropped),
    211: (_whole, _whole, _dropped, _dropped),
    POLYGON_IN: FIRST,
    5002: FIRST,
    5003: FIRST,
    5004: FIRST,
    5000: NOTHING,
    RALLY_POINT: NOTHING,
}
_PLANE_KEPT = _ARDUPILOT_KEPT | {WAYPOINT: (_dropped, _whole, _whole, _dropped)}
_PLANE_TYPES = frozenset({1, 7, 16, 17, 19, 20, 21, 22, 23, 24, 25, 28})
"""MAV_TYPE of what ArduPlane flies."""

ARDUPILOT = PlanDialect(
    "ArduPilot",
    has_home=True,
    reports_on_request=True,
    plain_numbers=True,
    terrain_blind=True,
    most_vertices=255,
    kept=_ARDUPILOT_KEPT,
    z_tolerance_m=0.0101,
    old_roi=True,
    commands=frozenset(
        {16, 17, 18, 19, 20, 21, 22, 30, 31, 82, 83, 84, 85, 92, 93, 94, 112, 114, 115, 177, 178, 179}
        | {181, 182, 183, 184, 188, 189, 191, 193, 194, 195, 197, 201, 202, 203, 205, 206, 207, 208, 210, 211, 212, 213}
        | {215, 216, 217, 218, 222, 223, 531, 532, 534, 600, 601, 1000, 2000, 2001, 2500, 2501, 3000}
        | {42600, 42702, 42703}
    ),
)
"""ArduPilot keeps heights as whole centimetres, cut."""
ARDUPLANE = replace(ARDUPILOT, kept=_PLANE_KEPT, commands=None)

_PX4_REJECTIONS = frozenset(
    # navigator_mis_… in PX4's event metadata: first_wp_far, geofence_no_home, geofence_no_home2, geofence_violation,
    # no_home_rel_alt, no_pos_lock, unsup_cmd, wp_gate_too_close
    {0x1511709, 0x1586D81, 0x134B0C9, 0x12B352D, 0x1338C52, 0x17F06FD, 0x185E823, 0x1CC23D0}
    # takeoff_missing, takeoff_not_first, takeoff_or_land_missing, takeoff_too_low, vtol_items
    | {0x153D6E2, 0x1FE4222, 0x1BA879E, 0x1BA4A6D, 0x1AFCEB9}
    # add_land_or_rm_to, add_to_or_rm_land, approach_wp_below_land, glide_slope_too_steep, invalid_land
    | {0x12A432E, 0x1FBEA7E, 0x130CDE3, 0x148D925, 0x1D4F46A}
    # land_before_rtl, land_missing, land_wp_inside_orbit_radius, multiple_land, starts_w_landing, starts_w_landing2,
    # unsupported_landing_approach_wp
    | {0x177F1B9, 0x1811691, 0x187B8F5, 0x1C2D3D5, 0x15D73E8, 0x11D602E, 0x1095D93}
)

PX4 = PlanDialect(
    "PX4",
    gives_up_s=5.0,
    checks_after_upload=True,
    rejections=_PX4_REJECTIONS,
    sets_by_command=False,
    most=(10_000, 64, 32),
    terrain=False,
    here=HERE,
    home_inside=True,
    fence_text="Geofence invalid",
    kept={
        WAYPOINT: (_same, _same, _dropped, _yaw),
        LOITER_UNLIMITED: (_dropped, _dropped, _same, _yaw),
        LOITER_TIME: (_same, _flag, _same, _flag),
        LAND: (_dropped, _whole, _dropped, _yaw),
        TAKE_OFF: (_dropped, _dropped, _dropped, _yaw),
        LOITER_TO_ALT: (_flag, _same, _dropped, _flag),
        VTOL_TAKE_OFF: (_dropped, _dropped, _dropped, _yaw),
        VTOL_LAND: (_dropped, _dropped, _dropped, _yaw),
        ROI_LOCATION: NOTHING,
        POLYGON_IN: FIRST,
        5002: FIRST,
        5003: FIRST,
        5004: FIRST,
        5000: NOTHING,
        RALLY_POINT: NOTHING,
    },
    commands=frozenset(
        {16, 17, 19, 20, 21, 22, 31, 80, 84, 85, 93, 112, 114, 177, 178, 179, 187, 189, 195, 196, 197, 200, 201, 203}
        | {204, 205, 206, 211, 214, 260, 530, 532, 534, 1000, 1001, 2000, 2001, 2003, 2500, 2501, 3000, 4501, 42600}
    ),
)


def dialect_for(autopilot: int | None) -> PlanDialect:
    """The dialect of a multicopter's autopilot (MAV_AUTOPILOT); None: an unknown vehicle's."""
    return {AUTOPILOT_PX4: PX4, AUTOPILOT_ARDUPILOT: ARDUPILOT}.get(autopilot or 0, GENERIC)


def dialect_of(vehicle: Vehicle) -> PlanDialect:
    """The dialect of a vehicle's autopilot."""
    if vehicle.autopilot == AUTOPILOT_PX4:
        return PX4
    if vehicle.autopilot == AUTOPILOT_ARDUPILOT:
        return ARDUPLANE if vehicle.type in _PLANE_TYPES else ARDUPILOT
    return GENERIC
