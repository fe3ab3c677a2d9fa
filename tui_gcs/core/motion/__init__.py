"""Courses as functions of time, and how well vehicles keep to them.

A course is a `PositionTarget`, a `Trajectory`, a `Cruise` or an `Orbit`: each gives position and velocity at any time.
`TrackingMonitor` measures how late and how far off a vehicle is; `LeadCompensatedCourse` shifts what is sent so that
the vehicle is on time. `target_place` turns places of operators and files into points. `flight` makes and flies
courses, the guard predicts them, and the firmware names each autopilot's first lead compensation.

What always holds: positions are ENU metres with z above the vehicle's own home; a course is immutable; times are the
station's clock.

Not here: whether a course is safe (`guard`), set-points (`firmware`), planners' tours (`planner`).
"""
