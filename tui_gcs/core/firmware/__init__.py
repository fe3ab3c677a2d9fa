"""What differs between autopilots: orders, modes, plans, parameters, failsafes, calibration.

`FirmwareRegistry.of(vehicle)` is the entry; it returns the `Firmware` of ArduCopter, of PX4 multicopters, or one that
refuses every order. The flight controllers submit the actions it makes; set-points leave at once. The other modules are
tables that services and checks ask: plan dialects, health, failsafes in words, gains, airframes.

What always holds: no other package asks which autopilot a vehicle has in order to command it; a mode is confirmed by
the heartbeat, never by an ACK; a hold never relies on a pilot's sticks. Most rules were measured on real autopilots:
see docs/autopilots.md.

Not here: repetition and acknowledgement (`uplink`), the decision what a vehicle does (`flight`), transfers
(`services`).
"""
