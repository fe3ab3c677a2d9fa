"""The names of mission commands, and what each of their four parameters means.

Numbers and meanings are common.xml's (MAV_CMD), as ArduCopter and PX4 multicopters understand them (docs/autopilots.md,
"Missions, fence, rally of ArduCopter", "Mission / fence / rally of PX4"). A command that is not listed is shown with
its number and bare parameters, and kept as it is.
"""

import math
from dataclasses import dataclass

from tui_gcs.core.plans import model as plan
from tui_gcs.core.plans.model import MISSION_FRAME, RELATIVE, PlanItem


@dataclass(frozen=True)
class ParamLabel:
    """One parameter: its meaning and unit. A new item starts with `default`."""

    label: str
    unit: str = ""
    default: float = 0.0
    empty: str = ""
    """The text for NaN, which means "not given"."""


@dataclass(frozen=True)
class CommandDescription:
    """One command: its name, and its parameters that mean something, by index from 0."""

    command: int
    word: str
    params: tuple[tuple[int, ParamLabel], ...] = ()

    @property
    def is_place(self) -> bool:
        """Whether the command has a place."""
        return self.command in plan.PLACES


def _word(command: int, word: str, **params: ParamLabel) -> CommandDescription:
    return CommandDescription(command, word, tuple((int(name[1]) - 1, param) for name, param in params.items()))


_YAW = ParamLabel("Heading", "deg", math.nan, "as it flies")
"""The heading at a place: PX4 turns to it, and 0 is north; ArduCopter does not keep it."""
_HOLD = ParamLabel("Hold", "s")
_RADIUS = ParamLabel("Radius", "m")

COMMANDS = (
    _word(plan.WAYPOINT, "waypoint", p1=_HOLD, p4=_YAW),
    _word(plan.TAKE_OFF, "take-off", p4=_YAW),
    _word(plan.LAND, "land", p4=_YAW),
    _word(plan.RETURN, "return"),
    _word(plan.LOITER_TIME, "wait", p1=ParamLabel("Time", "s", 10.0)),
    _word(plan.LOITER_TURNS, "circle", p1=ParamLabel("Turns", "", 1.0), p3=_RADIUS),
    _word(plan.LOITER_UNLIMITED, "stay", p4=_YAW),
    _word(plan.LOITER_TO_ALT, "height", p1=ParamLabel("Heading", "0/1")),
    _word(plan.SPLINE, "spline", p1=_HOLD),
    _word(plan.DELAY, "delay", p1=ParamLabel("Time", "s", 10.0)),
    _word(plan.JUMP, "jump", p1=ParamLabel("To item", "", 0.0), p2=ParamLabel("Times", "", 1.0)),
    _word(
        178,
        "speed",
        p1=ParamLabel("Kind", "1 ground", 1.0),
        p2=ParamLabel("Speed", "m/s", 5.0),
        p3=ParamLabel("Throttle", "%", -1.0),
    ),
    _word(
        115,
        "turn",
        p1=ParamLabel("Heading", "deg"),
        p2=ParamLabel("Rate", "deg/s"),
        p3=ParamLabel("Way", "1 right"),
        p4=ParamLabel("Relative", "0/1"),
    ),
    _word(plan.ROI_LOCATION, "look at"),
    _word(197, "look ahead"),
    _word(206, "photos each", p1=ParamLabel("Distance", "m", 10.0), p3=ParamLabel("One now", "0/1")),
    _word(2000, "photo", p2=ParamLabel("Interval", "s"), p3=ParamLabel("Count", "", 1.0)),
    _word(2001, "photos end"),
    _word(2500, "video"),
    _word(2501, "video end"),
    _word(1000, "gimbal", p1=ParamLabel("Pitch", "deg", -90.0), p2=ParamLabel("Yaw", "deg")),
    _word(183, "servo", p1=ParamLabel("Servo", "", 9.0), p2=ParamLabel("Pulse", "us", 1500.0)),
    _word(181, "relay", p1=ParamLabel("Relay"), p2=ParamLabel("On", "0/1", 1.0)),
    _word(211, "gripper", p1=ParamLabel("Gripper", "", 1.0), p2=ParamLabel("Grab", "0/1")),
    _word(plan.PAYLOAD_PLACE, "put down", p1=ParamLabel("Descent", "m", 10.0)),
    _word(plan.VTOL_TAKE_OFF, "VTOL up"),
    _word(plan.VTOL_LAND, "VTOL land"),
    _word(plan.POLYGON_IN, "in corner"),
    _word(plan.POLYGON_OUT, "out corner"),
    _word(plan.CIRCLE_IN, "in circle", p1=_RADIUS),
    _word(plan.CIRCLE_OUT, "out circle", p1=_RADIUS),
    _word(plan.FENCE_RETURN, "return point"),
    _word(plan.RALLY_POINT, "rally point"),
)
BY_NUMBER = {each.command: each for each in COMMANDS}
_BY_WORD = {each.word: each for each in COMMANDS}
NOT_IN_MISSIONS = plan.FENCE_COMMANDS | {plan.RALLY_POINT}
MISSION_WORDS = tuple(each.word for each in COMMANDS if each.command not in NOT_IN_MISSIONS)
"""The names that can be chosen for an item of a mission, the usual ones first."""
_BARE = tuple((index, ParamLabel(f"Param {index + 1}")) for index in range(4))

FRAMES = {RELATIVE: "home", plan.AMSL: "sea", plan.TERRAIN: "ground"}
"""What heights are above, by MAV_FRAME."""


def word_of(command: int) -> CommandDescription:
    """Return the description of a command; an unknown command has its number for a name."""
    return BY_NUMBER.get(command) or CommandDescription(command, f"command {command}", _BARE)


def with_command(item: PlanItem, word: str) -> PlanItem:
    """Return the item with another command and that command's usual parameters. The place is kept where there is one.

    A name that is no command leaves the item as it is.
    """
    known = _BY_WORD.get(word)
    if known is None or known.command == item.command:
        return item
    params = [0.0, 0.0, 0.0, 0.0]
    for index, param in known.params:
        params[index] = param.default
    one, two, three, four = params
    # A command without a place has no height: coming from one, heights count from home.
    frame = (item.frame if item.frame != MISSION_FRAME else RELATIVE) if known.is_place else MISSION_FRAME
    x, y, z = (item.x, item.y, item.z) if known.is_place else (0, 0, 0.0)
    return PlanItem(known.command, frame, (one, two, three, four), x, y, z, item.autocontinue)
