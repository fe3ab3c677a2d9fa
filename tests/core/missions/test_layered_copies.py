"""One vehicle's plans for others: on their own layers, from their own homes."""

import pytest

from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.missions import fences
from tui_gcs.core.missions import mission_builder as build
from tui_gcs.core.missions.draft import MissionDraft, VehicleDraft
from tui_gcs.core.missions.layered_copies import copied
from tui_gcs.core.missions.planned_vehicles import PlannedVehicle
from tui_gcs.core.missions.survey import GeneratorError
from tui_gcs.core.missions.timed_path import HomePosition
from tui_gcs.core.plans.model import LAND, RELATIVE, ROI_LOCATION, PlanItem, PlanKind

FRAME = LocalFrame(Origin(52.0, -0.6, 100.0))
CREW = {v: PlannedVehicle(HomePosition((20.0 * v, 0.0), 100.0), 20.0 + 7.0 * v) for v in (1, 2, 3)}
LOOK = PlanItem(ROI_LOCATION, RELATIVE, x=520_000_000, y=-6_000_000, z=5.0)
DOWN = PlanItem(LAND, RELATIVE)
OURS = VehicleDraft(
    mission=(
        build.take_off(FRAME, (20.0, 0.0), 27.0),
        build.waypoint(FRAME, (100.0, 50.0), 40.0),
        LOOK,
        build.return_home(),
        DOWN,
    ),
    fence=fences.circle((52.0, -0.6), 80.0),
    rally=(fences.rally_point((52.0, -0.6), 27.0),),
)
EVERYTHING = tuple(PlanKind)


def copy(*targets: int, kinds: tuple[PlanKind, ...] = EVERYTHING, ours: VehicleDraft = OURS) -> MissionDraft:
    return copied(MissionDraft({1: ours}), 1, targets, kinds, CREW, FRAME)


def test_mission_fence_and_rally_points_are_all_copied_and_no_two_are_at_one_height() -> None:
    draft = copy(2, 3)
    assert draft.of(1) == OURS
    for vehicle in (2, 3):
        mine = draft.of(vehicle)
        assert mine.fence == OURS.fence
        up, way, look, home, down = mine.mission
        assert (look, home, down) == OURS.mission[2:], "what is not flown at stays as it is"
        assert way.z == 40.0 + 7.0 * (vehicle - 1) and mine.rally[0].z == 27.0 + 7.0 * (vehicle - 1)
        assert (way.x, way.y) == (OURS.mission[1].x, OURS.mission[1].y)
        assert FRAME.to_enu(up.lat_deg, up.lon_deg) == pytest.approx((20.0 * vehicle, 0.0), abs=0.1)


def test_only_what_is_asked_for_and_what_there_is_replaces_theirs() -> None:
    before = MissionDraft({1: OURS.with_items(PlanKind.RALLY, ()), 2: VehicleDraft(rally=OURS.rally, mission=(LOOK,))})
    draft = copied(before, 1, (2,), EVERYTHING, CREW, FRAME)
    assert draft.of(2).rally == OURS.rally, "the source has none"
    draft = copied(before, 1, (2,), (PlanKind.FENCE,), CREW, FRAME)
    assert draft.of(2) == VehicleDraft(mission=(LOOK,), fence=OURS.fence, rally=OURS.rally)


def test_what_would_be_wrong_is_refused_whole() -> None:
    with pytest.raises(GeneratorError, match="vehicle 9 is neither"):
        copy(2, 9)
    with pytest.raises(GeneratorError, match="for which other vehicles"):
        copy(1)
    with pytest.raises(GeneratorError, match="nothing of that is planned"):
        copy(2, ours=VehicleDraft())
    low = VehicleDraft(rally=(fences.rally_point((52.0, -0.6), 10.0),))
    with pytest.raises(GeneratorError, match="vehicle 1 would fly its rally at -4 m"):
        copied(MissionDraft({3: low}), 3, (1,), EVERYTHING, CREW, FRAME)
