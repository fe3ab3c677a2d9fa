"""Orders to the selected vehicles: for which of them each makes sense now, and how it is confirmed.

Confirmation is graded by harm (docs/threats.md D.1): in the menu of orders a stop takes Enter; what changes a flight
takes `y`; what starts several takes their number, typed, then a countdown of three seconds that Esc ends; stopping
motors takes a reason too.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum

from tui_gcs.actions.places import HELP as PLACE_HELP
from tui_gcs.actions.places import PlaceReferences, PlaceTextError, destinations
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol import flight as f
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol import setup
from tui_gcs.core.protocol.alarms import id_ranges
from tui_gcs.core.protocol.common import Freshness, Phase, Request, VehicleRow

STANDING_M_S = 0.5
"""A vehicle that is slower stands still."""
STOP_S = 3.0
"""A vehicle that brakes comes to a stop on less than the way of this time: ArduCopter needs 3.2 s from 8 m/s."""
TOWARDS_SHARE = 0.8
"""A vehicle flies towards a place if this share of its speed leads there."""


class Grade(IntEnum):
    """What an operator must do to confirm an order."""

    ENTER = 1
    YES = 2
    COUNT = 3
    KILL = 4


class OrderError(ValueError):
    """What was typed is no valid order; the text is one line for the operator."""


@dataclass(frozen=True)
class OrderField:
    """A value of an order that the operator types."""

    name: str
    label: str
    unit: str = ""
    initial: str = ""
    help: str = ""


@dataclass(frozen=True)
class OrderInput:
    """The vehicles of an order, and the values that were typed for it."""

    vehicles: tuple[int, ...]
    values: dict[str, str] = field(default_factory=dict)
    around: PlaceReferences = field(default_factory=lambda: PlaceReferences({}))

    def number(self, name: str, *, least: float = -math.inf, most: float = math.inf) -> float:
        """Return a typed number, NaN if nothing was typed. Raises `OrderError`."""
        text = self.values.get(name, "").strip()
        if not text:
            return math.nan
        try:
            value = float(text)
        except ValueError:
            raise OrderError(f"{name}: {text[:20]!r} is no number") from None
        # `float` takes `nan` and `inf`, too: a NaN height means "unchanged" on the wire.
        if not (math.isfinite(value) and least <= value <= most):
            raise OrderError(f"{name}: {value:g} is not from {least:g} to {most:g}")
        return value

    def needed(self, name: str, *, least: float = -math.inf, most: float = math.inf) -> float:
        """Return a number that must be typed. Raises `OrderError`."""
        value = self.number(name, least=least, most=most)
        if math.isnan(value):
            raise OrderError(f"{name}: type a number")
        return value


@dataclass(frozen=True)
class VehicleOrder:
    """One kind of order to vehicles."""

    id: str
    key: str
    """Its letter in the menu of orders."""
    name: str
    does: str
    """What happens, for the operator who is about to confirm."""
    why_not: Callable[[VehicleRow], str]
    """Why it makes no sense for a vehicle now; empty if it does."""
    request: Callable[[OrderInput], Request]
    """Makes the request. Raises `OrderError`."""
    grades: tuple[Grade, Grade] = (Grade.YES, Grade.YES)
    """How it is confirmed for one vehicle, and for several."""
    fields: tuple[OrderField, ...] = ()
    seen: Callable[[VehicleRow], bool] | None = None
    """Whether telemetry shows that it came about; None: the station's answer decides."""
    brief: str = ""
    """`does` in at most 20 cells for the menu, where it is longer."""
    begins: bool = False
    """Whether success only means that the vehicle does it now, not that it has arrived."""
    is_stop: bool = False
    """Whether it is sent whatever changed meanwhile: a stop is never too late."""
    doubt: Callable[[VehicleRow], str] = lambda row: ""
    """Why it would probably lead to nothing; empty if it would not. An operator who insists can order it anyway."""

    def grade(self, count: int) -> Grade:
        """How it is confirmed for this many vehicles."""
        return self.grades[count > 1]


def in_the_air(row: VehicleRow) -> bool:
    """Whether the vehicle flies, as far as the station knows."""
    return row.armed and row.phase not in (Phase.GROUND, Phase.ARMING)


def _flies(row: VehicleRow) -> str:
    # Neither LOST nor another problem refuses a stop (docs/threats.md D.8), and a start is cancelled while it is armed.
    return "" if in_the_air(row) or row.armed else "is on the ground"


def beyond_reach(row: VehicleRow) -> str:
    """Why the vehicle cannot be commanded now; empty if it can."""
    if row.freshness is Freshness.LOST:
        return "LOST"
    return row.problem


def _steered(row: VehicleRow) -> str:
    if why := beyond_reach(row):
        return why
    # Only vehicles of a team have a take-off place and a layer, by which the guard keeps others apart from them.
    if not row.team:
        return "is in no team: no course is flown with it"
    return "" if in_the_air(row) else "take off first"


def _on_the_ground(row: VehicleRow) -> str:
    return beyond_reach(row) or ("is in the air" if in_the_air(row) else "already armed" if row.armed else "")


def _reboots(row: VehicleRow) -> str:
    return beyond_reach(row) or ("is in the air" if in_the_air(row) else "is armed" if row.armed else "")


def _armed_on_the_ground(row: VehicleRow) -> str:
    return beyond_reach(row) or ("is not armed" if not row.armed else "land it first" if in_the_air(row) else "")


def _held(row: VehicleRow) -> str:
    if (why := beyond_reach(row)) or row.phase in (Phase.HOLDING, Phase.BY_HAND):
        return why
    if not row.armed:
        return "is on the ground"
    if not in_the_air(row):
        return "take off first"
    return "its planner has it" if row.phase is Phase.FLYING else "does not hold"


def _is_armed(row: VehicleRow) -> str:
    return "" if row.armed else "is not armed"


def _in_flight(row: VehicleRow) -> str:
    return beyond_reach(row) or ("" if in_the_air(row) else "take off first")


def _on_its_way(row: VehicleRow) -> str:
    """Why no speed can be set: a planner sets that of its vehicles, and an orbit has its own."""
    if (why := _in_flight(row)) or not row.team or row.phase is Phase.TAKEN_OUT:
        return why
    if row.phase is Phase.FLYING:
        return "set by its planner"
    goes = row.phase is Phase.BY_HAND and math.isfinite(row.goal_m[0]) and not row.goal_radius_m
    return "" if goes and not row.slot else "is not on its way"


def _camera(row: VehicleRow) -> str:
    return _shown("camera", row.camera)


def _gimbal(row: VehicleRow) -> str:
    return _shown("gimbal", row.gimbal)


def _returns(row: VehicleRow) -> bool:
    """Whether telemetry shows that a vehicle returns; its phase is only what the station wants of it.

    It shows it by standing still, for it may wait for others on its way, or by flying towards a goal that is farther
    than the place where it would stop. A returning vehicle that stands for longer raises an alarm of the station.
    """
    if row.phase is not Phase.RETURNING:
        return row.phase is Phase.LANDING
    speed_m_s = math.hypot(*row.velocity_m_s)
    if speed_m_s < STANDING_M_S:
        return True
    way_m = [goal - here for goal, here in zip(row.goal_m, row.position_m, strict=True)]
    away_m = math.hypot(*way_m)
    towards_m_s = sum(w * v for w, v in zip(way_m, row.velocity_m_s, strict=True)) / max(away_m, 0.1)
    return away_m > speed_m_s * STOP_S and towards_m_s > TOWARDS_SHARE * speed_m_s


def _shown(what: str, shows: bool | None) -> str:
    """A doubt only: some vehicles that have one report none, see `PayloadDevices.has_camera`."""
    return "" if shows else f"shows no {what}" if shows is False else f"no {what} known"


def _go_to(given: OrderInput) -> Request:
    try:
        found = destinations(given.values.get("place", ""), given.vehicles, given.around)
    except PlaceTextError as error:
        raise OrderError(str(error)) from None
    points = tuple(found.points_m[v] for v in given.vehicles)
    return f.GoTo(given.vehicles, points, given.number("speed", least=0.1), from_home=found.from_home)


def _climb(given: OrderInput) -> Request:
    height = given.needed("height", least=0.0, most=1000.0)
    return f.GoTo(given.vehicles, ((math.nan, math.nan, height),) * len(given.vehicles))


def _circle(given: OrderInput) -> Request:
    try:
        found = destinations(given.values.get("place", ""), given.vehicles[:1], given.around)
    except PlaceTextError as error:
        raise OrderError(str(error)) from None
    if found.from_home:
        raise OrderError("name the middle by metres, degrees, a zone, a vehicle or the cursor")
    centre = found.points_m[given.vehicles[0]]
    return f.CircleFlight(given.vehicles, centre, given.needed("radius", least=1.0), given.number("speed", least=0.1))


def _follow(given: OrderInput) -> Request:
    leader = given.needed("vehicle", least=1)
    if not leader.is_integer() or int(leader) not in given.around.rows:
        raise OrderError(f"vehicle: there is no vehicle {leader:g}")
    if int(leader) in given.vehicles:
        raise OrderError("vehicle: it cannot follow itself")
    return f.Follow(given.vehicles, int(leader))


def _mode(given: OrderInput) -> Request:
    if not given.values.get("mode", "").strip():
        raise OrderError("mode: type its name")
    return s.SetMode(given.vehicles, given.values["mode"].strip(), sure=True)


def _kill(given: OrderInput) -> Request:
    if not given.values.get("reason", "").strip():
        raise OrderError("reason: say why, for the journal")
    return f.KillMotors(given.vehicles, given.values["reason"].strip())


STARTS = (Grade.YES, Grade.COUNT)
_SPEED = OrderField("speed", "speed", "m/s", help="empty: the scenario's limit")
_PLACE = OrderField("place", "place", help=PLACE_HELP)

ORDERS = (
    VehicleOrder(
        "hold",
        "h",
        "hold",
        "stop at once and stay; pauses a mission",
        _flies,
        lambda given: m.Hold(vehicles=given.vehicles),
        (Grade.ENTER, Grade.ENTER),
        # One that stood still before shows nothing of this order until the station has it confirmed.
        seen=lambda row: row.phase is Phase.HOLDING and not row.stop_pending and math.hypot(*row.velocity_m_s) < 0.5,
        is_stop=True,
        brief="stop and stay",
    ),
    VehicleOrder(
        "return",
        "r",
        "return",
        "return on their layers and land in turn (RTL)",
        _flies,
        lambda given: m.Return(vehicles=given.vehicles),
        (Grade.ENTER, Grade.ENTER),
        seen=lambda row: (_returns(row) and not row.stop_pending) or not row.armed,
        begins=True,
        is_stop=True,
        brief="home, land in turn",
    ),
    VehicleOrder(
        "land",
        "l",
        "land here",
        "land on the spot",
        _flies,
        lambda given: f.Land(vehicles=given.vehicles),
        (Grade.ENTER, Grade.ENTER),
        seen=lambda row: (row.phase is Phase.LANDING and not row.stop_pending) or not row.armed,
        begins=True,
        is_stop=True,
    ),
    VehicleOrder(
        "resume",
        "p",
        "to planner",
        "fly on for their planner",
        _held,
        lambda given: m.Resume(vehicles=given.vehicles),
        brief="back to its planner",
    ),
    VehicleOrder("go_to", "g", "go to", "fly there and stay", _steered, _go_to, fields=(_PLACE, _SPEED), begins=True),
    VehicleOrder(
        "climb",
        "u",
        "altitude",
        "fly straight up or down to that height",
        _steered,
        _climb,
        fields=(OrderField("height", "height", "m", help="above home"),),
        begins=True,
        brief="straight up or down",
    ),
    VehicleOrder(
        "circle",
        "o",
        "orbit",
        "fly round and round",
        _steered,
        _circle,
        fields=(_PLACE, OrderField("radius", "radius", "m", "20"), _SPEED),
        begins=True,
        brief="fly round and round",
    ),
    VehicleOrder(
        "follow",
        "w",
        "follow",
        "fly beside another one, as far from it as now",
        _steered,
        _follow,
        fields=(OrderField("vehicle", "vehicle", help="the number of the one to follow"),),
        begins=True,
        brief="beside another one",
    ),
    VehicleOrder(
        "nudge",
        "n",
        "nudge",
        "stop, then move as long as arrows are pressed",
        _steered,
        lambda given: f.Nudge(given.vehicles, (0.0, 0.0, 0.0)),
        begins=True,
        brief="move by arrow keys",
    ),
    VehicleOrder(
        "speed",
        "v",
        "speed",
        "fly on no faster than this",
        _on_its_way,
        lambda given: f.LimitSpeed(given.vehicles, given.needed("speed", least=0.1)),
        fields=(OrderField("speed", "speed", "m/s"),),
        brief="fly no faster",
    ),
    VehicleOrder(
        "take_off",
        "t",
        "take off",
        "arm, motors start, climb, stay there by hand",
        _on_the_ground,
        lambda given: f.TakeOff(given.vehicles, given.needed("height", least=2.5)),
        STARTS,
        fields=(OrderField("height", "height", "m", help="above home"),),
        begins=True,
        brief="arm, climb, stay",
    ),
    VehicleOrder("arm", "a", "arm", "motors start", _on_the_ground, lambda given: f.Arm(given.vehicles), STARTS),
    VehicleOrder("disarm", "d", "disarm", "motors stop", _armed_on_the_ground, lambda given: f.Disarm(given.vehicles)),
    VehicleOrder(
        "mode",
        "m",
        "mode",
        "change to a mode of their own",
        beyond_reach,
        _mode,
        STARTS,
        fields=(OrderField("mode", "mode", help="its name, e.g. RTL, LAND, GUIDED, AUTO"),),
        brief="one of its own",
    ),
    VehicleOrder(
        "mission",
        "i",
        "mission",
        "fly the mission on board from its present item",
        _in_flight,
        lambda given: f.OnBoardMission(given.vehicles, "start"),
        STARTS,
        begins=True,
        brief="fly the one on board",
    ),
    VehicleOrder(
        "continue",
        "c",
        "continue",
        "go on with the mission on board after a hold",
        _in_flight,
        lambda given: f.OnBoardMission(given.vehicles, "continue"),
        STARTS,
        begins=True,
        brief="mission after a hold",
    ),
    VehicleOrder(
        "mission_meet",
        "I",
        "WAYS MEET",
        "fly the missions on board though their ways meet: you watch them",
        _in_flight,
        lambda given: f.OnBoardMission(given.vehicles, "continue", sure=True),
        STARTS,
        begins=True,
        brief="though ways meet",
    ),
    VehicleOrder(
        "gimbal",
        "x",
        "gimbal",
        "point it",
        beyond_reach,
        lambda given: setup.PointGimbal(
            given.vehicles, given.needed("pitch", least=-180, most=180), given.needed("yaw", least=-180, most=180)
        ),
        (Grade.ENTER, Grade.YES),
        fields=(
            OrderField("pitch", "pitch", "°", "-45", "up is positive"),
            OrderField("yaw", "yaw", "°", "0", "right of the nose"),
        ),
        doubt=_gimbal,
    ),
    VehicleOrder(
        "photo",
        "f",
        "photo",
        "take one picture",
        beyond_reach,
        lambda given: setup.UseCamera(given.vehicles, "photo"),
        (Grade.ENTER, Grade.YES),
        doubt=_camera,
    ),
    VehicleOrder(
        "video",
        "y",
        "video",
        "start recording",
        beyond_reach,
        lambda given: setup.UseCamera(given.vehicles, "start"),
        (Grade.ENTER, Grade.YES),
        doubt=_camera,
    ),
    VehicleOrder(
        "video_stop",
        "z",
        "video off",
        "stop recording",
        beyond_reach,
        lambda given: setup.UseCamera(given.vehicles, "stop"),
        (Grade.ENTER, Grade.YES),
        doubt=_camera,
    ),
    VehicleOrder(
        "reboot",
        "b",
        "reboot",
        "the autopilot starts anew",
        _reboots,
        lambda given: s.Reboot(given.vehicles),
        (Grade.COUNT, Grade.COUNT),
        brief="autopilot anew",
    ),
    VehicleOrder(
        "kill",
        "K",
        "KILL MOTORS",
        "the motors stop, also in the air: IT FALLS",
        _is_armed,
        _kill,
        (Grade.KILL, Grade.KILL),
        fields=(OrderField("reason", "reason", help="for the journal"),),
        brief="in the air it falls",
    ),
)
BY_ID = {order.id: order for order in ORDERS}


def split(
    order: VehicleOrder, vehicles: tuple[int, ...], rows: dict[int, VehicleRow], *, doubtful: bool = False
) -> tuple[tuple[int, ...], dict[int, str]]:
    """Return the vehicles that an order makes sense for, and the others with the reason.

    With `doubtful` the first include those for which it is only doubted.
    """
    left_out = {v: why for v in vehicles if (why := _why_not(order, rows.get(v), doubtful=doubtful))}
    return tuple(v for v in vehicles if v not in left_out), left_out


def _why_not(order: VehicleOrder, row: VehicleRow | None, *, doubtful: bool) -> str:
    if row is None:
        return "never heard"
    return order.why_not(row) or ("" if doubtful else order.doubt(row))


def why_not_order(
    order: VehicleOrder, vehicles: tuple[int, ...], rows: dict[int, VehicleRow], *, doubtful: bool = False
) -> str:
    """Why an order makes no sense for any of the vehicles, by vehicle if reasons differ; empty if it does for some."""
    concerned, left_out = split(order, vehicles, rows, doubtful=doubtful)
    if concerned:
        # A vehicle whose motors stop falls: that is never done to a selection by mistake (docs/threats.md D.2).
        return "one at a time" if order.grade(1) is Grade.KILL and len(vehicles) > 1 else ""
    if not left_out:
        return "no vehicle is selected"
    reasons = set(left_out.values())
    return next(iter(reasons)) if len(reasons) == 1 else left_out_words(left_out)


def left_out_words(left_out: dict[int, str]) -> str:
    """Each reason with its vehicles: `1-3 is on the ground; 5 LOST`."""
    return "; ".join(
        f"{id_ranges(v for v, reason in left_out.items() if reason == why)} {why}"
        for why in dict.fromkeys(left_out.values())
    )
