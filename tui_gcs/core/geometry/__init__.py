"""Geometry: local coordinates, zones, routes and idleness. Pure functions and values.

Entries: `local_frame.LocalFrame` (degrees to ENU metres about the scenario's `Origin` and back), `zones` (shapes and
roles), `shortest_route.route` (a way around no-fly zones), `idleness_grid.IdlenessGrid` (how long cells were unseen),
`utm`. Positions are ENU metres, x east and y north; degrees occur only in `local_frame` and `utm`. Not here: heights of
terrain, courses over time (core/motion), what may be flown (core/guard).
"""
