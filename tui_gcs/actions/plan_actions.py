"""The plan screen's keys, for bindings, footer and help. While a field has the cursor only those with Ctrl work."""

from tui_gcs.actions import COMMAND, SELECT, ConsoleAction

EDIT, MAP = "Plan", "Map"

PLAN_ACTIONS = (
    ConsoleAction(
        "apply",
        ("a", "ctrl+g"),
        "a/^G",
        "apply",
        "send the edited scenario to the station; in flight it asks once more",
        EDIT,
        9,
    ),
    ConsoleAction(
        "save",
        ("ctrl+s",),
        "^S",
        "save",
        "to the scenario's file, comments kept; asks where if it is not yours",
        EDIT,
        8,
    ),
    ConsoleAction(
        "undo", ("u", "ctrl+z"), "u/^Z", "undo", "take back the last change, or values that were not allowed", EDIT, 6
    ),
    ConsoleAction("form", (), "Tab", "field", "next field; Shift+Tab the one before, Esc back to the list", EDIT, 5),
    ConsoleAction(
        "add_zone", ("plus", "insert"), "+", "add", "new zone in this round; in the line of teams a new team", EDIT, 4
    ),
    ConsoleAction(
        "open", ("ctrl+o",), "^O", "open", "zones from a file: KML, KMZ or GeoJSON of a map program, or ours", EDIT, 5
    ),
    ConsoleAction(
        "delete_zone",
        ("delete", "backspace"),
        "Del",
        "delete",
        "delete the zone, or there the team (press twice)",
        EDIT,
        3,
    ),
    ConsoleAction(
        "digit", tuple("123456789"), "1-9", "edit round", "edit another round; the flown one is marked", SELECT, 4
    ),
    ConsoleAction("team_page", ("t",), "t", "team", "zone form or team form, where only one of them fits", SELECT, 5),
    ConsoleAction(
        "settings",
        ("g",),
        "g",
        "settings",
        "name, rounds, take-off places, limits, origin, good run",
        EDIT,
        3,
    ),
    ConsoleAction("redo", ("Y", "shift+y", "ctrl+y"), "Y/^Y", "redo", "do again what was taken back", EDIT, 1),
    ConsoleAction(
        "copy_zone", ("c",), "c", "copy", "the zone: then the number of a round, or 0 for all others", EDIT, 1
    ),
    ConsoleAction("copy_to_all", ("0",), "0", "", "", EDIT),
    ConsoleAction("add_round", ("R", "shift+r"), "R", "", "new round like this one", EDIT),
    ConsoleAction("delete_round", ("X", "shift+x"), "X", "", "delete this round (press twice)", EDIT),
    ConsoleAction(
        "read_whole", ("ctrl+r",), "^R", "", "all that is said of the plan: below the form it may be cut", EDIT
    ),
    ConsoleAction(
        "how_many", ("i",), "i", "how many", "how many vehicles the team needs for a worst idleness", EDIT, 1
    ),
    ConsoleAction(
        "move_on_map", ("e",), "e", "on map", "arrows move (Shift: ten steps), [ ] turn, { } size; Esc ends", MAP, 2
    ),
    ConsoleAction(
        "corner", (), "n N", "", "on the map: next and previous corner, then all; arrows move it, + Del", MAP
    ),
    ConsoleAction("snapping", (), "S", "", "on the map: draw what moves to corners and edges, or a grid of 5 m", MAP),
    ConsoleAction(
        "pointer", (), "mouse", "", "drag a corner or the inside, Ctrl turns; a double click adds a corner", MAP
    ),
    ConsoleAction("zoom_in", ("greater_than_sign",), "< >", "", "farther, closer", MAP),
    ConsoleAction("zoom_out", ("less_than_sign",), "<", "", "", MAP),
    ConsoleAction("fit", ("z",), "z", "", "everything in view", MAP),
    ConsoleAction("missions", ("m",), "m", "missions", "missions, fences, rally points of each vehicle", EDIT, 7),
    ConsoleAction("keep", ("k",), "k", "", "scenario changed meanwhile: keep this copy", EDIT),
    ConsoleAction("discard", ("d",), "d", "", "scenario changed meanwhile: take the station's", EDIT),
    ConsoleAction("zone_up", ("up",), "up", "", "zone above; in a form: field before", SELECT, method="step_zone(-1)"),
    ConsoleAction(
        "zone_down", ("down",), "down", "", "zone below; in a form: next field", SELECT, method="step_zone(1)"
    ),
    ConsoleAction("leave", ("escape",), "Esc", "", "leave a field, the map, or a question", SELECT),
    ConsoleAction("resume", ("enter",), "Enter", "", "in hold, outside fields: go on with the planner", COMMAND),
    ConsoleAction(
        "detach_asking", ("q",), "q", "", "detach; with changes that nobody else has it asks once more", SELECT
    ),
)
