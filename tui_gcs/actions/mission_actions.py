"""The missions screen's keys, for bindings, footer and help. While a field has the cursor only those with Ctrl work."""

from tui_gcs.actions import COMMAND, SELECT, ConsoleAction

EDIT, MAP, VEHICLE = "Missions", "Map", "Vehicle"

MISSION_ACTIONS = (
    ConsoleAction(
        "upload", ("U", "shift+u"), "U", "upload", "fence, rally points, mission to vehicles; asks", COMMAND, 9
    ),
    ConsoleAction(
        "download",
        ("d",),
        "d",
        "download",
        "what this vehicle holds, as an edit that u takes back",
        VEHICLE,
        5,
        method="fetch('downloaded')",
    ),
    ConsoleAction(
        "compare",
        ("equals_sign",),
        "=",
        "compare",
        "how what it holds differs from what is planned",
        VEHICLE,
        4,
        method="fetch('compared')",
    ),
    ConsoleAction("save", ("ctrl+s",), "^S", "save", "all vehicles' plans to a file", EDIT, 8),
    ConsoleAction("open", ("ctrl+o",), "^O", "open", "a file: missions of all, or a plan for this vehicle", EDIT, 5),
    ConsoleAction(
        "write", ("W", "shift+w"), "W", "", "this vehicle's plans to a file: .plan .waypoints .kml .geojson", EDIT
    ),
    ConsoleAction("undo", ("u", "ctrl+z"), "u/^Z", "undo", "take back the last edit", EDIT, 7),
    ConsoleAction("redo", ("Y", "shift+y", "ctrl+y"), "Y/^Y", "redo", "do again what was taken back", EDIT, 2),
    ConsoleAction(
        "add", ("plus", "insert"), "+", "add", "one more after this one; at the cursor if it is shown", EDIT, 7
    ),
    ConsoleAction("delete", ("delete", "backspace"), "Del", "delete", "the item; u brings it back", EDIT, 5),
    ConsoleAction("generate", ("g",), "g", "generate", "survey, corridor, fence; for several vehicles", EDIT, 6),
    ConsoleAction("assume", ("b",), "b", "", "what vehicles can: speed, climb, battery, reserve", EDIT),
    ConsoleAction(
        "copy",
        ("V", "shift+v"),
        "V",
        "copy",
        "mission, fence, rally points to other vehicles, on their layers",
        EDIT,
        1,
    ),
    ConsoleAction("take", ("ctrl+g",), "^G", "", "take what is generated", EDIT),
    ConsoleAction("kind", ("t",), "t", "kind", "mission, fence, rally points", SELECT, 6),
    ConsoleAction("digit", tuple("123456789"), "1-9", "", "edit this vehicle's plan", SELECT),
    ConsoleAction(
        "next_vehicle", ("n",), "n/N", "vehicle", "next and previous vehicle", SELECT, 6, method="step_vehicle(1)"
    ),
    ConsoleAction("previous_vehicle", ("N", "shift+n"), "N", "", "", SELECT, method="step_vehicle(-1)"),
    ConsoleAction("form", (), "Tab", "field", "next field; Shift+Tab the one before, Esc back to the list", EDIT, 4),
    ConsoleAction("item_up", ("up",), "up", "", "item above; in a form: field before", SELECT, method="step_item(-1)"),
    ConsoleAction(
        "item_down", ("down",), "down", "", "item below; in a form: next field", SELECT, method="step_item(1)"
    ),
    ConsoleAction("page_up", ("pageup",), "PgUp", "", "a page of items up", SELECT, method="step_page(-1)"),
    ConsoleAction("page_down", ("pagedown",), "PgDn", "", "a page of items down", SELECT, method="step_page(1)"),
    ConsoleAction("first", ("home",), "Home", "", "first item", SELECT, method="choose_item(0)"),
    ConsoleAction("last", ("end",), "End", "", "last item", SELECT, method="choose_item(-1)"),
    ConsoleAction(
        "earlier", ("left_square_bracket",), "[ ]", "reorder", "the item earlier, later", EDIT, 2, method="reorder(-1)"
    ),
    ConsoleAction("later", ("right_square_bracket",), "]", "", "", EDIT, method="reorder(1)"),
    ConsoleAction(
        "move_on_map",
        ("e",),
        "e",
        "on map",
        "arrows move the item (Shift: ten steps); or click",
        MAP,
        3,
        method="move_on_map(False)",
    ),
    ConsoleAction(
        "move_whole", ("E", "shift+e"), "E", "", "arrows move all items of this plan", MAP, method="move_on_map(True)"
    ),
    ConsoleAction("cursor", ("x",), "x", "cursor", "cursor on the map: arrows move it, + adds there", MAP, 3),
    ConsoleAction("zoom_in", ("greater_than_sign",), "< >", "", "farther, closer", MAP),
    ConsoleAction("zoom_out", ("less_than_sign",), "<", "", "", MAP),
    ConsoleAction("fit", ("z",), "z", "", "everything in view", MAP),
    ConsoleAction(
        "read_whole", ("ctrl+r",), "^R", "", "all that is said of the plans: below the list it may be cut", EDIT
    ),
    ConsoleAction("other_side", ("i",), "i", "", "of a fence: inside or outside", EDIT),
    ConsoleAction(
        "new_polygon",
        ("G", "shift+g"),
        "G",
        "",
        "fence: one more polygon, at the cursor or home",
        EDIT,
        method="new_fence('polygon')",
    ),
    ConsoleAction(
        "new_circle",
        ("O", "shift+o"),
        "O",
        "",
        "fence: one more circle, at the cursor or home",
        EDIT,
        method="new_fence('circle')",
    ),
    ConsoleAction("clear", ("C", "shift+c"), "C", "", "plan nothing of this kind for this vehicle (press twice)", EDIT),
    ConsoleAction("again", ("R", "shift+r"), "R", "", "send once more to those where it failed; asks", COMMAND),
    ConsoleAction("cancel", ("K", "shift+k"), "K", "", "end uploads and downloads", VEHICLE),
    ConsoleAction("leave", ("escape",), "Esc", "", "leave a field, the map, a form; close the result", SELECT),
    ConsoleAction("resume", ("enter",), "Enter", "", "in hold, outside fields: go on with the planner", COMMAND),
)
