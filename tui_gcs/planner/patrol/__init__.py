"""The patrol planner: vehicles as equally timed slots on one closed tour of the zone.

Entry: `patrol.Patrol`, found by `runtime.registry` under the name "patrol". A tour is constructed (`tour_seeds`,
`tour_construction`), smoothed (`tour_smoothing`), evaluated exactly (`tour`, `tour_site`) and optimised in the
background (`tour_search`). Vehicles get slots (`slots`, `formation`) and ways to them (`transit`); in strong wind the
tour is flown slower (`speed_adaptation`).

What always holds: planned paths lie in the `FlyableRegion`, and the state between two steps is in `patrol_state`, so
that a restarted worker's plans are bit-identical. Figures and sources of the algorithms are in docs/planning.md C1 and
C2. `guardian` and `waypoints` use the geometry of tours and transits from here.
"""
