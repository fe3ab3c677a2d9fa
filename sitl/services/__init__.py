"""MAVLink services of the simulated vehicles: parameters, logs, shell, payload, motor test.

An autopilot builds each server at power-on from its `Platform`; `handlers()` returns the messages it answers. Where the
autopilots differ, a module holds one class for each, side by side: the differences are what stations have to cope with.

What always holds: a server keeps its dialogue since the power-on; whatever outlives a reboot is in the platform. Long
answers are tasks at the measured rates, so nothing comes faster than from a real vehicle.

Of missions and MAVFTP sessions only what both do alike is here; the rest of them, and calibrations, the autopilots do
in their own ways (`ardupilot`, `px4`).
"""
