"""Models and widgets of the plan screen: the edited scenario, its shapes on the map, lists.

`ScenarioEditor` (text, undo history, what the station flies), `scenario_edits` (zones, rounds, teams) and `PlanDraft`
(what is in the forms) are independent of Textual. `EditMap`, `ZoneList` and `RoundChooser` show them; `shape_edit`
and `shape_corners` are geometry.

Always: a change either leaves a valid scenario or returns the reasons why it was not made.

Not here: the scenario file itself (`core/scenario`), the keys (`screens/plan`).
"""
