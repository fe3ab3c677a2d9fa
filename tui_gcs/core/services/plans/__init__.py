"""The mission protocol: missions, fences and rally points of vehicles.

`MissionService` is the entry; request handlers, preflight checks and the fleet frame use it. It submits the jobs of
`plan_jobs` (upload, download, clear), each of which leads a dialogue (`plan_upload`, `plan_download`) that sends
through a `PlanChannel`. `PlanRegistry` keeps what is known of each vehicle's plans and progress.

What always holds: an upload is done only when the vehicle was asked what it holds, and holds it; a plan is believed to
be on board only until a report contradicts it. The plans themselves are in `core/plans`, what autopilots make of them
in `core/firmware/plan_dialects`, how two plans compare in `core/missions/plan_compare`.
"""
