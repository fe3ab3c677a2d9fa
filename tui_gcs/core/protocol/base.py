"""The base of everything that travels on the bus."""

import msgspec

Vec3 = tuple[float, float, float]
"""ENU metres, or metres per second."""
Vehicles = tuple[int, ...]
"""Ids of vehicles that a request names."""


class Message(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Base of all bus messages."""


class Request(Message, frozen=True, tag_field="request"):
    """Base of what a console, a worker or a script asks of the station."""


class VehicleRequest(Request, frozen=True):
    """Base of requests about named vehicles, each of which gets a result of its own."""

    vehicles: Vehicles


class StopRequest(Request, frozen=True):
    """A stop: of all vehicles, or only of these. It is carried out even if the asker has given up."""

    vehicles: Vehicles = ()
    given_ns: int = 0
    """When it was given, by this machine's monotonic clock: for each vehicle the newest counts. 0: when it arrives."""
