"""The simulated fleet, and the programs that run vehicles: simulated, real, and behind bad links.

`fleet.SimFleet` is the entry for rehearsals and tests: `step`, `receive`, `drain`, and the truth for referees. Programs
are `python -m sitl.launch.simulated` (the fleet over UDP), `python -m sitl.launch.real` (real autopilots in their own
simulators) and `python -m sitl.launch.proxy` (bad links); `tui-gcs sim` and stations start them.

What always holds: `SimFleet.step` is its only source of time. Bad input is one line on stderr and exit status 2, and a
program ends with the process that started it, however that ends.

Not here: autopilots and physics themselves (the rooms below).
"""
