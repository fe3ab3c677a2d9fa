"""The plan screen's keys, for bindings, footer and help. While a field has the cursor only those with Ctrl work."""

from tui_gcs.actions import COMMAND, SELECT, Action

EDIT = "Plan"

PLAN_ACTIONS = (
    Action(
        "apply",
        ("a", "ctrl+g"),
        "a/^G",
        "apply",
        "send the edited scenario to the station; in flight it asks once more",
        EDIT,
        9,
    ),
    Action(
        "save",
        ("ctrl+s",),
        "^S",
        "save",
        "to the scenario's file, comments kept; asks where if it is not yours",
        EDIT,
        8,
    ),
    Action(
        "undo", ("u", "ctrl+z"), "u/^Z", "undo", "take back the last change, or values that were not allowed", EDIT, 6
    ),
    Action("form", (), "Tab", "field", "next field; Shift+Tab the one before, Esc back to the list", EDIT, 5),
    Action("add_zone", ("plus", "insert"), "+", "add", "new zone in this round", EDIT, 4),
    Action(
        "import_zones", ("ctrl+o",), "^O", "", "zones from a file: KML, KMZ or GeoJSON of a map program, or ours", EDIT
    ),
    Action("delete_zone", ("delete", "backspace"), "Del", "delete", "delete the zone (press twice)", EDIT, 3),
    Action("digit", tuple("123456789"), "1-9", "edit round", "edit another round; the flown one is marked", SELECT, 4),
    Action("team_page", ("t",), "t", "team", "zone form or team form, where only one of them fits", SELECT, 5),
    Action("move_on_map", ("e",), "e", "on map", "edit on the map: arrows move, [ ] turn, { } size", EDIT, 2),
    Action("missions", ("m",), "m", "missions", "missions, fences, rally points of each vehicle", EDIT, 7),
    Action("keep", ("k",), "k", "", "scenario changed meanwhile: keep this copy", EDIT),
    Action("discard", ("d",), "d", "", "scenario changed meanwhile: take the station's", EDIT),
    Action("zone_up", ("up",), "up", "", "zone above; in a form: field before", SELECT),
    Action("zone_down", ("down",), "down", "", "zone below; in a form: next field", SELECT),
    Action("leave", ("escape",), "Esc", "", "leave a field, the map, or a question", SELECT),
    Action("resume", ("enter",), "Enter", "", "in hold, outside fields: go on with the planner", COMMAND),
    Action("detach_asking", ("q",), "q", "", "detach; with changes that nobody else has it asks once more", SELECT),
)
