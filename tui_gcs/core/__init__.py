"""The station's core: everything that hears, judges and commands vehicles, without a terminal.

Its packages stand on floors, and imports lead down: from plain things (`base`, `geometry`, `plans`) over the wire
(`mavlink`, `links`, `protocol`) and the state of vehicles (`fleet`) to what acts on them (`guard`, `uplink`,
`firmware`, `flight`, `services`), to the station that puts them together (`station`, `requests`, `process`). The
order is `FLOORS` in `tests/test_walls.py`.

Always true: nothing here imports Textual, rich, a planner or the simulator; all waiting goes through an injected
`Clock`; every frame to a vehicle leaves through `uplink`.
"""
