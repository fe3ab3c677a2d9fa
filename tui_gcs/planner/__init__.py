"""Planners: what decides where the vehicles of a team fly, and the machinery that runs it.

A planner is a class written against `api`. Built-in ones are `patrol` (a tour of equally timed slots), `guardian` (a
ring that meets intruders) and `waypoints` (drawn paths); they use nothing of tui-gcs but `api` and each other.
`runtime` hosts planners in processes of their own, `check` is the test bench for their authors.

What always holds: the same frames and the same seed give the same plans, bit for bit. A planner may hang or crash; the
station keeps the vehicles safe without it. The station never imports this package, and planners never import the
station: plans and tasks pass over the bus.
"""
