"""Declares every cause of an alarm: its level, tag, title, advice, delays, and the causes that follow from it.

An alarm asks for an operator's act (ISA-18.2); anything else is an event. The order of `CAUSES` is the order of
importance within a level. The delays here and the dead-bands of the findings keep fluttering values from ringing.
"""

from dataclasses import dataclass

from tui_gcs.core.protocol.alarms import AlarmLevel

WARNING, CAUTION, ADVISORY = AlarmLevel.WARNING, AlarmLevel.CAUTION, AlarmLevel.ADVISORY


@dataclass(frozen=True)
class Cause:
    """One kind of alarm. In `action`, actions of the console stand in brackets, see `Alarm.action`."""

    id: str
    level: AlarmLevel
    tag: str
    title: str
    action: str
    on_s: float = 0.0
    """Seconds for which it must hold before it is raised."""
    off_s: float = 3.0
    """Seconds for which it must not hold before it is over."""
    hides: tuple[str, ...] = ()
    """Causes that follow from this one: not shown for the same vehicle."""


EVENT_CAUSES = ("alert", "report")
"""Causes that come from one event instead of a state that can be looked at again."""
_OF_LOST = (
    *("stale", "left", "holds", "stays", "battery-critical", "battery-low", "battery-unknown", "position"),
    *("poor-position", "height", "health", "failsafe", "outside", "stop", "poor-link", "vetoed", "beside"),
    *("unreached", "up-way"),
    *EVENT_CAUSES,
)
"""Causes that cannot be known of a LOST vehicle, or that follow from its loss."""
_OF_EMERGENCY = ("left", "vetoed", "beside", "health", "holds", "stays", "outside", "height", *EVENT_CAUSES)
"""Causes that follow from a fall or from lying on the ground."""
_CLEAR = "keep clear below it; [hold_all] hold all"
_MOTORS = "keep away; its number, [orders] K stops its motors"

CAUSES = (
    # warnings
    Cause("falling", WARNING, "FAL", "FALLING", _CLEAR, off_s=2.0, hides=("attitude", *_OF_EMERGENCY)),
    Cause("attitude", WARNING, "ATT", "OUT OF CONTROL", _CLEAR, off_s=2.0, hides=_OF_EMERGENCY),
    Cause("impact", WARNING, "IMP", "HIT THE GROUND", _MOTORS, hides=("attitude", *_OF_EMERGENCY)),
    Cause("grounded", WARNING, "GND", "ARMED ON THE GROUND", _MOTORS, hides=_OF_EMERGENCY),
    Cause(
        "link-lost",
        WARNING,
        "LNK",
        "NOT HEARD, link failed",
        "[hold_all] hold all, then mend the link",
        hides=("lost", *_OF_LOST),
    ),
    Cause(
        "lost",
        WARNING,
        "LST",
        "LOST in the air",
        "[hold_all] hold all, or [return_all] return the others",
        off_s=2.0,
        hides=_OF_LOST,
    ),
    Cause("unreached", WARNING, "UP", "ORDERS DO NOT ARRIVE", "mend its link's transmitter, or take it over by radio"),
    Cause("separation", WARNING, "SEP", "TOO CLOSE", "[hold_all] hold all", hides=("vetoed", "closing")),
    Cause(
        "closing", WARNING, "CPA", "COURSES MEET", "hold one: its number, [orders] h; or [hold_all] hold all", on_s=0.5
    ),
    Cause(
        "traffic",
        WARNING,
        "TFC",
        "AIRCRAFT near",
        "give way: [hold_all] hold all, or [return_all] return",
        off_s=10.0,
    ),
    Cause(
        "failsafe",
        WARNING,
        "FS",
        "FAILSAFE on board",
        "watch it; [return_all] return the others",
        hides=("fence", "health", "left", "report"),  # an alert may be worse: it loses thrust, too
    ),
    Cause(
        "fence",
        WARNING,
        "FNC",
        "FENCE BREACH on board",
        "watch it; [return_all] return the others",
        hides=("left", "report"),
    ),
    Cause(
        "stop", WARNING, "STP", "STOP not confirmed", "take it over by radio; [hold_all] hold all", hides=EVENT_CAUSES
    ),
    Cause("kept", WARNING, "ORD", "ORDER WAITS", "take it over by radio, or its number, [orders] h holds it"),
    Cause(
        "battery-critical",
        WARNING,
        "BAT",
        "battery CRITICAL",
        "its number, [return_selected] return; or [return_all] return all",
        on_s=1.0,
        hides=("battery-low", *EVENT_CAUSES),
    ),
    Cause(
        "position",
        WARNING,
        "POS",
        "position not known",
        "it drifts: [hold_all] hold all, or land it",
        on_s=1.0,
        hides=("poor-position", "health", *EVENT_CAUSES),
    ),
    Cause(
        "height",
        WARNING,
        "ALT",
        "HEIGHT in doubt",
        "its number, [orders] l lands it here",
        on_s=1.0,
        hides=EVENT_CAUSES,
    ),
    Cause("outside", WARNING, "OUT", "OUTSIDE the area", "[hold_all] hold all, or [return_all] return", on_s=0.5),
    Cause(
        "identity",
        WARNING,
        "WHO",
        "who is it?",
        "only stops are sent to it; look at links and keys",
        off_s=1.0,
        hides=EVENT_CAUSES,
    ),
    Cause("alert", WARNING, "MSG", "ALERT", "look at it: [show_journal] journal", off_s=0.0, hides=("report",)),
    # cautions
    Cause(
        "stale",
        CAUTION,
        "OLD",
        "position not updated",
        "[hold_all] hold all",
        on_s=1.0,  # it is LOST by then, if nothing at all comes
        off_s=2.0,
        hides=("position", *EVENT_CAUSES),
    ),
    Cause(
        "left",
        CAUTION,
        "OFF",
        "left the mission",
        "a pilot or failsafe flies it: [hold_all] hold all",
        hides=EVENT_CAUSES,
    ),
    Cause(
        "health",
        CAUTION,
        "SEN",
        "not well in flight",
        "its number, [return_selected] return; or [return_all] return all",
        on_s=2.0,
        off_s=5.0,
    ),
    Cause(
        "battery-low",
        CAUTION,
        "BAT",
        "battery low",
        "plan its return: its number, [return_selected] return",
        on_s=2.0,
    ),
    Cause("battery-unknown", CAUTION, "BAT", "battery not known", "return it by the clock", on_s=5.0),
    Cause("poor-position", CAUTION, "GPS", "position poor", "keep away from edges and others", on_s=3.0, off_s=5.0),
    Cause(
        "planner-failed",
        CAUTION,
        "PLN",
        "planner failed",
        "its vehicles hold: change it, [show_plan] plan screen, or [show_planners] look why",
        off_s=0.5,
        hides=("planner", "planner-late"),
    ),
    Cause(
        "planner",
        CAUTION,
        "PLN",
        "planner trouble",
        "its vehicles hold: [resume] resume, or [show_planners] look why",
        off_s=0.5,
        hides=("planner-late",),
    ),
    Cause(
        "planner-late",
        CAUTION,
        "PLN",
        "planner late",
        "its vehicles fly on, and hold after 2 s without it; [show_planners] look why",
    ),
    Cause(
        "vetoed",
        CAUTION,
        "VET",
        "set-points refused",
        "it holds: look at zones and limits",
        on_s=3.0,
        hides=("beside",),
    ),
    Cause(
        "beside",
        CAUTION,
        "SLT",
        "not on its slot",
        "wind, load? lower its speed: [show_plan] plan, or [return_all] return",
        on_s=2.0,
        off_s=30.0,
    ),
    Cause(
        "memory",
        CAUTION,
        "MEM",
        "MEMORY LOST",
        "check round, zones, teams: [show_plan] plan; or [return_all] return",
        off_s=0.0,
    ),
    Cause(
        "found",
        CAUTION,
        "HLD",
        "found in the air",
        "nothing is sent to it: [resume] resume, or [return_all] return and land",
        off_s=0.0,
    ),
    Cause(
        "holds",
        CAUTION,
        "HLD",
        "holds alone",
        "[resume] resume, or [return_all] return",
        on_s=1.0,
        off_s=0.5,
    ),
    Cause(
        "stays",
        CAUTION,
        "HLD",
        "holds alone",
        "its number, [orders] p to planner, or [return_selected] return",
        on_s=1.0,
        off_s=0.5,
    ),
    Cause(
        "busy",
        CAUTION,
        "CPU",
        "COMPUTER TOO BUSY",
        "end other programs; its vehicles hold where a plan ends: [return_all] return",
        on_s=1.0,
        off_s=10.0,
    ),
    Cause("silence", CAUTION, "LNK", "NOBODY is heard", "look at links and radios: nothing can be sent", on_s=2.0),
    Cause("link", CAUTION, "LNK", "link failed", "mend the link"),
    Cause("up-way", CAUTION, "UP", "LINK ONLY HEARS", "nothing sent over it arrives: mend its transmitter"),
    Cause("recording", CAUTION, "REC", "NOT RECORDING", "make room on the disk"),
    Cause("supervisor", CAUTION, "SUP", "NOT SUPERVISED", "not started again if it dies: land, then start it anew"),
    Cause("poor-link", CAUTION, "RF", "link poor", "turn antennas, keep near", on_s=5.0, off_s=10.0),
    Cause("report", CAUTION, "MSG", "it reports", "look at its messages: [show_journal] journal", off_s=0.0),
    # advisories
    Cause("hold", ADVISORY, "HLD", "HOLD", "[resume] resume, or [return_all] return and land", off_s=0.0),
    Cause("forward", ADVISORY, "FWD", "not forwarded", "look at the other station", on_s=2.0),
)
_FAR = "it returns; too far? its number, [orders] l lands it here"
_WATCH = {"return": "it returns: watch it", "land": "it lands: watch it"}
WHEN_ON_ITS_WAY: dict[str, dict[str, str]] = {
    "battery-critical": {"return": _FAR, "land": "it lands: keep its place clear"},
    "battery-low": {"return": "it returns: watch its charge", "land": "it lands: keep its place clear"},
    "battery-unknown": _WATCH,
    "health": _WATCH,
}
"""By cause, the advice for a vehicle that returns or lands already, instead of telling the operator to return it."""
BY_ID = {cause.id: cause for cause in CAUSES}
RANK = {cause.id: index for index, cause in enumerate(CAUSES)}
MAX_SHELVED_MIN = {WARNING: 5.0, CAUTION: 30.0, ADVISORY: 120.0}
"""Minutes for which an alarm may be shelved at most, by level."""
