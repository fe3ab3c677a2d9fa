"""What both simulated autopilots are built on: state, time, output, storage, boot and tick.

`autopilot.Autopilot` is the base of `ArduCopter` and `Px4`: it boots, ticks, and hands received messages to handlers.
`platform.Platform` is the record of parts that everything else gets: clock, outbox, tasks, parameters, plans, logs,
files, message rates, flight state, and the vehicle's row of the physics.

What always holds: times are integer microseconds of simulated time. Streams and flight state are new after a power-on;
parameters, plans, logs and files outlive it. A frame leaves only through `outbox.Outbox`, which numbers and signs it.

Not here: anything that only one of the two autopilots does, and MAVLink services (`services`).
"""
