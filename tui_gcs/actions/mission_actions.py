"""The missions screen's keys, for bindings, footer and help. While a field has the cursor only those with Ctrl work."""

from tui_gcs.actions.action import COMMAND, DIGITS, SELECT, action
from tui_gcs.actions.list_actions import copy_actions

EDIT, MAP, VEHICLE = "Missions", "Map", "Vehicle"

MISSION_ACTIONS = (
    action(
        "upload", "U", "upload", "fence, rally points, mission to vehicles; asks", COMMAND, 9, do="transfers.upload"
    ),
    action(
        "download",
        "d",
        "download",
        "what this vehicle holds, as an edit that u takes back",
        VEHICLE,
        5,
        do="transfers.fetch('downloaded')",
    ),
    action(
        "compare",
        "equals_sign",
        "compare",
        "how what it holds differs from what is planned",
        VEHICLE,
        4,
        do="transfers.fetch('compared')",
    ),
    action("save", "ctrl+s", "save", "all vehicles' plans to a file", EDIT, 8),
    action("open", "ctrl+o", "open", "a file: missions of all, or a plan for this vehicle", EDIT, 5),
    action("write", "W", "", "write this vehicle's plans to a file: .plan .waypoints .kml .geojson", EDIT),
    action("undo", "u ctrl+z", "undo", "take back the last edit", EDIT, 7),
    action("redo", "ctrl+y", "redo", "do again what was taken back", EDIT, 2, do="edit('editor.redo')"),
    action("add", "plus insert", "add", "one more after this one; at the cursor if it is shown", EDIT, 7),
    action("delete", "delete backspace", "delete", "the item; u brings it back", EDIT, 5, do="edit('edits.delete')"),
    action("generate", "g", "generate", "survey, corridor, fence; for several vehicles", EDIT, 6),
    action("assume", "b", "", "what vehicles can: speed, climb, battery, reserve", EDIT, do="forms.open_performance"),
    action(
        "copy", "V", "copy", "mission, fence, rally points to other vehicles, on their layers", EDIT, 1, do="copies.ask"
    ),
    *copy_actions("the item", "all items of this plan"),
    action("take", "ctrl+g", "", "take what is generated", EDIT, do="forms.take_generated"),
    action("kind", "t", "kind", "mission, fence, rally points", SELECT, 6, do="edit('editor.step_kind')"),
    action("digit", DIGITS, "", "edit this vehicle's plan", SELECT, shown="1-9"),
    action("next_vehicle", "n", "vehicle", "next and previous vehicle", SELECT, 6, shown="n/N", do="step_vehicle(1)"),
    action("previous_vehicle", "N", "", "", SELECT, do="step_vehicle(-1)"),
    action("form", "", "field", "next field; Shift+Tab the one before, Esc back to the list", EDIT, 4, shown="Tab"),
    action("item_up", "up", "", "item above; in a form: field before", SELECT, do="step_item(-1)"),
    action("item_down", "down", "", "item below; in a form: next field", SELECT, do="step_item(1)"),
    action("page_up", "pageup", "", "a page of items up", SELECT, do="step_page(-1)"),
    action("page_down", "pagedown", "", "a page of items down", SELECT, do="step_page(1)"),
    action("first", "home", "", "first item", SELECT, do="choose_item(0)"),
    action("last", "end", "", "last item", SELECT, do="choose_item(-1)"),
    action(
        "earlier", "left_square_bracket", "reorder", "the item earlier, later", EDIT, 2, shown="[ ]", do="reorder(-1)"
    ),
    action("later", "right_square_bracket", "", "", EDIT, do="reorder(1)"),
    action(
        "move_on_map",
        "e",
        "on map",
        "arrows move the item (Shift: ten steps); or click",
        MAP,
        3,
        do="move_on_map(False)",
    ),
    action("move_whole", "E", "", "arrows move all items of this plan", MAP, do="move_on_map(True)"),
    action("cursor", "x", "cursor", "cursor on the map: arrows move it, + adds there", MAP, 3),
    action("zoom_in", "greater_than_sign", "", "farther, closer", MAP, shown="< >", do="zoom(1)"),
    action("zoom_out", "less_than_sign", "", "", MAP, do="zoom(-1)"),
    action("fit", "z", "", "everything in view", MAP, do="map_view.fit"),
    action("read_whole", "ctrl+r", "", "all findings of the plans: below the list they may be cut", EDIT),
    action("other_side", "i", "", "of a fence: inside or outside", EDIT, do="edit('edits.other_side')"),
    action("new_polygon", "G", "", "fence: one more polygon, at the cursor or home", EDIT, do="new_fence('polygon')"),
    action("new_circle", "O", "", "fence: one more circle, at the cursor or home", EDIT, do="new_fence('circle')"),
    action("clear", "C", "", "plan nothing of this kind for this vehicle (press twice)", EDIT),
    action("again", "R", "", "send once more to those where it failed; asks", COMMAND, do="transfers.upload_again"),
    action("cancel", "K", "", "end uploads and downloads", VEHICLE, do="transfers.cancel"),
    action("leave", "escape", "", "leave a field, the map, a form; close the result", SELECT, do="forms.leave"),
    action("resume", "enter", "", "in hold, outside fields: go on with the planner", COMMAND),
)
