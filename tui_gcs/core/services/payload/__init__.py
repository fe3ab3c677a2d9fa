"""MAVLink services of what a vehicle carries: cameras, gimbals, Remote ID, ADS-B.

`PayloadService` finds cameras and gimbals (`devices`) and controls them (`camera`, `gimbal`). `RemoteIdService` and
`OperatorIdService` are the two halves of Remote ID: what aircraft broadcast, and what this station contributes about
the operator. `TrafficService` keeps the aircraft that ADS-B receivers hear. `Services` makes them; the station's
request handlers and the fleet frame use them.

An order counts as carried out when its effect was reported, not when it was acknowledged; where a device reports no
effect, the result shows that. Tables are bounded, because any sender on the network can fill them. Nothing is fetched
from an address that a device names.
"""
