"""All that leaves for a vehicle: permission, addressing, retry classes, long transfers.

`Uplink` is the only exit: every frame to a vehicle is addressed to one named vehicle, recorded in the tlog, signed
where the vehicle has a key, and journalled. `CommandService` runs actions (`VehicleAction`) by their retry class until
telemetry confirms them; `AckMatcher` finds the copy that a COMMAND_ACK answers. `JobQueue` lets long transfers run, one
per vehicle. The firmware's command encoder, the services and the forwarder call the uplink; the station owns it.

What always holds: a stop (hold, return, land, disarm) is never vetoed and never waits for a start; a start is never
repeated later than 2 s after it was asked for; success is what telemetry shows, never an acknowledgement alone.

Not here: which messages an autopilot understands (`firmware`), and which courses are safe (`guard`).
"""
