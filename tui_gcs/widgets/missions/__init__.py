"""Models and widgets of the missions screen: the draft of plans, lists, forms, profile, files.

`MissionEditor` (the draft, its undo history and the selection), `MissionEdits` (changes of items) and `MissionFile`
are independent of Textual; `PlanList`, `ItemTable`, `AltitudeProfile` and the forms show them.

Always: every edit is one undo step, and typing in one field is one edit; a field that was not touched keeps its exact
value. Places are ENU metres, heights are in the item's own frame.

Not here: what a plan costs and where plans meet (`core/missions`), the keys (`screens/missions`).
"""
