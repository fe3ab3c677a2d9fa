"""Rules for missions of other stations: they may always be read.

Items and the ways between them may lead only where vehicles may be. `MissionRelay` collects an upload by these rules.
The fence is this station's. A mission is started for others only if its whole upload passed through here. Numbers:
MAV_CMD, MAV_MISSION_TYPE of common.xml.
"""

from tui_gcs.core.firmware.foreign_command_policy import foreign_command_policy
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.forward.foreign_missions import ForeignCommand, ForeignMission, MissionStep, Position, read_command
from tui_gcs.core.forward.request_checks import (
    MISSION_INVALID_SEQUENCE,
    MISSION_NO_SPACE,
    MISSION_UNSUPPORTED,
    ForeignRefusal,
    ForeignRequest,
    Ruling,
    framed_height_m,
    here_m,
    means_here,
    place_m,
    require_band,
    require_inside,
    require_integer,
    require_speed,
    require_way,
    start,
)

FLIES_MISSION = frozenset({"AUTO", "AUTO_RTL", "MISSION"})
"""Modes in which the mission on board is flown."""
FENCE, ALL_MISSIONS = 1, 255
"""MAV_MISSION_TYPE."""
MAX_ITEMS = 10_000
"""Longest upload that is collected: as many items as PX4 takes."""
# MAV_CMD of items (common.xml).
CHANGE_SPEED, JUMP, WAYPOINT = 178, 177, 16
ITEM_PLACES = frozenset({16, 17, 18, 19, 21, 22, 31, 84, 85, 5100})
"""Items that are flown to on a straight way: way-points (no splines), loitering, landing, take-off, rally points."""
ITEM_HERE = frozenset({21, 22, 84, 85})
"""Items that may name no place (0, 0): they mean where the vehicle is then."""
# Landing and take-off of copters, and those of VTOLs.
ITEM_LANDINGS, ITEM_TAKE_OFFS = frozenset({21, 85}), frozenset({22, 84})
ITEM_RADIUS = {17: 3, 18: 3, 19: 3, 31: 2}
"""Number of the parameter that holds the radius to circle at."""
ITEM_PLAIN = frozenset({20, 93, 112, 114, 115, 195, 197, 201, 203, 205, 206, 214, 530, 600})
ITEM_PLAIN |= {1000, 1001, 2000, 2001, 2500, 2501}
"""Items that need no check: return, delays, conditions, region of interest, camera and gimbal."""


def mission_read(request: ForeignRequest) -> Ruling:
    """A request or answer that reads the mission, or takes part in any transfer. Raises `ForeignRefusal`."""
    _mission_type(request)
    return Ruling("mission read")


def mission_write(request: ForeignRequest) -> Ruling:
    """The beginning of an upload, or the deletion of all items. Raises `ForeignRefusal`."""
    if _mission_type(request, writes=True) == 0:
        require_no_mission(request.vehicle)
    if request.fields.get("count", 0) > MAX_ITEMS:
        raise ForeignRefusal(f"more than {MAX_ITEMS} items", MISSION_NO_SPACE)
    return Ruling("mission clear" if request.name == "MISSION_CLEAR_ALL" else "mission upload")


def mission_part(request: ForeignRequest) -> Ruling:
    """Some items in the midst of a mission: always refused, for the ways to and from them are not known."""
    _mission_type(request, writes=True)
    raise ForeignRefusal("a part of a mission cannot be checked: upload it whole")


def require_no_mission(vehicle: Vehicle) -> None:
    """Raise `ForeignRefusal` while it flies its mission: ArduPilot flies to each new item at once."""
    mode = vehicle.mode_name
    if vehicle.telemetry.armed and mode in FLIES_MISSION:
        raise ForeignRefusal("it flies its mission: have it hold before you change that")


def _mission_type(request: ForeignRequest, *, writes: bool = False) -> int:
    kind: int = request.fields["mission_type"]
    if writes and kind in (FENCE, ALL_MISSIONS):
        raise ForeignRefusal("would change the fence")
    if kind not in (0, 1, 2):
        raise ForeignRefusal(f"unknown mission type {kind}", MISSION_UNSUPPORTED)
    return kind


def mission_item(request: ForeignRequest) -> Ruling:
    """One item of an upload. Raises `ForeignRefusal`."""
    _mission_type(request, writes=True)
    if request.fields["current"] not in (0, 1):  # 2 and 3: ArduPilot flies there at once
        raise ForeignRefusal("a guided way-point is a set-point")
    try:
        mission_step_of(request)
    except ForeignRefusal as refused:
        raise ForeignRefusal(f"mission item {request.fields['seq']}: {refused}", refused.mission_result) from None
    return Ruling("mission upload item")


def mission_step_of(request: ForeignRequest) -> MissionStep:
    """An item of the upload as it will be flown. Raises `ForeignRefusal` if it, or the way there, may not be."""
    step = _step(request)
    upload = _require_turn(request)
    seq = request.fields["seq"]
    if seq < len(upload.steps) and repr(upload.steps[seq].order) != repr(step.order):  # by repr: NaN is like NaN
        why = "it has come already, and was different: upload the mission anew"
        raise ForeignRefusal(why, MISSION_INVALID_SEQUENCE)
    if seq == len(upload.steps) and request.fields["mission_type"] == 0:
        require_no_mission(request.vehicle)
        _require_ways(request, upload, step)
    return step


def _step(request: ForeignRequest) -> MissionStep:
    """An item as it will be flown. Raises `ForeignRefusal` if it leads where no vehicle may go."""
    seq, order = request.fields["seq"], read_command(request.message)
    policy = foreign_command_policy(request.vehicle)
    if seq == 0 and request.fields["mission_type"] == 0 and policy.first_item_is_home and order.command == WAYPOINT:
        return MissionStep(order)  # stored as the real home, whatever is sent, and not flown to
    if order.command == JUMP:
        return MissionStep(order, jump=require_integer(order.param(1), 0xFFFF))
    there = _item_place(request, order)
    return MissionStep(order, None if policy.takes_off_here and order.command in ITEM_TAKE_OFFS else there)


def _item_place(request: ForeignRequest, order: ForeignCommand) -> Position | None:
    """The place to which an item leads, None for nowhere. Raises `ForeignRefusal` if no vehicle may go there."""
    if order.command == CHANGE_SPEED:
        require_speed(request, order.param(2))
    elif order.command in ITEM_PLACES:
        is_here = order.command in ITEM_HERE and means_here(request, order)
        there = None if is_here else place_m(request, order)
        radius = ITEM_RADIUS.get(order.command)
        require_inside(request, there or here_m(request.vehicle), abs(order.param(radius)) if radius else 0.0)
        if order.command not in ITEM_LANDINGS:
            require_band(request, framed_height_m(request, order), climbing=order.command in ITEM_HERE)
        return there
    elif order.command not in ITEM_PLAIN:
        why = f"command {order.command}: not on the list of what other stations may send in a mission"
        raise ForeignRefusal(why, MISSION_UNSUPPORTED)
    return None


def _require_turn(request: ForeignRequest) -> ForeignMission:
    """The upload of which it is the next item, or one again. Raises `ForeignRefusal`."""
    upload, seq = request.upload, request.fields["seq"]
    if upload is None:
        raise ForeignRefusal("no upload of that station is under way (MISSION_COUNT comes first)")
    if seq >= upload.count or seq > len(upload.steps):
        why = f"out of order: item {len(upload.steps)} of {upload.count} comes next"
        raise ForeignRefusal(why, MISSION_INVALID_SEQUENCE)
    return upload


def _require_ways(request: ForeignRequest, upload: ForeignMission, step: MissionStep) -> None:
    """Raise `ForeignRefusal` if the ways from the items before it leave the area, or are not known."""
    seq = request.fields["seq"]
    goals = [] if step.place_m is None else [step.place_m]
    if step.jump is not None:
        # A jump forward would lead over items that were not checked yet.
        if step.jump >= seq:
            raise ForeignRefusal("jumps only back: the way to what has not come yet is not known")
        goals = upload.places_from(step.jump)
    before_m = upload.place_before(seq)
    for goal_m in goals:
        if before_m is not None:
            require_way(request, goal_m, before_m)


def require_resumable(request: ForeignRequest) -> None:
    """Raise `ForeignRefusal` unless the ways to the first and to the current item stay inside.

    The vehicle may resume at the current item or begin again at the first one.
    """
    _require_start(request, _current(request), 0)


def mission_start(request: ForeignRequest, first: float) -> Ruling:
    """The ruling on a start, which may name the `first` item. Raises `ForeignRefusal`."""
    _require_start(request, _current(request), 0, require_integer(first, 0xFFFF))
    return start("mission start")


def mission_step(request: ForeignRequest, seq: float) -> Ruling:
    """The ruling on going to an item; -1 is the current one. Raises `ForeignRefusal`."""
    _require_start(request, _current(request) if seq == -1 else require_integer(seq, 0xFFFF))
    return Ruling("mission item")


def mission_continue(request: ForeignRequest) -> Ruling:
    """The ruling on going on after a pause. Raises `ForeignRefusal`."""
    _require_start(request, _current(request))
    return Ruling("continue")


def _current(request: ForeignRequest) -> int | None:
    return request.plan.current(request.now)


def _require_start(request: ForeignRequest, *items: int | None) -> None:
    """Raise `ForeignRefusal` unless the mission is known and the ways to `items` are clear; None: to all its places."""
    plan = request.plan
    if not plan.accepted:
        raise ForeignRefusal("which mission is on board is not known: upload it through this station first")
    for item in items:
        for goal_m in plan.places() if item is None else plan.places_from(item):
            try:
                require_way(request, goal_m)
            except ForeignRefusal as refused:
                next_unknown = ", and it has not reported which item is next" if item is None else ""
                where = f"({goal_m[0]:.0f}, {goal_m[1]:.0f}) m"
                raise ForeignRefusal(f"mission: to {where}: {refused}{next_unknown}") from None
