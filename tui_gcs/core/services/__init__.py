"""MAVLink microservices of the station: each package or module speaks one protocol with vehicles.

`Services` (all_services.py) creates one of each for a station and ticks them; request handlers, preflight checks and
the fleet frame call them. Every service gets the same frozen `ServiceContext` of parts: it takes messages from the
fleet and sends through the uplink, where what changes a vehicle is checked and journalled. Long exchanges are jobs of
the uplink's queue, one at a time for each vehicle.

Packages: `files`, `parameters`, `plans`, `vehicle` (state), `setup`, `payload`; `timesync` measures links, `terrain`
sends vehicles ground heights. What differs between autopilots is not here, but in `core/firmware`; orders that
fly a vehicle are in `core/uplink` and `core/flight`.
"""
