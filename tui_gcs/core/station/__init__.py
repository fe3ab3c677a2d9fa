"""The station: composition root of everything that flies the fleet.

Entry class: `station.Station`. It builds the parts (`assembly`), grouped in frozen records (`parts`), and runs them
by a declared schedule (`tick_schedule`). `core/process` runs it in a process, rehearsals and tests in lock-step.

What always holds: everything happens on the caller's thread and nothing waits; the tasks of a tick run in one order;
consumers take records of parts, never the `Station`. A rehearsal repeats a flight byte for byte.

`replay_player` is the station of a recording: it shows one and commands nothing.

Not here: roles of askers (`core/requests`), checks before a start (`core/preflight`): they attach to a station from
above, through `frontend_protocol`.
"""
