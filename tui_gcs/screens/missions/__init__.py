"""The missions screen: missions, fences and rally points of every vehicle, and their transfer.

`MissionsScreen` is layout and handlers; `MissionForms`, `MissionTransfers` and `PlanCopies` are its subjects. The
draft is in the models `MissionEditor` and `MissionEdits` of `widgets/missions`. `UploadDialog` asks before plans are
sent.

Always: vehicles get plans only by a confirmed upload; every edit can be undone; unsaved work is recovered after a
crash; a transfer is a task of the station and outlives the console.

Not here: forecasts, conflicts and generators (`core/missions`), the transfer itself (`feed/plan_transfers`).
"""
