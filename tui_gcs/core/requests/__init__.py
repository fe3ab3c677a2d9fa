"""Requests: what consoles, workers and scripts may ask of a station, by the role of each.

Entry point: `frontend.attach_frontend(station)`; from then on `request_router.RequestRouter` answers every request
by one table: struct type -> handler, with the access that it needs. Handlers take a frozen `context.RequestContext`.

What always holds: the principal comes from the bus key; a planner worker may look and nothing else; the principal of
the newest command is in control; every command is journalled with its result per vehicle; what takes time becomes a
task (`tasks`) that goes on when its client is gone.

Not here: the structs of requests (`core/protocol`), and the services that carry them out (`core/services`,
`core/flight`).
"""
