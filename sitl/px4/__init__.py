"""A simulated PX4 multicopter, as measured in PX4 1.16 and 1.17 SITL (docs/autopilots.md "PX4").

`multicopter.Px4` is the entry; the fleet makes one for each vehicle. Its parts bear PX4's own names where it has one:
the commander decides on modes and arming, the navigator flies. Beside them: arming checks, failsafes, events and texts,
missions, files, calibrations, telemetry.

What always holds: texts, events, results and their order are those of the real autopilot, its bugs included. A text is
sent only while a ground station's heartbeats arrive. A part knows only the parts that it is given.

Not here: the position controller (`physics.px4_position_control`), and what ArduCopter does in the same way (`common`,
`services`).
"""
