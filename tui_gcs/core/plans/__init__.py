"""Plans: missions, fences and rally points as lists of MAVLink items. Pure values and checks.

`model.Plan` holds the items of one plan as every autopilot understands them; `check.check` finds what makes a plan
unfit to be sent at all. Used by the plan services, the file formats and the mission editor. Not here: what one
autopilot wants differently (core/firmware/plan_dialects), transfers (core/services/plans), and planning for several
vehicles (core/missions).
"""
