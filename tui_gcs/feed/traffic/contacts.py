"""Contacts: whatever was detected or received beside the fleet, and where it is as seen from the nearest vehicle."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.geometry.local_frame import LocalFrame, bearing_deg
from tui_gcs.core.protocol.common import FleetFrame, Track
from tui_gcs.core.protocol.setup import RemoteIdRow, TrafficRow

NAN = math.nan
HORIZON_S = 300.0
"""How far ahead a closest approach is looked for: no aircraft flies straight for longer."""
NEAR_M, NEAR_ABOVE_M = 1000.0, 150.0
"""A contact this near to one of our vehicles is marked; so is one whose height is not known."""
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Sighting:
    """Where a contact was when it was seen last; unknown numbers are NaN."""

    kind: Literal["track", "ADS-B", "Remote ID"]
    name: str
    place_m: tuple[float, float]
    """ENU metres."""
    velocity_m_s: tuple[float, float]
    up_m: float
    """Height above the scenario's ground (a track) or above mean sea level (`is_amsl`)."""
    is_amsl: bool
    age_s: float
    seen_by: tuple[int, ...]
    is_real: bool = True
    """False: a simulated aircraft."""
    note: str = ""
    """What else is known of it."""


@dataclass(frozen=True)
class Contact:
    """A sighting as seen from our vehicles."""

    seen: Sighting
    nearest: int = 0
    """The vehicle that is nearest on the ground plan; 0: none has a position."""
    distance_m: float = NAN
    bearing_deg: float = NAN
    """From that vehicle, from north."""
    above_m: float = NAN
    """Its height minus that of the vehicle."""
    approach_m: float = NAN
    """The smallest distance to any of our vehicles within `HORIZON_S`, if all fly straight on."""
    approach_s: float = NAN
    approach_of: int = 0
    """The vehicle that it comes nearest to."""

    @property
    def is_near(self) -> bool:
        """Whether it is near one of our vehicles, or will be; an unknown height counts as near."""
        if not self.seen.is_real:
            return False
        level_m = min((d for d in (self.distance_m, self.approach_m) if d == d), default=math.inf)
        return level_m < NEAR_M and not abs(self.above_m) > NEAR_ABOVE_M


def of_tracks(tracks: Iterable[Track], now_s: float) -> list[Sighting]:
    """Return the targets that our own sensors detected."""
    return [
        Sighting(
            "track",
            f"@{track.id}",
            track.position_m[:2],
            track.velocity_m_s[:2],
            track.position_m[2],
            False,
            max(0.0, now_s - track.seen_s),
            track.seen_by,
            note="" if track.confirmed else "not confirmed",
        )
        for track in tracks
    ]


def of_traffic(rows: Iterable[TrafficRow], frame: LocalFrame) -> list[Sighting]:
    """Return the aircraft that ADS-B receivers hear."""
    found = []
    for row in rows:
        east_m, north_m = frame.to_enu(row.lat_deg, row.lon_deg)
        heading = math.radians(row.heading_deg)
        velocity = (row.speed_m_s * math.sin(heading), row.speed_m_s * math.cos(heading))
        name = row.callsign or format(row.icao, "06X")
        climb = f", climbs {row.climb_m_s:+.1f} m/s" if row.climb_m_s == row.climb_m_s else ""
        note = f"ICAO {row.icao:06X}{climb}{'' if row.is_geometric else ', height by pressure'}"
        up_m = row.alt_m if row.is_geometric else NAN
        place = (float(east_m), float(north_m))
        found.append(
            Sighting("ADS-B", name, place, velocity, up_m, True, row.age_s, (row.heard_by,), not row.simulated, note)
        )
    return found


def of_remote_ids(rows: Iterable[RemoteIdRow], frame: LocalFrame) -> list[Sighting]:
    """Return other aircraft that broadcast Remote ID. Their height is above the ellipsoid: it is not compared."""
    found = []
    for row in rows:
        if row.vehicle:
            continue
        east_m, north_m = frame.to_enu(row.lat_deg, row.lon_deg)
        parts = [f"operator {row.operator_id}" if row.operator_id else "", row.description]
        if row.alt_m == row.alt_m:
            parts.append(f"{row.alt_m:.0f} m above the ellipsoid")
        note = ", ".join(part for part in parts if part)
        place = (float(east_m), float(north_m))
        heard = (row.heard_by,)
        name = row.uas_id or "no id"
        found.append(Sighting("Remote ID", name, place, (NAN, NAN), NAN, True, row.age_s, heard, note=note))
    return found


def contacts(sightings: Sequence[Sighting], frame: FleetFrame | None) -> list[Contact]:
    """Return all sightings as seen from the fleet, the most pressing first."""
    places = np.array([p[:2] for p in frame.position_m] if frame is not None else [], dtype=np.float64).reshape(-1, 2)
    known = np.isfinite(places).all(axis=1)
    if frame is None or not known.any():
        return [Contact(seen) for seen in sightings]
    speeds = np.array([v[:2] for v in frame.velocity_m_s], dtype=np.float64).reshape(-1, 2)
    rows = np.flatnonzero(known)
    found = [_seen_from(seen, frame, rows, places[rows], speeds[rows]) for seen in sightings]
    return sorted(found, key=lambda each: (not each.is_near, _last(each.approach_m), _last(each.distance_m)))


def _seen_from(seen: Sighting, frame: FleetFrame, rows: NDArray[np.intp], places: Floats, speeds: Floats) -> Contact:
    velocity = np.array(seen.velocity_m_s)
    here = np.array(seen.place_m) + np.where(np.isfinite(velocity), velocity, 0.0) * min(seen.age_s, HORIZON_S)
    if not np.isfinite(here).all():
        return Contact(seen)
    apart = here - places
    distances = np.hypot(apart[:, 0], apart[:, 1])
    at = int(distances.argmin())
    vehicle = int(rows[at])
    heights = frame.alt_amsl_m[vehicle] if seen.is_amsl else frame.position_m[vehicle][2]
    approach = _approach(apart, velocity - speeds) if np.isfinite(velocity).all() else None
    return Contact(
        seen,
        frame.ids[vehicle],
        float(distances[at]),
        bearing_deg((float(places[at, 0]), float(places[at, 1])), (float(here[0]), float(here[1]))),
        seen.up_m - heights,
        *((approach[0], approach[1], frame.ids[int(rows[approach[2]])]) if approach is not None else (NAN, NAN, 0)),
    )


def _approach(apart: Floats, closing: Floats) -> tuple[float, float, int] | None:
    """Return (distance, seconds, row) of the closest approach of points `apart` (n, 2) that move by `closing`."""
    closing = np.where(np.isfinite(closing), closing, 0.0)
    square = (closing * closing).sum(axis=1)
    in_s = np.clip(-(apart * closing).sum(axis=1) / np.maximum(square, 1e-9), 0.0, HORIZON_S)
    nearest = np.hypot(*(apart + closing * in_s[:, None]).T)
    at = int(nearest.argmin())
    return float(nearest[at]), float(in_s[at]), at


def _last(value: float) -> float:
    return value if value == value else math.inf
