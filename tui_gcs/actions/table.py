"""The actions of the app and of the fly screen. Those of other screens stand beside them."""

from tui_gcs.actions.action import ALARMS, COMMAND, SCREENS, SELECT, VIEW, ConsoleAction
from tui_gcs.actions.action_context import ActionContext
from tui_gcs.core.protocol.common import Phase, RunPhase


def _heard(context: ActionContext) -> str:
    return context.silent


NOTHING_HOLDS = "nothing holds"


def _start_or_hold(context: ActionContext) -> str:
    if context.run in (None, RunPhase.IDLE):
        return context.silent
    if context.station_lost:  # what it last said is old; HOLD is asked of it as `!h` does
        return ""
    frame = context.frame
    at_rest = frame is not None and {Phase.GROUND, Phase.HOLDING}.issuperset(frame.phase)
    if context.run is RunPhase.HOLD and at_rest:
        return "all hold already: Enter goes on, !r brings them home"
    return ""


def _start_or_hold_label(context: ActionContext) -> str:
    return "HOLD" if context.run not in (None, RunPhase.IDLE) else "start"


def _resumes(context: ActionContext) -> str:
    frame = context.frame
    some_hold = frame is not None and Phase.HOLDING in frame.phase
    if context.run is RunPhase.RETURNING and some_hold:
        return "the others return: select who holds, then c p to planner or r return"
    goes_on = context.run is RunPhase.HOLD or (context.run is RunPhase.RUNNING and some_hold)
    return context.silent or ("" if goes_on else NOTHING_HOLDS)


def _needs_selection(context: ActionContext) -> str:
    return context.silent or ("" if context.selected else "no vehicle is selected: a number or s selects")


def _has_rounds(context: ActionContext) -> str:
    rounds = context.status.rounds if context.status is not None else ()
    return context.silent or ("" if rounds else "the scenario has no rounds")


APP_ACTIONS = (
    ConsoleAction(
        "start_stop",
        ("space",),
        "Space",
        "start/stop",
        "on the ground: start (asks). In flight: HOLD ALL at once",
        COMMAND,
        9,
        why_not=_start_or_hold,
        label_now=_start_or_hold_label,
        method="command('start_stop')",
    ),
    ConsoleAction(
        "orders",
        ("c",),
        "c",
        "command",
        "what the selected vehicles can be told; asks",
        COMMAND,
        8,
        _needs_selection,
        method="command('orders')",
    ),
    ConsoleAction(
        "return_selected",
        ("r",),
        "r",
        "return",
        "the selected vehicles return and land; asks",
        COMMAND,
        4,
        why_not=_needs_selection,
        method="command('return_selected')",
    ),
    ConsoleAction(
        "hold_all",
        (),
        "!h",
        "HOLD ALL",
        "hold all vehicles, also from dialogs and forms",
        COMMAND,
        10,
        method="command('hold_all')",
    ),
    ConsoleAction(
        "land_all", (), "!l", "", "all land where they are, from anywhere", COMMAND, method="command('land_all')"
    ),
    ConsoleAction(
        "return_all",
        (),
        "!r",
        "",
        "all return by layers and land in turn, from anywhere",
        COMMAND,
        method="command('return_all')",
    ),
    ConsoleAction(
        "resume",
        (),
        "Enter",
        "resume",
        "in hold: the planners go on with those that flew for them before it",
        COMMAND,
        6,
        why_not=_resumes,
        method="command('resume')",
    ),
    ConsoleAction(
        "choose_round",
        ("o",),
        "o",
        "round",
        "make another round the present one, in flight too",
        COMMAND,
        5,
        why_not=_has_rounds,
        method="command('choose_round')",
    ),
    ConsoleAction(
        "select", ("s",), "s", "select", "by name: 3-7,9  t1  a team  all  none  invert; +5 -5; name=3-7", SELECT, 7
    ),
    ConsoleAction(
        "acknowledge", ("a",), "a", "", "the alarm of the second line was seen; it stays until it is over", ALARMS
    ),
    ConsoleAction(
        "show_alarms", ("A", "shift+a"), "A", "", "all alarms: acknowledge, put aside, what was before", ALARMS
    ),
    ConsoleAction("toggle_bell", ("B", "shift+b"), "B", "", "the bell of this console, off and on", ALARMS),
    ConsoleAction("show_fly", ("f",), "f", "Fly", "map, fleet, events", SCREENS, 4, method="show('fly')"),
    ConsoleAction("show_plan", ("p",), "p", "Plan", "zones, rounds, teams", SCREENS, 4, method="show('plan')"),
    ConsoleAction(
        "show_checks",
        ("P", "shift+p"),
        "P",
        "",
        "checks before a start: what refuses it; acknowledge, read again, sign",
        SCREENS,
    ),
    ConsoleAction("show_planners", ("M", "shift+m"), "M", "", "teams and planners, with all that they count", SCREENS),
    ConsoleAction(
        "show_vehicles",
        ("v",),
        "v",
        "Vehicles",
        "the whole fleet as cells or as a table",
        SCREENS,
        4,
        method="show('vehicles')",
    ),
    ConsoleAction(
        "show_journal",
        ("J", "shift+j"),
        "J",
        "Journal",
        "what happened: filter, follow, older lines",
        SCREENS,
        3,
        method="show('journal')",
    ),
    ConsoleAction("next_theme", ("T", "shift+t"), "T", "", "colours: dark, night (red), day, high contrast", SCREENS),
    ConsoleAction("redraw", ("ctrl+l",), "^L", "", "write the whole screen again", SCREENS),
    ConsoleAction("palette", ("colon", "ctrl+p"), ":", "find", "any action by name; ^P too", SCREENS, 7),
    ConsoleAction("show_help", ("question_mark",), "?", "help", "all keys, and what works now", SCREENS, 8),
    ConsoleAction("detach", ("q",), "q", "detach", "leave; station and vehicles go on", SCREENS, 8),
)

FLY_ACTIONS = (
    ConsoleAction(
        "select_next", ("n",), "n/N", "", "next and previous vehicle; of several selected: look at the next", SELECT, 3
    ),
    ConsoleAction("select_previous", ("N", "shift+n"), "N", "", "", SELECT),
    ConsoleAction("digit", (), "1..9", "", "3-7,9 and Enter: select those", SELECT),
    ConsoleAction("enter", ("enter",), "Enter", "", "", SELECT),
    ConsoleAction("cancel", ("escape",), "Esc", "", "close the result, hide the cursor, end follow", SELECT),
    ConsoleAction("pan_left", ("left", "h"), "arrows", "", "move the map, or its cursor; h j k l too", VIEW),
    ConsoleAction("pan_down", ("down", "j"), "down", "", "", VIEW),
    ConsoleAction("pan_up", ("up", "k"), "up", "", "", VIEW),
    ConsoleAction("pan_right", ("right", "l"), "right", "", "", VIEW),
    ConsoleAction("zoom_in", ("plus", "equals_sign"), "+ -", "zoom", "closer, farther", VIEW, 2),
    ConsoleAction("zoom_out", ("minus",), "-", "", "", VIEW),
    ConsoleAction("fit", ("z",), "z", "fit", "everything in view", VIEW, 2),
    ConsoleAction("follow", ("F", "shift+f"), "F", "follow", "keep the selected vehicle in view, or stop it", VIEW, 1),
    ConsoleAction(
        "cursor", ("x",), "x", "", "cursor on the map, on and off: degrees, metres, UTM; go to: `cursor`", VIEW
    ),
    ConsoleAction("measure", ("X", "shift+x"), "X", "", "measure distance and direction from the cursor", VIEW),
    ConsoleAction("grid", ("g",), "g", "", "grid on the map, on and off", VIEW),
    ConsoleAction("layers", ("L", "shift+l"), "L", "", "choose what is drawn on the map", VIEW),
    ConsoleAction("dots", ("D", "shift+d"), "D", "", "draw the map in braille, blocks or letters", VIEW),
)
