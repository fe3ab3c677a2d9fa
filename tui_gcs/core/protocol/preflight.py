"""What is checked before a start, on the bus: the list travels in `StationStatus.preflight`, the worst first.

A check has a name that is typed to override it. What is `hard` cannot be overridden: that vehicle is left out.
"""

from collections.abc import Iterable
from enum import StrEnum

from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.base import Message, Request


class CheckState(StrEnum):
    """The result of one check."""

    FAIL = "fail"
    UNKNOWN = "unknown"
    """Not read yet, or not available from this vehicle."""
    WARN = "warn"
    """For information; it stops no start."""
    ACKNOWLEDGED = "acknowledged"
    """It would fail, but an operator has accepted it as it is."""
    TICKED = "ticked"
    """An item of the scenario's checklist that an operator has ticked for the next start."""
    OK = "ok"
    NOT_NEEDED = "not needed"
    """Makes no sense here: simulated vehicles."""


STOPS = frozenset({CheckState.FAIL, CheckState.UNKNOWN})
"""States in which a check refuses the start."""

TITLES = {
    "heard": "vehicles are heard, and ours to fly",
    "links": "links are up",
    "ids": "ids are unique, and their owners known",
    "gps": "GPS and position estimate",
    "battery": "battery",
    "arming": "they would arm",
    "place": "where they stand",
    "planner": "planners can plan",
    "station-loss": "what they do without this station",
    "setpoint-loss": "what they do without set-points",
    "battery-loss": "what they do with an empty battery",
    "fence-cross": "what they do at their fence",
    "position-loss": "what they do without a position",
    "stick-loss": "what they do when sticks are lost",
    "fence": "fence on board is ours",
    "mission": "mission and rally points on board are ours",
    "rehearsal": "rehearsed with exactly this plan",
    "recording": "flight is recorded",
    "checklist": "items of the scenario's own checklist",
    "sign-off": "an operator has signed",
}
"""All checks by name, in the order in which they are listed, with what each is about."""
FAILSAFES = ("station-loss", "setpoint-loss", "battery-loss", "fence-cross", "position-loss", "stick-loss")
"""What vehicles do by themselves, by their own parameters: doing nothing can be acknowledged."""
CHECKLIST = "checklist"
"""The check that has one line for each item of the scenario's own checklist."""
OVERRIDABLE = (*FAILSAFES, "fence", "mission", "rehearsal", CHECKLIST, "sign-off")
"""What an operator may override by name for one start; asked of LIVE vehicles only."""
BY_HAND = (*FAILSAFES, "fence", "mission")
"""What is as true of a vehicle that is lifted by hand; the others are about the scenario's flight."""
MAX_NAME_CHARS = 40
"""Longer names of operators are cut."""


class Check(Message, frozen=True):
    """One line of the list: vehicles of which the same is true are one line."""

    name: str
    """The name of the check, a key of `TITLES`."""
    state: CheckState
    text: str
    """What was found."""
    todo: str = ""
    """What to do about it; "" if nothing has to be."""
    vehicles: tuple[int, ...] = ()
    """The vehicles it is about; none: the station or the fleet as a whole."""
    hard: bool = False
    """Whether it cannot be overridden."""

    @property
    def who(self) -> str:
        """`vehicles 1-3 6`, or ""."""
        return vehicles_words(self.vehicles) if self.vehicles else ""

    def words(self) -> str:
        """The name, the vehicles and what was found."""
        operator = f" {self.who}" if self.who else ""
        return f"{self.name}{operator}: {self.text}"


class AcknowledgeCheck(Request, frozen=True, tag="acknowledge-check"):
    """Accept a failsafe that does nothing, as `text` describes it, for all vehicles of which that is true now."""

    name: str
    text: str
    operator: str
    vehicles: tuple[int, ...] = ()
    """The vehicles that it was about on the operator's screen: refused if it is about others too; none: any vehicles.
    """


class TickItem(Request, frozen=True, tag="tick-item"):
    """Tick an item of the scenario's checklist for the next start, or take that back."""

    text: str
    """The item as the scenario has it."""
    operator: str
    ticked: bool = True


class SignOff(Request, frozen=True, tag="sign-off"):
    """An operator has gone through the list of the scenario's `revision`; it holds for one start."""

    operator: str
    revision: int


class ReadChecks(Request, frozen=True, tag="read-checks"):
    """Read from vehicles on the ground what is not known of them (`anew`: also what is): failsafes, fences."""

    anew: bool = False


def refusing(checks: Iterable[Check], vehicles: Iterable[int]) -> tuple[Check, ...]:
    """The checks that refuse a start of these vehicles unless they are overridden; hard ones leave vehicles out."""
    starting = frozenset(vehicles)
    return tuple(
        check
        for check in checks
        if check.state in STOPS and not check.hard and (not check.vehicles or starting.intersection(check.vehicles))
    )


def open_by_hand(checks: Iterable[Check], vehicles: Iterable[int]) -> tuple[Check, ...]:
    """The checks that speak against arming these vehicles manually: they are journalled and stop nothing."""
    return tuple(check for check in refusing(checks, vehicles) if check.name in BY_HAND)


def names_of(checks: Iterable[Check]) -> tuple[str, ...]:
    """Each name once, in order."""
    return tuple(dict.fromkeys(check.name for check in checks))


def well(checks: Iterable[Check], state: CheckState) -> tuple[str, ...]:
    """Names of the checks of which nothing is worse than `state`, OK or NOT_NEEDED."""
    listed = tuple(checks)
    worse = {check.name for check in listed if check.state not in (state, CheckState.NOT_NEEDED)}
    return tuple(name for name in names_of(check for check in listed if check.state is state) if name not in worse)


def count_words(checks: Iterable[Check]) -> str:
    """`2 fail, 1 unknown, 3 warn, 10 ok`."""
    states = [check.state for check in checks]
    return ", ".join(f"{states.count(state)} {state}" for state in CheckState if state in states)
