"""The plan screen's keys, for bindings, footer and help. While a field has the cursor only those with Ctrl work."""

from tui_gcs.actions.action import COMMAND, DIGITS, SELECT, action

EDIT, MAP = "Plan", "Map"

PLAN_ACTIONS = (
    action(
        "apply",
        "a ctrl+g",
        "apply",
        "send the edited scenario to the station; in flight it asks once more",
        EDIT,
        9,
        do="apply.apply",
    ),
    action("save", "ctrl+s", "save", "to the scenario's file, comments kept; asks where if it is not yours", EDIT, 8),
    action("undo", "u ctrl+z", "undo", "take back the last change, or values that were not allowed", EDIT, 6),
    action("form", "", "field", "next field; Shift+Tab the one before, Esc back to the list", EDIT, 5, shown="Tab"),
    action("add_zone", "plus insert", "add", "new zone in this round; in the line of teams a new team", EDIT, 4),
    action("open", "ctrl+o", "open", "zones from a file: KML, KMZ or GeoJSON of a map program, or ours", EDIT, 5),
    action("delete_zone", "delete backspace", "delete", "delete the zone, or there the team (press twice)", EDIT, 3),
    action("digit", DIGITS, "edit round", "edit another round; the flown one is marked", SELECT, 4, shown="1-9"),
    action(
        "team_page", "t", "team", "zone form or team form, where only one of them fits", SELECT, 5, do="forms.turn_page"
    ),
    action("settings", "g", "settings", "name, rounds, take-off places, limits, origin, good run", EDIT, 3),
    action("redo", "ctrl+y", "redo", "do again what was taken back", EDIT, 1),
    action(
        "copy_zone",
        "c",
        "copy",
        "the zone: then the number of a round, or 0 for all others",
        EDIT,
        1,
        do="parts.ask_copy",
    ),
    action("copy_to_all", "0", "", "", EDIT, do="parts.copy_to_all"),
    action("add_round", "R", "", "new round like this one", EDIT, do="parts.add_round"),
    action("delete_round", "X", "", "delete this round (press twice)", EDIT, do="parts.delete_round"),
    action("read_whole", "ctrl+r", "", "all findings of the plan: below the form they may be cut", EDIT),
    action("how_many", "i", "how many", "how many vehicles the team needs for a worst idleness", EDIT, 1),
    action("move_on_map", "e", "on map", "arrows move (Shift: ten steps), [ ] turn, { } size; Esc ends", MAP, 2),
    action("corner", "", "", "on the map: next and previous corner, then all; arrows move it, + Del", MAP, shown="n N"),
    action("snapping", "", "", "on the map: draw what moves to corners and edges, or a grid of 5 m", MAP, shown="S"),
    action(
        "pointer", "", "", "drag a corner or the inside, Ctrl turns; a double click adds a corner", MAP, shown="mouse"
    ),
    action("zoom_in", "greater_than_sign", "", "farther, closer", MAP, shown="< >", do="zoom(1)"),
    action("zoom_out", "less_than_sign", "", "", MAP, do="zoom(-1)"),
    action("fit", "z", "", "everything in view", MAP, do="map_view.fit"),
    action("rehearse", "H", "", "the rehearsals screen: rehearse what is applied, see what changed since", EDIT),
    action("missions", "m", "missions", "missions, fences, rally points of each vehicle", EDIT, 7),
    action("keep", "k", "", "scenario changed meanwhile: keep this copy", EDIT, do="apply.keep"),
    action("discard", "d", "", "scenario changed meanwhile: take the station's", EDIT, do="apply.discard"),
    action("zone_up", "up", "", "zone above; in a form: field before", SELECT, do="zone_list.action_move(-1)"),
    action("zone_down", "down", "", "zone below; in a form: next field", SELECT, do="zone_list.action_move(1)"),
    action("leave", "escape", "", "leave a field, the map, or a question", SELECT),
    action("resume", "enter", "", "in hold, outside fields: go on with the planner", COMMAND),
    action(
        "detach_asking", "q", "", "detach; with changes that are not saved it asks once more", SELECT, same_as="detach"
    ),
)
