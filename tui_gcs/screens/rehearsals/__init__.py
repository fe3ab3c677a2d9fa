"""The rehearsals screen: starts a rehearsal of the station's scenario in the background, and shows how all went.

`RehearsalsScreen` shows them, `rehearsal_runs` starts and cancels. A rehearsal is `tui-gcs rehearse` in a process of
lowest priority (`client/rehearsal_job.py`): it outlives this console and never reaches a vehicle. Not here: drawing
(`widgets/rehearsals`), the flight and its judgement (`rehearsal`, `core/judging`).
"""
