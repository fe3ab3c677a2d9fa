"""Planning missions for vehicles: drafts, generators, forecasts and findings, all of it pure.

Consoles and command-line verbs edit a `MissionDraft` (draft.py) and show its `Forecast`: the path of each mission
(`timed_path`), conflicts between paths, findings. `generate` makes surveys, corridor scans and fences; `plan_compare`
decides whether a vehicle holds what was sent, for the plan jobs of `core/services/plans` as well.

What always holds: drafts are immutable values; nothing here knows a vehicle's state, sends anything or reads a clock.
Kinds and items of plans are in `core/plans`, files of other programs in `core/formats`, what autopilots make of items
in `core/firmware/plan_dialects`.
"""
