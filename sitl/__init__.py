"""Simulated vehicles: ArduCopter and PX4 as MAVLink endpoints, and the programs that run them.

`launch.fleet.SimFleet` is the entry: `tui_gcs.rehearsal` steps it in lock-step with a station, and `launch.simulated`
runs it in real time over UDP. `launch.real` starts real autopilots in their own simulators, `launch.proxy` makes links
bad.

What always holds: the same calls give the same bytes. Nothing reads a real clock, and everything random comes from the
seed. The simulator is an independent oracle: it imports nothing of `tui_gcs`, and repeats on purpose what it needs of
MAVLink, so that a mistake on one side shows. It behaves as real vehicles were measured to (docs/autopilots.md), bugs
included.

Imports lead down: `links` and `physics`, then `common`, `services`, `ardupilot` and `px4`, `launch`
(tests/sitl/test_floors.py). Not here: anything about scenarios, planners and stations.
"""
