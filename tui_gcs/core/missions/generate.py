"""Generating plans: a survey, a corridor scan or a fence, for one vehicle or several, into a draft."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.geometry.zones import Circle, Shape, outline_m, polygon_of
from tui_gcs.core.missions import fences
from tui_gcs.core.missions import mission_builder as build
from tui_gcs.core.missions.corridor import Corridor, paths
from tui_gcs.core.missions.draft import Items, MissionDraft
from tui_gcs.core.missions.performance import Performance
from tui_gcs.core.missions.planned_vehicles import PlannedVehicle
from tui_gcs.core.missions.survey import GeneratorError, Place, Survey, lanes, split
from tui_gcs.core.plans.model import PlanKind

SURVEY, CORRIDOR, FENCE = "survey", "corridor", "fence"
WHAT = (SURVEY, CORRIDOR, FENCE)
OWN_ITEMS = "its way-points"
"""The path that is planned for the vehicle now, as the line of a corridor or the border of an area."""


@dataclass(frozen=True)
class GenerationRequest:
    """A request for a generated plan. What its kind does not need is ignored."""

    what: str = SURVEY
    over: str = OWN_ITEMS
    """The name of a zone, of the operating area, or `OWN_ITEMS`."""
    vehicles: tuple[int, ...] = ()
    height_m: float | None = None
    """The height above home; None: each vehicle on its own layer."""
    spacing_m: float = 20.0
    angle_deg: float = 0.0
    turn_m: float = 0.0
    entry: int = 1
    """The corner at which it begins, from 1 to 4."""
    width_m: float = 40.0
    photos_m: float = 0.0
    """The distance between photos in metres; 0: no photos."""
    inside: bool = True
    """Whether a fence is to be stayed inside of."""


def generated(
    draft: MissionDraft,
    request: GenerationRequest,
    shape: Shape,
    crew: Mapping[int, PlannedVehicle],
    frame: LocalFrame,
    performance: Performance,
) -> MissionDraft:
    """Return `draft` with the generated plans over `shape` in place of the former missions.

    A generated mission flies at the assumed speed; a fence is added to the existing ones. For `OWN_ITEMS` the shape is
    the polygon of the mission's places. Raises GeneratorError.
    """
    if not request.vehicles:
        raise GeneratorError("for which vehicles?")
    if unknown := [vehicle for vehicle in request.vehicles if vehicle not in crew]:
        raise GeneratorError(f"vehicle {unknown[0]} is neither in the scenario nor heard")
    if request.what == FENCE:
        return _fenced(draft, request, shape, frame)
    members = [crew[vehicle] for vehicle in request.vehicles]
    heights = [member.layer_m if request.height_m is None else request.height_m for member in members]
    if min(heights) <= 0:
        raise GeneratorError("the height must be above the ground")
    ways = _surveys(request, outline_m(shape), members, heights, frame, performance)
    if request.what == CORRIDOR:
        line = Corridor(_line(request, shape), request.width_m, request.spacing_m, backwards=request.entry % 2 == 0)
        parts = paths(line, len(members))
        ways = [build.path_items(frame, part, height) for part, height in zip(parts, heights, strict=True)]
    for vehicle, items, height_m in zip(request.vehicles, ways, heights, strict=True):
        mission = build.whole(frame, crew[vehicle].home.place_m, items, height_m, performance.speed_m_s)
        draft = draft.with_items(vehicle, PlanKind.MISSION, mission)
    return draft


def _surveys(
    request: GenerationRequest,
    shape_m: Sequence[Place],
    members: Sequence[PlannedVehicle],
    heights: Sequence[float],
    frame: LocalFrame,
    performance: Performance,
) -> list[Items]:
    if request.what != SURVEY:
        return []
    survey = Survey(tuple(shape_m), request.spacing_m, request.angle_deg, request.turn_m, request.entry - 1)
    turn_s = performance.speed_m_s / performance.accel_m_s2
    shares = split(lanes(survey), [member.home.place_m for member in members], performance.speed_m_s, turn_s)
    return [
        build.lane_items(frame, share, height, request.photos_m) for share, height in zip(shares, heights, strict=True)
    ]


def _line(request: GenerationRequest, shape: Shape) -> tuple[Place, ...]:
    """Return the line of a corridor: the way-points in order, or once along the border of a zone."""
    border = tuple(outline_m(shape))
    return border if request.over == OWN_ITEMS else (*border, border[0])


def _fenced(draft: MissionDraft, request: GenerationRequest, shape: Shape, frame: LocalFrame) -> MissionDraft:
    if isinstance(shape, Circle):
        border = fences.circle(frame.to_geodetic(*shape.centre_m), shape.radius_m, inside=request.inside)
    elif len(outline_m(shape)) < fences.MIN_CORNERS or not polygon_of(shape).is_valid:
        raise GeneratorError("the border crosses itself or has less than three corners")
    else:
        border = fences.polygon([frame.to_geodetic(*place) for place in outline_m(shape)], inside=request.inside)
    for vehicle in request.vehicles:
        draft = draft.with_items(vehicle, PlanKind.FENCE, (*draft.of(vehicle).fence, *border))
    return draft
