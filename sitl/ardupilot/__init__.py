"""A simulated ArduCopter 4.7, as measured in its SITL (docs/autopilots.md "ArduCopter").

`copter.ArduCopter` is the entry; the fleet makes one for each vehicle. It puts the parts together, each about one
subject: flight phases, set-points in GUIDED, AUTO, modes, arming, failsafes, fence, battery, commands, telemetry,
missions, files, calibrations, Remote ID.

What always holds: texts, results and their order are those of the real autopilot, its bugs included. A part knows only
the parts that it is given, and none of them knows the `ArduCopter`.

Not here: how the vehicle moves (`physics`), and what PX4 does in the same way (`common`, `services`).
"""
