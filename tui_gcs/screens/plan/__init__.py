"""The plan screen: rounds, zones, teams and settings of the scenario, edited on a map and in forms.

`PlanScreen` is layout and handlers; `PlanForms`, `PartEdits`, `PlanPreview` and `ScenarioApply` are its subjects.
The working copy is in the models `ScenarioEditor` and `PlanDraft` of `widgets/plan`.

Always: only text that parses as a scenario reaches the map and the station. Only an apply sends it, in flight at the
second press. A value that is not allowed stays in its field with the reason.

Not here: drawing and forms (`widgets/plan`), findings about a scenario (`core/missions`), planning the preview
(workers of the station).
"""
