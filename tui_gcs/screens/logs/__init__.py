"""The screens of what happened: the list of alarms, the journal and the planner log.

`AlarmScreen` (a dialog over any screen) acknowledges and shelves alarms; `JournalScreen` filters the events of this
and of earlier runs, which it requests from the station piece by piece. `PlannerLogScreen` does the same for what
planners print and log.

Always: the mark stays with its alarm while others come and go, and a key that may be meant for the alarm before is
refused. The view stays where it is while an operator reads older events.

Not here: the alarm line at the top of every screen (`widgets/basics`), and which alarms exist (`core/alarms`).
"""
