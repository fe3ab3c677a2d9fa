"""Runs planners: loads them, steps them on fleet frames, and survives their mistakes.

Entry: `host.PlannerHost` steps one planner for one team. `worker` runs a host in a process of its own for the station,
`planner_subprocess` for lock-step runs, `bus_adapter` in the caller's process. `registry` and `planner_file` find
planner classes, `describe` and `preview` run foreign code in processes that can be killed.

What always holds: exceptions of planners end here, as the text of a `TeamPlan` or a `PlannerError`, and their plans are
checked before they are sent. Whether a plan is safe to fly is not decided here: the station's guard does that.
"""
