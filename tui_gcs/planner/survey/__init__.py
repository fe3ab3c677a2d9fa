"""The survey planner: a team sees its zone once, in about the least time that its vehicles need together.

Entry class: `survey.SurveyPlanner`, a planner like any other, loaded by the registry. `lanes` cuts what is to be seen
into parallel lanes and shares them among vehicles.

What always holds: only cells that a footprint can reach are counted, as the referee counts them; what was seen is taken
from where vehicles were, so that a vehicle that is lost leaves no gap.

Not here: how long the zone was really unseen, which `core/judging` measures.
"""
