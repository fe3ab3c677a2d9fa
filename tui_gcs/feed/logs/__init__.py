"""What is written down, as this console has it: events without gaps, notes to the journal, the planner log.

`EventHistory` belongs to the feed and is always filled; `PlannerLogWatch` asks the station only while its screen is
shown. Not here: the files themselves (`core/records`).
"""
