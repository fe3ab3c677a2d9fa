"""Rehearsals: whole scenarios flown in lock-step on simulated vehicles, as fast as the computer allows.

Entry: `rehearse.rehearse`, called by `tui-gcs rehearse` and `tui-gcs demo --headless`. `lock_step.LockStep` joins
simulator, station and planners on one virtual clock, `fault_schedule` injects faults, `report` makes the HTML report.

What always holds: the same seed gives the same run byte for byte, and only MAVLink bytes pass between station and
simulator. This is the only package of `tui_gcs` that imports `sitl`. Whether a flight was good is decided by the
referee in `tui_gcs/core/judging/`.
"""
