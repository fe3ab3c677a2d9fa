"""What an operator can do, declared once: bindings, footer and `?` help are made from these tables.

A screen lists its own actions in `ACTIONS`; `APP_ACTIONS` work everywhere but in dialogs.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from textual.binding import Binding, BindingType


@dataclass(frozen=True)
class Action:
    """One thing to do.

    `id` names the method (`action_<id>`) of the app or screen. `keys` are Textual key names, none if the key is handled
    elsewhere; `shown` is the key as a human reads it. `label` stands in the footer (empty: only in the help), and a
    higher `weight` stays longest in a narrow one. An empty `help` is told by the action before it.
    """

    id: str
    keys: tuple[str, ...]
    shown: str
    label: str
    help: str
    group: str
    weight: int = 0


COMMAND, VIEW, SCREENS, SELECT, ALARMS = "Fly", "Map", "Screens", "Select", "Alarms"

APP_ACTIONS = (
    Action(
        "start_stop",
        ("space",),
        "Space",
        "start/stop",
        "on the ground: start (asks). In flight: HOLD at once",
        COMMAND,
        9,
    ),
    Action("return_and_land", ("r",), "r", "return", "return and land, from flight or hold", COMMAND, 7),
    Action("hold_all", (), "!h", "HOLD ALL", "hold all vehicles, also from dialogs and forms", COMMAND, 10),
    Action("choose_round", ("o",), "o", "round", "make another round the present one, in flight too", COMMAND, 5),
    Action("acknowledge", ("a",), "a", "", "the alarm of the second line was seen; it stays until it is over", ALARMS),
    Action("show_alarms", ("A", "shift+a"), "A", "", "all alarms: acknowledge, put aside, what was before", ALARMS),
    Action("toggle_bell", ("B", "shift+b"), "B", "", "the bell of this console, off and on", ALARMS),
    Action("show_fly", ("f",), "f", "Fly", "map, fleet, events", SCREENS, 4),
    Action("show_plan", ("p",), "p", "Plan", "zones, rounds, teams", SCREENS, 4),
    Action("next_theme", ("T", "shift+t"), "T", "", "colours: dark, night (red), day, high contrast", SCREENS),
    Action("redraw", ("ctrl+l",), "^L", "", "write the whole screen again", SCREENS),
    Action("show_help", ("question_mark",), "?", "help", "this page", SCREENS, 8),
    Action("detach", ("q",), "q", "detach", "leave; station and vehicles go on", SCREENS, 8),
)

FLY_ACTIONS = (
    Action("enter", ("enter",), "Enter", "resume", "in hold: the planner goes on", COMMAND, 6),
    Action("select_next", ("n",), "n/N", "select", "next and previous vehicle", SELECT, 3),
    Action("select_previous", ("N", "shift+n"), "N", "", "", SELECT),
    Action("digit", tuple("0123456789"), "1..9", "", "number, then Enter: select that vehicle", SELECT),
    Action("cancel", ("escape",), "Esc", "", "forget typed digits, end follow", SELECT),
    Action("pan_left", ("left", "h"), "arrows", "", "move the map, or its cursor; h j k l too", VIEW),
    Action("pan_down", ("down", "j"), "down", "", "", VIEW),
    Action("pan_up", ("up", "k"), "up", "", "", VIEW),
    Action("pan_right", ("right", "l"), "right", "", "", VIEW),
    Action("zoom_in", ("plus", "equals_sign"), "+ -", "zoom", "closer, farther", VIEW, 2),
    Action("zoom_out", ("minus",), "-", "", "", VIEW),
    Action("fit", ("z",), "z", "fit", "everything in view", VIEW, 2),
    Action("follow", ("F", "shift+f"), "F", "follow", "keep the selected vehicle in view, or stop it", VIEW, 1),
    Action("cursor", ("x",), "x", "", "cursor on the map, on and off: degrees, metres, UTM", VIEW),
    Action("measure", ("X", "shift+x"), "X", "", "measure distance and direction from the cursor", VIEW),
    Action("grid", ("g",), "g", "", "grid on the map, on and off", VIEW),
    Action("layers", ("L", "shift+l"), "L", "", "choose what is drawn on the map", VIEW),
    Action("dots", ("D", "shift+d"), "D", "", "draw the map in braille, blocks or letters", VIEW),
)


def bindings(actions: Iterable[Action]) -> list[BindingType]:
    """Textual bindings of the actions that have keys."""
    return [
        Binding(key, f"digit('{key}')" if action.id == "digit" else action.id, action.label or action.help, show=False)
        for action in actions
        for key in action.keys
    ]


def footer_actions(actions: Iterable[Action], width: int) -> list[Action]:
    """The actions with a label that fit into `width` cells, by weight, in the order they were declared."""
    labelled = [action for action in actions if action.label]
    kept: set[str] = set()
    used = 1
    for action in sorted(labelled, key=lambda action: -action.weight):
        cells = len(action.shown) + 1 + len(action.label) + 2
        if used + cells <= width + 1:
            kept.add(action.id)
            used += cells
    return [action for action in labelled if action.id in kept]
