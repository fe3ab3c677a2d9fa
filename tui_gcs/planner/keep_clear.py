"""Keeps planned ways clear of where lost vehicles may be: which volumes count at which heights, and their outlines."""

from collections.abc import Iterable

import shapely

from tui_gcs.core.geometry.zones import Polygon, Role, Zone
from tui_gcs.core.protocol.common import KeepOut

QUARTER_SEGMENTS = 4
"""Straights in a quarter of a round end: the outline is up to 2 % of the radius inside the circle, so it is widened."""
WIDER = 1.02


def at_heights(keep_out: Iterable[KeepOut], layers_m: Iterable[float]) -> tuple[KeepOut, ...]:
    """Return the volumes that vehicles on these layers would meet."""
    layers = list(layers_m)
    return tuple(volume for volume in keep_out if any(volume.low_m < layer < volume.high_m for layer in layers))


def as_no_fly(keep_out: Iterable[KeepOut]) -> tuple[Zone, ...]:
    """Return the outlines of these volumes as no-fly zones."""
    return tuple(
        Zone(f"vehicle {volume.vehicle} may be here", Role.NO_FLY, Polygon(_outline(volume))) for volume in keep_out
    )


def _outline(volume: KeepOut) -> tuple[tuple[float, float], ...]:
    straight = shapely.LineString([volume.begin_m, volume.end_m])
    around = straight.buffer(WIDER * volume.radius_m, quad_segs=QUARTER_SEGMENTS)
    return tuple((x, y) for x, y in around.exterior.coords[:-1])
