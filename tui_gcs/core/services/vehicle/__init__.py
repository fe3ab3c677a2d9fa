"""MAVLink services about the state of a vehicle: modes, health, events, failsafes, control, shell.

`ModeService` names flight modes, `HealthService` computes whether a vehicle could arm, `VehicleEvents` decodes PX4's
EVENTs with the files of `MetadataService`, `FailsafeService` reads what a vehicle does by itself, `ControlService`
refuses commands to this station, `ShellService` reaches the autopilot's command line. `Services` makes them; request
handlers, the fleet frame and preflight checks use them.

What always holds: nothing is requested from a vehicle until it is needed, so that a large fleet does not load its
links; text from a vehicle is cleaned. What differs between autopilots is in `core/firmware`.
"""
