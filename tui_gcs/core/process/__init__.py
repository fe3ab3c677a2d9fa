"""The station as a process of its own: its loop, its planner workers, and its state on disk.

Entry point: `station_process.main`, which the supervisor (`tui_gcs/client/launcher.py`) starts. `planner_workers`
keeps one process per team; `state_store` writes what the next start must know after `kill -9`.

What always holds: the loop never waits for a console, a planner or a disk; under any flood of datagrams the tick
ends; a restarted station sends no set-point before an operator, or the scenario's `resume = true`, resumes.

Not here: what a station does (`core/station`), and the code that planners run (`tui_gcs/planner`).
"""
