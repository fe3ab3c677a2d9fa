"""The missions screen's keys, for bindings, footer and help. While a field has the cursor only those with Ctrl work."""

from tui_gcs.actions import COMMAND, SELECT, Action

EDIT, MAP, VEHICLE = "Missions", "Map", "Vehicle"

MISSION_ACTIONS = (
    Action("upload", ("U", "shift+u"), "U", "upload", "fence, rally points, mission to vehicles; asks", COMMAND, 9),
    Action("download", ("d",), "d", "download", "what this vehicle holds, as an edit that u takes back", VEHICLE, 5),
    Action("compare", ("equals_sign",), "=", "compare", "how what it holds differs from what is planned", VEHICLE, 4),
    Action("save", ("ctrl+s",), "^S", "save", "all vehicles' plans to a file", EDIT, 8),
    Action("open", ("ctrl+o",), "^O", "open", "a file: missions of all, or a plan for this vehicle", EDIT, 3),
    Action("undo", ("u", "ctrl+z"), "u/^Z", "undo", "take back the last edit", EDIT, 7),
    Action("redo", ("Y", "shift+y", "ctrl+y"), "Y/^Y", "redo", "do again what was taken back", EDIT, 2),
    Action("add", ("plus", "insert"), "+", "add", "one more after this one; at the cursor if it is shown", EDIT, 7),
    Action("delete", ("delete", "backspace"), "Del", "delete", "the item; u brings it back", EDIT, 5),
    Action("generate", ("g",), "g", "generate", "survey, corridor, fence; for several vehicles", EDIT, 6),
    Action("take", ("ctrl+g",), "^G", "", "take what is generated", EDIT),
    Action("kind", ("t",), "t", "kind", "mission, fence, rally points", SELECT, 6),
    Action("digit", tuple("123456789"), "1-9", "", "edit this vehicle's plan", SELECT),
    Action("next_vehicle", ("n",), "n/N", "vehicle", "next and previous vehicle", SELECT, 6),
    Action("previous_vehicle", ("N", "shift+n"), "N", "", "", SELECT),
    Action("form", (), "Tab", "field", "next field; Shift+Tab the one before, Esc back to the list", EDIT, 4),
    Action("item_up", ("up",), "up", "", "item above; in a form: field before", SELECT),
    Action("item_down", ("down",), "down", "", "item below; in a form: next field", SELECT),
    Action("page_up", ("pageup",), "PgUp", "", "a page of items up", SELECT),
    Action("page_down", ("pagedown",), "PgDn", "", "a page of items down", SELECT),
    Action("first", ("home",), "Home", "", "first item", SELECT),
    Action("last", ("end",), "End", "", "last item", SELECT),
    Action("earlier", ("left_square_bracket",), "[ ]", "reorder", "the item earlier, later", EDIT, 2),
    Action("later", ("right_square_bracket",), "]", "", "", EDIT),
    Action("move_on_map", ("e",), "e", "on map", "arrows move the item (Shift: ten steps); or click", MAP, 3),
    Action("move_whole", ("E", "shift+e"), "E", "", "arrows move all items of this plan", MAP),
    Action("cursor", ("x",), "x", "cursor", "cursor on the map: arrows move it, + adds there", MAP, 3),
    Action("zoom_in", ("greater_than_sign",), "< >", "", "farther, closer", MAP),
    Action("zoom_out", ("less_than_sign",), "<", "", "", MAP),
    Action("fit", ("z",), "z", "", "everything in view", MAP),
    Action("other_side", ("i",), "i", "", "of a fence: inside or outside", EDIT),
    Action("clear", ("C", "shift+c"), "C", "", "plan nothing of this kind for this vehicle (press twice)", EDIT),
    Action("again", ("R", "shift+r"), "R", "", "send once more to those where it failed; asks", COMMAND),
    Action("cancel", ("K", "shift+k"), "K", "", "end uploads and downloads", VEHICLE),
    Action("leave", ("escape",), "Esc", "", "leave a field, the map, a form; close the result", SELECT),
    Action("resume", ("enter",), "Enter", "", "in hold, outside fields: go on with the planner", COMMAND),
)
