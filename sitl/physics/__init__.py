"""Physics of the simulated vehicles: point masses, PX4's position control, wind and GPS noise.

`point_masses.PointMasses` is the entry: the fleet steps it once per tick, for all vehicles together. An autopilot reads
and steers its own vehicle through `point_masses.Body`.

What always holds: states are arrays over all vehicles, in ENU metres about each vehicle's own start place; without a
`WeatherSpec` there is neither wind nor noise. Accelerations are limited as measured on real vehicles. Nothing has an
attitude: telemetry derives it from the acceleration.

Not here: modes, phases of a flight and set-points (`ardupilot`, `px4`), intruders (`launch.world`).
"""
