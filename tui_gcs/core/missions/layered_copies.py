"""Copies of one vehicle's plans for others, each on its own altitude layer, so that copies of one path never meet."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.missions.draft import Items, MissionDraft
from tui_gcs.core.missions.planned_vehicles import PlannedVehicle
from tui_gcs.core.missions.survey import GeneratorError
from tui_gcs.core.plans.model import (
    LOITER_TIME,
    LOITER_TO_ALT,
    LOITER_TURNS,
    LOITER_UNLIMITED,
    RALLY_POINT,
    SPLINE,
    TAKE_OFF,
    VTOL_TAKE_OFF,
    WAYPOINT,
    PlanItem,
    PlanKind,
)

FLOWN = frozenset(
    {WAYPOINT, LOITER_UNLIMITED, LOITER_TURNS, LOITER_TIME, LOITER_TO_ALT, SPLINE, TAKE_OFF, VTOL_TAKE_OFF, RALLY_POINT}
)
"""Items whose height is flown at: it moves from layer to layer."""
AT_HOME_M = 2.0


def copied(
    draft: MissionDraft,
    source: int,
    targets: Sequence[int],
    kinds: Iterable[PlanKind],
    crew: Mapping[int, PlannedVehicle],
    frame: LocalFrame,
) -> MissionDraft:
    """Return `draft` with the source's plans of these kinds for the targets, too.

    Kinds of which the source has none are left alone. Heights move by the difference of the vehicles' layers. What
    climbs from the source's home climbs from each target's own home. Raises GeneratorError.
    """
    kinds = [kind for kind in kinds if draft.of(source).items(kind)]
    if not kinds:
        raise GeneratorError(f"nothing of that is planned for vehicle {source}")
    if unknown := [vehicle for vehicle in targets if vehicle not in crew]:
        raise GeneratorError(f"vehicle {unknown[0]} is neither in the scenario nor heard")
    if not [vehicle for vehicle in targets if vehicle != source]:
        raise GeneratorError("for which other vehicles?")
    for target in targets:
        for kind in kinds if target != source else ():
            items = _moved(draft.of(source).items(kind), crew[source], crew[target], frame)
            # A lower layer can push a low plan into the ground.
            if low := [item for item in items if item.command in FLOWN and item.z <= 0.0]:
                raise GeneratorError(
                    f"vehicle {target} would fly its {kind.word} at {low[0].z:g} m: its layer is "
                    f"{crew[source].layer_m - crew[target].layer_m:g} m below that of {source}; plan it higher"
                )
            draft = draft.with_items(target, kind, items)
    return draft


def _moved(items: Items, source: PlannedVehicle, target: PlannedVehicle, frame: LocalFrame) -> Items:
    """Return the items as the target flies them."""
    return tuple(_item(item, source, target, frame) for item in items)


def _item(item: PlanItem, source: PlannedVehicle, target: PlannedVehicle, frame: LocalFrame) -> PlanItem:
    if item.command not in FLOWN or not item.is_place:
        return item
    item = replace(item, z=item.z + target.layer_m - source.layer_m)
    # A take-off at the source's home becomes one at the target's own home.
    climbs = item.command in (TAKE_OFF, VTOL_TAKE_OFF) and (item.x or item.y)
    if climbs and math.dist(frame.to_enu(item.lat_deg, item.lon_deg), source.home.place_m) < AT_HOME_M:
        lat_deg, lon_deg = frame.to_geodetic(*target.home.place_m)
        item = replace(item, x=round(lat_deg * 1e7), y=round(lon_deg * 1e7))
    return item
