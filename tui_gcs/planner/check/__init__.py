"""The test bench for authors of planners: checks that every planner must pass before it flies.

Entry: `suite.CHECKS`, run by `tui-gcs planner check` in a process of its own. Each check takes a
`subject.CheckedPlanner` and yields findings: a verdict, what was measured, and advice.

Vehicles here only follow their intents (`runtime.kinematic_fleet`): there is no simulator, no station and no guard.
Flights on the simulator are in `tui_gcs/cli/planner/check_flights.py`.
"""
