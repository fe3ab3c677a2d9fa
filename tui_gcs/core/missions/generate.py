"""What is asked for when a plan is generated, for one vehicle or several, and the draft that comes of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.geometry.zones import Circle, Shape, outline_m, polygon_of
from tui_gcs.core.missions import fences
from tui_gcs.core.missions import mission_builder as build
from tui_gcs.core.missions.corridor import Corridor, paths
from tui_gcs.core.missions.crew import PlannedVehicle
from tui_gcs.core.missions.draft import Items, MissionDraft
from tui_gcs.core.missions.performance import Performance
from tui_gcs.core.missions.survey import GeneratorError, Place, Survey, lanes, split
from tui_gcs.core.plans.model import PlanKind

SURVEY, CORRIDOR, FENCE = "survey", "corridor", "fence"
WHAT = (SURVEY, CORRIDOR, FENCE)
OWN_ITEMS = "its way-points"
"""The way that is planned for the vehicle now, as the line of a corridor or the border of an area."""


@dataclass(frozen=True)
class GenerationRequest:
    """Everything that can be asked for; what a kind does not need is not looked at."""

    what: str = SURVEY
    over: str = OWN_ITEMS
    """Name of a zone, of the operating area, or `OWN_ITEMS`."""
    vehicles: tuple[int, ...] = ()
    height_m: float | None = None
    """Above home; None: each on its own layer."""
    spacing_m: float = 20.0
    angle_deg: float = 0.0
    turn_m: float = 0.0
    entry: int = 1
    """Which corner it begins at, from 1 to 4."""
    width_m: float = 40.0
    photos_m: float = 0.0
    """A photo each so many metres; 0: none."""
    inside: bool = True
    """Of a fence: to stay inside of it."""


def generated(
    draft: MissionDraft,
    wanted: GenerationRequest,
    shape: Shape,
    crew: Mapping[int, PlannedVehicle],
    frame: LocalFrame,
    performance: Performance,
) -> MissionDraft:
    """`draft` with what is wanted over `shape` instead of the missions there were.

    What is generated flies at the assumed speed; a fence is added to those there are. For `OWN_ITEMS` the shape is the
    polygon of its places. Raises GeneratorError.
    """
    if not wanted.vehicles:
        raise GeneratorError("for which vehicles?")
    if unknown := [vehicle for vehicle in wanted.vehicles if vehicle not in crew]:
        raise GeneratorError(f"vehicle {unknown[0]} is neither in the scenario nor heard")
    if wanted.what == FENCE:
        return _fenced(draft, wanted, shape, frame)
    members = [crew[vehicle] for vehicle in wanted.vehicles]
    heights = [member.layer_m if wanted.height_m is None else wanted.height_m for member in members]
    if min(heights) <= 0:
        raise GeneratorError("the height must be above the ground")
    ways = _surveys(wanted, outline_m(shape), members, heights, frame, performance)
    if wanted.what == CORRIDOR:
        line = Corridor(_line(wanted, shape), wanted.width_m, wanted.spacing_m, backwards=wanted.entry % 2 == 0)
        parts = paths(line, len(members))
        ways = [build.path_items(frame, part, height) for part, height in zip(parts, heights, strict=True)]
    for vehicle, items, height_m in zip(wanted.vehicles, ways, heights, strict=True):
        mission = build.whole(frame, crew[vehicle].home.place_m, items, height_m, performance.speed_m_s)
        draft = draft.with_items(vehicle, PlanKind.MISSION, mission)
    return draft


def _surveys(
    wanted: GenerationRequest,
    shape_m: Sequence[Place],
    members: Sequence[PlannedVehicle],
    heights: Sequence[float],
    frame: LocalFrame,
    performance: Performance,
) -> list[Items]:
    if wanted.what != SURVEY:
        return []
    asked = Survey(tuple(shape_m), wanted.spacing_m, wanted.angle_deg, wanted.turn_m, wanted.entry - 1)
    turn_s = performance.speed_m_s / performance.accel_m_s2
    shares = split(lanes(asked), [member.home.place_m for member in members], performance.speed_m_s, turn_s)
    return [
        build.lane_items(frame, share, height, wanted.photos_m) for share, height in zip(shares, heights, strict=True)
    ]


def _line(wanted: GenerationRequest, shape: Shape) -> tuple[Place, ...]:
    """Its way-points from the first to the last, or once along the border of a zone."""
    border = tuple(outline_m(shape))
    return border if wanted.over == OWN_ITEMS else (*border, border[0])


def _fenced(draft: MissionDraft, wanted: GenerationRequest, shape: Shape, frame: LocalFrame) -> MissionDraft:
    if isinstance(shape, Circle):
        border = fences.circle(frame.to_geodetic(*shape.centre_m), shape.radius_m, inside=wanted.inside)
    elif len(outline_m(shape)) < fences.MIN_CORNERS or not polygon_of(shape).is_valid:
        raise GeneratorError("the border crosses itself or has less than three corners")
    else:
        border = fences.polygon([frame.to_geodetic(*place) for place in outline_m(shape)], inside=wanted.inside)
    for vehicle in wanted.vehicles:
        draft = draft.with_items(vehicle, PlanKind.FENCE, (*draft.of(vehicle).fence, *border))
    return draft
