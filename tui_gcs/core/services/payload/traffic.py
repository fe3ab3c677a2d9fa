"""Aircraft that vehicles receive by ADS-B (ADSB_VEHICLE): a table of the newest, for the map.

Any sender can forge such messages, so at most `MAX_TRACKS` are kept; the oldest are dropped first (docs/threats.md
B.6-106).
"""

from collections import Counter, OrderedDict
from dataclasses import dataclass

from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import NAN, Vehicle
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.services.context import ActionDone, ServiceContext

MAX_TRACKS = 256
FORGOTTEN_S = 60.0
"""An aircraft that was not received for so long is somewhere else."""
ADSB_VEHICLE = 246
HZ = 5.0
"""The requested rate: ArduPilot sends one aircraft in each message."""
HAS_PLACE, HAS_ALTITUDE, HAS_HEADING, HAS_VELOCITY, HAS_CALLSIGN, HAS_SQUAWK = 1, 2, 4, 8, 16, 32
SIMULATED, HAS_CLIMB = 64, 128
"""Values of ADSB_FLAGS."""


@dataclass(frozen=True)
class AdsbTrack:
    """One aircraft as it was last received."""

    icao: int
    callsign: str
    """The callsign, cleaned; empty if unknown."""
    position_m: Vec3
    """East and north in the scenario's frame; the third is `alt_m`."""
    lat_deg: float
    lon_deg: float
    alt_m: float
    """As reported: above mean sea level if `is_geometric`, else by pressure. NaN if unknown, as the values below."""
    is_geometric: bool
    heading_deg: float
    speed_m_s: float
    climb_m_s: float
    squawk: int
    """0 if unknown."""
    kind: int
    """ADSB_EMITTER_TYPE."""
    simulated: bool
    heard_by: int
    """The vehicle that reported it last."""
    seen_s: float
    """Station time at which any vehicle last received it."""


class TrafficService:
    """Keeps the aircraft that vehicles and their ADS-B receivers report."""

    def __init__(self, context: ServiceContext) -> None:
        """Take ADSB_VEHICLE messages. Vehicles are asked for them only by `listen`."""
        self._context = context
        self._tracks: OrderedDict[int, AdsbTrack] = OrderedDict()
        self.dropped: Counter[str] = Counter()
        context.fleet.on_message_of_any_component("ADSB_VEHICLE", self._on_adsb)

    def tracks(self) -> tuple[AdsbTrack, ...]:
        """All aircraft that were received within the last minute, newest last."""
        oldest_s = self._context.clock.now() - FORGOTTEN_S
        return tuple(track for track in self._tracks.values() if track.seen_s >= oldest_s)

    def listen(self, vehicle_id: int, on_done: ActionDone | None = None) -> None:
        """Make a vehicle send what its receiver receives: ArduPilot does not by itself, and needs ADSB_TYPE."""
        self._context.set_interval(vehicle_id, "hear traffic", ADSB_VEHICLE, 1e6 / HZ, on_done)

    def _on_adsb(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        track = self._track(vehicle, fields)
        if track is None:
            self.dropped["traffic without a place"] += 1
            return
        known = self._tracks.pop(track.icao, None)
        # Two vehicles receive the same aircraft: the newest position counts, not the last message.
        if known is not None and known.seen_s > track.seen_s:
            track = known
            self.dropped["traffic that another vehicle heard later"] += 1
        self._tracks[track.icao] = track
        while len(self._tracks) > MAX_TRACKS:
            self._tracks.popitem(last=False)
            self.dropped["traffic table full"] += 1

    def _track(self, vehicle: Vehicle, fields: Fields) -> AdsbTrack | None:
        flags = fields["flags"]
        lat_deg, lon_deg = fields["lat"] / 1e7, fields["lon"] / 1e7
        if not flags & HAS_PLACE or abs(lat_deg) > 90 or abs(lon_deg) > 180 or (lat_deg == 0 and lon_deg == 0):
            return None
        east_m, north_m = self._context.fleet.frame.to_enu(lat_deg, lon_deg)
        alt_m = fields["altitude"] / 1e3 if flags & HAS_ALTITUDE else NAN
        heading_deg = fields["heading"] / 100 if flags & HAS_HEADING and fields["heading"] < 36000 else NAN
        return AdsbTrack(
            icao=fields["ICAO_address"],
            callsign=fields["callsign"].strip() if flags & HAS_CALLSIGN else "",
            position_m=(float(east_m), float(north_m), alt_m),
            lat_deg=lat_deg,
            lon_deg=lon_deg,
            alt_m=alt_m if -1000 <= alt_m <= 40_000 else NAN,
            is_geometric=fields["altitude_type"] == 1,
            heading_deg=heading_deg,
            speed_m_s=fields["hor_velocity"] / 100 if flags & HAS_VELOCITY else NAN,
            climb_m_s=fields["ver_velocity"] / 100 if flags & HAS_CLIMB else NAN,
            squawk=fields["squawk"] if flags & HAS_SQUAWK else 0,
            kind=fields["emitter_type"],
            simulated=bool(flags & SIMULATED),
            heard_by=vehicle.id,
            seen_s=self._context.clock.now() - fields["tslc"],
        )
