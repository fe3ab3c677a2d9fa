"""The actions of the app and of the fly screen. Those of other screens stand beside them."""

from typing import Any

from tui_gcs.actions.action import ALARMS, COMMAND, SCREENS, SELECT, VIEW, ConsoleAction, action
from tui_gcs.actions.action_context import ActionContext
from tui_gcs.actions.list_actions import DIGITS_ACTION
from tui_gcs.core.protocol.common import Phase, RunPhase

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


def _may_command(context: ActionContext) -> str:
    return context.read_only or context.silent


def _has_rounds(context: ActionContext) -> str:
    rounds = context.status.rounds if context.status is not None else ()
    return context.silent or ("" if rounds else "the scenario has no rounds")


def _command(name: str, keys: str, label: str, text: str, weight: int = 0, **more: Any) -> ConsoleAction:
    """Return a command to the station, which `CommandController` carries out by the action's id."""
    return action(name, keys, label, text, COMMAND, weight, do=f"command('{name}')", **more)


MENU_SCREENS = (
    ("p", "parameters", "Parameters", "search, compare, set, copy, load, save"),
    ("i", "inspector", "Inspector", "every message live: rates, fields, bytes, drops"),
    ("s", "setup", "Setup", "calibrations, radio, modes, failsafes, motors, gains"),
    ("l", "links", "Links", "losses, rates, radios of every path; add, close"),
    ("g", "plots", "Plots", "any value of any vehicles over time, live"),
    ("o", "onboard", "Onboard logs", "logs on vehicles: list, download several at once"),
    ("f", "flights", "Flights", "recorded flights and logs: what happened, replay"),
    ("r", "rehearsals", "Rehearsals", "rehearse now; gates, what changed since, reports"),
    ("a", "traffic", "Traffic", "tracks, ADS-B, Remote ID; tasks for planners"),
    ("n", "planner_log", "Planner log", "what planners print and log, by team and level"),
    ("t", "tasks", "Tasks", "what goes on, cancel; who is connected, hand over"),
    ("e", "settings", "Settings", "what config.toml holds, where from; change it"),
)
"""Screens without a key of their own: letter in the menu of `S`, mode, name, what is on it."""


def _screen(letter: str, mode: str, name: str, text: str) -> ConsoleAction:
    """Return the action that shows a screen of the menu; the palette finds it by its name."""
    return action(
        f"show_{mode}", "", name, f"{name.lower()}: {text}", SCREENS, shown=f"S {letter}", do=f"show('{mode}')"
    )


APP_ACTIONS = (
    _command(
        "start_stop",
        "space",
        "start/stop",
        "on the ground: start (asks). In flight: HOLD ALL at once",
        9,
        why_not=_start_or_hold,
        label_now=_start_or_hold_label,
    ),
    _command("orders", "c", "command", "orders to the selected vehicles; asks", 8, why_not=_needs_selection),
    _command(
        "return_selected", "r", "return", "the selected vehicles return and land; asks", 4, why_not=_needs_selection
    ),
    # Without keys: `KeyChord` takes `!` and the letter before any dialog or field can.
    _command("hold_all", "", "HOLD ALL", "hold all vehicles, also from dialogs and forms", 10, shown="!h"),
    _command("land_all", "", "", "all land where they are, from anywhere", shown="!l"),
    _command("return_all", "", "", "all return by layers and land in turn, from anywhere", shown="!r"),
    _command(
        "resume",
        "",
        "resume",
        "in hold: the planners go on with those that flew for them before it",
        8,
        shown="Enter",
        why_not=_resumes,
    ),
    _command("choose_round", "o", "round", "make another round the present one, in flight too", 5, why_not=_has_rounds),
    action("select", "s", "select", "by name: 3-7,9  t1  a team  all  none  invert; +5 -5; name=3-7", SELECT, 7),
    action("acknowledge", "a", "", "the alarm of the second line was seen; it stays until it is over", ALARMS),
    action("show_alarms", "A", "", "all alarms: acknowledge, put aside, what was before", ALARMS),
    action("toggle_bell", "B", "", "the bell of this console, off and on", ALARMS),
    action("show_fly", "f", "Fly", "map, fleet, events", SCREENS, 4, do="show('fly')"),
    action("show_plan", "p", "Plan", "zones, rounds, teams", SCREENS, 4, do="show('plan')"),
    action("show_checks", "P", "", "checks before a start: what refuses it; acknowledge, read again, sign", SCREENS),
    action("show_planners", "M", "", "teams and planners, with all that they count", SCREENS),
    action(
        "show_vehicles", "v", "Vehicles", "the whole fleet as cells or as a table", SCREENS, 4, do="show('vehicles')"
    ),
    action(
        "show_journal", "J", "Journal", "what happened: filter, follow, older lines", SCREENS, 3, do="show('journal')"
    ),
    action("show_menu", "S", "screens", "all other screens: S and a letter", SCREENS, 7),
    *(_screen(*each) for each in MENU_SCREENS),
    action("next_theme", "T", "", "colours: dark, night (red), day, high contrast", SCREENS),
    action("redraw", "ctrl+l", "", "write the whole screen again", SCREENS),
    action("palette", "colon ctrl+p", "find", "any action by name; ^P too", SCREENS, 6, shown=":"),
    action("show_help", "question_mark", "help", "all keys, and what works now", SCREENS, 8),
    action("detach", "q", "detach", "leave; station and vehicles go on", SCREENS, 8),
)

FLY_ACTIONS = (
    action(
        "select_next",
        "n",
        "",
        "next and previous vehicle; of several selected: look at the next",
        SELECT,
        3,
        shown="n/N",
        do="step(1)",
    ),
    action("select_previous", "N", "", "", SELECT, do="step(-1)"),
    DIGITS_ACTION,
    action("enter", "enter", "", "", SELECT, same_as="resume"),
    action("cancel", "escape", "", "close the result, hide the cursor, end follow", SELECT),
    action("pan_left", "left h", "", "move the map, or its cursor; h j k l too", VIEW, shown="arrows", do="pan(-1, 0)"),
    action("pan_down", "down j", "", "", VIEW, do="pan(0, 1)"),
    action("pan_up", "up k", "", "", VIEW, do="pan(0, -1)"),
    action("pan_right", "right l", "", "", VIEW, do="pan(1, 0)"),
    action("zoom_in", "plus equals_sign", "zoom", "closer, farther", VIEW, 2, shown="+ -", do="zoom(1)"),
    action("zoom_out", "minus", "", "", VIEW, do="zoom(-1)"),
    action("fit", "z", "fit", "everything in view", VIEW, 2, do="map_view.fit"),
    action("follow", "F", "follow", "keep the selected vehicle in view, or stop it", VIEW, 1),
    action("cursor", "x", "", "cursor on the map, on and off: degrees, metres, UTM; go to: `cursor`", VIEW),
    action("add_task", "t", "", "add a task for planners at the cursor", VIEW, why_not=_may_command),
    action("measure", "X", "", "measure distance and direction from the cursor", VIEW),
    action("grid", "g", "", "grid on the map, on and off", VIEW),
    action("layers", "L", "", "choose what is drawn on the map", VIEW),
    action("dots", "D", "", "draw the map in braille, blocks or letters", VIEW, do="map_view.next_dots"),
)
