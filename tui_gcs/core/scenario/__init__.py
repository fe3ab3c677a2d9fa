"""The scenario: one TOML file that describes a mission.

`load.load` reads a file into a `model.Scenario`, which is immutable, or raises `ScenarioError` with every problem and
its line; `fields.Problems` collects them and makes their texts. `edit.ScenarioDocument` changes the text of a file and
keeps its comments. The station, the planners, the plan screen and the command line all start from a `Scenario`.

Always true: positions are ENU metres about the scenario's origin, whatever units the file uses; a loaded
`Scenario` passed all checks of `check`. Not here: drawings of zones (`formats`), remarks about a valid scenario
(`missions`), and whether vehicles are ready to fly it (`preflight`).
"""
