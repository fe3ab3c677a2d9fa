"""Every format of plans, written from the missions screen and opened there again."""

from pathlib import Path

import pytest

from tui_gcs.core.formats.file_types import FORMATS, Family
from tui_gcs.core.missions import fences
from tui_gcs.core.missions import mission_builder as build
from tui_gcs.core.missions.draft import MissionDraft, VehicleDraft
from tui_gcs.core.missions.draft_file import DraftFileError
from tui_gcs.core.plans.model import Plan, PlanKind
from tui_gcs.widgets.missions.mission_editor import MissionEditor
from tui_gcs.widgets.missions.mission_files import MissionFile

MISSION, FENCE, RALLY = PlanKind
ONE_KIND = {"wpl": MISSION, "json": MISSION, "fence": FENCE, "rally": RALLY}
"""Formats that hold one kind of plan, and the one that is tried; KML and its like have ways and areas."""
DRAWN = {"kml": (MISSION, FENCE), "kmz": (MISSION, FENCE), "geojson": (MISSION, FENCE)}
ENDINGS = [
    (each.name, ending) for each in FORMATS if each.family in (Family.PLAN, Family.DRAWING) for ending in each.endings
]


def planned(editor: MissionEditor) -> VehicleDraft:
    """A way, a fence about it and a rally point."""
    frame = editor.frame
    corners = [frame.to_geodetic(x, y) for x, y in ((-200.0, -200.0), (200.0, -200.0), (200.0, 200.0), (-200.0, 200.0))]
    points = (build.waypoint(frame, (50.0, 50.0), 30.0), build.waypoint(frame, (50.0, -50.0), 30.0))
    return VehicleDraft(
        build.whole(frame, (0.0, 0.0), points, 30.0),
        fences.polygon(corners),
        (fences.rally_point(frame.to_geodetic(20.0, 0.0), 25.0),),
    )


@pytest.mark.parametrize(("name", "ending"), ENDINGS)
def test_what_is_written_is_there_when_it_is_opened(name: str, ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"one{ending}"
    editor, other = MissionEditor(), MissionEditor()
    editor.vehicle = other.vehicle = 1
    plans = planned(editor)
    editor.take("planned", MissionDraft({1: plans}))
    editor.kind = ONE_KIND.get(name, MISSION)
    MissionFile(editor, None).write(path)
    MissionFile(other, None).open(path)
    held = other.history.draft.of(1)
    kinds = [ONE_KIND[name]] if name in ONE_KIND else DRAWN.get(name, tuple(PlanKind))
    for kind in kinds:
        assert places(held.plan(kind)) == places(plans.plan(kind)), kind.word


def places(plan: Plan) -> list[tuple[int, int]]:
    """Where its items are, to the 1e-7 degrees of the wire."""
    return [(item.x, item.y) for item in plan.items if item.is_place and (item.x or item.y)]


def test_a_scan_whose_way_is_not_in_the_file_is_refused_with_what_to_do(tmp_path: Path) -> None:
    path = tmp_path / "scan.plan"
    path.write_text(
        '{"fileType": "Plan", "version": 1, "mission": {"version": 2, "items": [{"type": "ComplexItem",'
        ' "complexItemType": "StructureScan", "polygon": [[47.0, 8.0], [47.0, 8.001], [47.001, 8.0]]}]}}'
    )
    editor = MissionEditor()
    with pytest.raises(DraftFileError, match=r"StructureScan.*way-points in QGroundControl"):
        MissionFile(editor, None).open(path)
    assert editor.history.draft.is_empty
