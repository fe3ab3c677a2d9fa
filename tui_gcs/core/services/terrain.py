"""TERRAIN_REQUEST is answered from the operator's terrain file, so that vehicles can fly heights above the ground.

A vehicle asks for a grid of 8 x 7 blocks of 4 x 4 heights; a bit of its mask stands for each block, counted to the east
first. TERRAIN_DATA carries one block (https://mavlink.io/en/services/terrain.html). Heights are whole metres above sea
level. A block with a height that is not known is not answered: the vehicle keeps asking, and reports that it has no
data; a guessed height could fly it into the ground.
"""

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np

from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.geometry.elevation import Elevation, Floats
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.services.context import ServiceContext

BLOCK = 4
"""Heights along one side of a block."""
BLOCKS_EAST, BLOCKS_NORTH = 8, 7
GAP_S, SLOW_GAP_S = 0.02, 0.1
"""The least time from one block (55 bytes on the wire) to the next for one vehicle, and on a slow link."""
MAX_AT_ONCE = 20
"""Blocks sent to all vehicles together before the rest of the station has its turn."""
MAX_LAT_DEG = 89.0
"""The local frame of a block is undefined at the poles."""


@dataclass
class _Request:
    """What one vehicle still waits for."""

    corner_deg: tuple[float, float]
    corner_e7: tuple[int, int]
    spacing_m: int
    blocks: list[int]
    """Bits that are still to be answered, in order."""
    next_s: float = -math.inf


class TerrainService:
    """Answers requests block by block, within the rate of the link."""

    def __init__(self, context: ServiceContext, elevation: Elevation | None) -> None:
        """Answer from `elevation`; without one nothing is answered, and the vehicles' own data count."""
        self._context = context
        self._elevation = elevation
        self._requests: dict[int, _Request] = {}
        self._told: set[int] = set()
        self.ignored: Counter[str] = Counter()
        if elevation is not None:
            context.fleet.on_message("TERRAIN_REQUEST", self._on_request)
            context.forget_with(self._forget)

    def tick(self) -> None:
        """Send the blocks that are due."""
        if self._elevation is None:
            return
        now = self._context.clock.now()
        due = [(v, request) for v, request in self._requests.items() if now >= request.next_s]
        for vehicle_id, request in due[:MAX_AT_ONCE]:
            # Those that were served go to the end: a large fleet is served in turn.
            del self._requests[vehicle_id]
            vehicle = self._context.fleet.vehicles.get(vehicle_id)
            if vehicle is None:
                continue
            self._send(vehicle, request, self._elevation)
            request.next_s = now + (SLOW_GAP_S if self._context.is_slow(vehicle.link) else GAP_S)
            if request.blocks:
                self._requests[vehicle_id] = request

    def _on_request(self, vehicle: Vehicle, fields: Fields) -> None:
        lat_deg, lon_deg, spacing_m = fields["lat"] / 1e7, fields["lon"] / 1e7, fields["grid_spacing"]
        mask = fields["mask"] & ((1 << BLOCKS_EAST * BLOCKS_NORTH) - 1)
        if not (abs(lat_deg) <= MAX_LAT_DEG and abs(lon_deg) <= 180 and spacing_m > 0):
            self.ignored["terrain request without a place"] += 1
            return
        known = self._requests.get(vehicle.id)
        blocks = [bit for bit in range(BLOCKS_EAST * BLOCKS_NORTH) if mask >> bit & 1]
        request = _Request((lat_deg, lon_deg), (fields["lat"], fields["lon"]), spacing_m, blocks)
        if known is not None:  # asking again is no way to a higher rate
            request.next_s = known.next_s
        if blocks:
            self._requests[vehicle.id] = request

    def _send(self, vehicle: Vehicle, request: _Request, elevation: Elevation) -> None:
        bit = request.blocks.pop(0)
        heights_m = block_amsl_m(elevation, request.corner_deg, request.spacing_m, bit)
        if np.isnan(heights_m).any():
            self.ignored["terrain request for unknown ground"] += 1
            return
        lat, lon = request.corner_e7
        data = np.rint(heights_m).astype(int).tolist()
        self._context.uplink.ask(
            vehicle.id, "TERRAIN_DATA", lat=lat, lon=lon, grid_spacing=request.spacing_m, gridbit=bit, data=data
        )
        if vehicle.id not in self._told:
            self._told.add(vehicle.id)
            text = f"it takes heights of the ground from {elevation.name}"
            self._context.events.report(EventClass.PROCESSING, f"vehicle {vehicle.id}", text)

    def _forget(self, vehicle: Vehicle) -> None:
        self._requests.pop(vehicle.id, None)
        self._told.discard(vehicle.id)


def block_amsl_m(elevation: Elevation, corner_deg: tuple[float, float], spacing_m: int, bit: int) -> Floats:
    """Return the 16 heights of a block in metres above sea level, to the east first; NaN where unknown.

    `corner_deg` is the south-western corner of the whole grid, `spacing_m` the distance of two heights.
    """
    north, east = divmod(bit, BLOCKS_EAST)
    x, y = np.meshgrid(np.arange(BLOCK, dtype=np.float64), np.arange(BLOCK, dtype=np.float64))
    frame = LocalFrame(Origin(*corner_deg, 0.0))
    east_m, north_m = (east * BLOCK + x.ravel()) * spacing_m, (north * BLOCK + y.ravel()) * spacing_m
    return elevation.amsl_m(*frame.to_geodetic(east_m, north_m))
