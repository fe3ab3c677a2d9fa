"""The altitude profile: the ground below the path, where a terrain file gives it."""

import numpy as np

from tui_gcs.core.geometry.elevation import Elevation, ElevationGrid
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.missions import mission_builder as build
from tui_gcs.core.missions.draft import MissionDraft, VehicleDraft
from tui_gcs.widgets.basics.glyphs import ASCII, UNICODE
from tui_gcs.widgets.missions.altitude_profile import AltitudeProfile
from tui_gcs.widgets.missions.mission_editor import MissionEditor

FRAME = LocalFrame(Origin(47.0, 8.0, 400.0))
STEP_DEG = 0.001


def editor(elevation: Elevation | None) -> MissionEditor:
    """Return an editor of vehicle 1, which flies 400 m to the north at 40 m and lands there."""
    made = MissionEditor()
    items = (build.take_off(FRAME, (0.0, 0.0), 40.0), build.waypoint(FRAME, (0.0, 400.0), 40.0))
    made.history.draft = MissionDraft({1: VehicleDraft(mission=items)})
    made.vehicle = 1
    made.forecast.draft, made.forecast.frame, made.forecast.elevation = made.draft, FRAME, elevation
    return made


def ground(hill_m: float) -> Elevation:
    """Return ground at 400 m that is `hill_m` higher from 300 m north of the origin on."""
    heights_m = np.full((21, 21), 400.0)
    heights_m[13:] += hill_m
    return Elevation("hill", [ElevationGrid(47.0 - 10 * STEP_DEG, 8.0 - 10 * STEP_DEG, STEP_DEG, STEP_DEG, heights_m)])


def rows(elevation: Elevation | None, ascii_only: bool = False) -> list[str]:
    profile = AltitudeProfile(editor(elevation), glyphs=ASCII if ascii_only else UNICODE)
    return ["".join(run[0] for run in line) for line in profile.lines(46, 4)]


def test_without_a_terrain_file_there_is_no_ground() -> None:
    assert not any("░" in row for row in rows(None))


def test_a_hill_is_filled_below_the_path() -> None:
    drawn = rows(ground(30.0))
    assert "░" not in drawn[0]
    assert drawn[3].endswith("░░░░░░░░░░") and "░" not in drawn[3][:20]
    assert ":::" in rows(ground(30.0), ascii_only=True)[3]


def test_a_hill_above_the_path_makes_the_picture_higher() -> None:
    assert rows(ground(30.0))[0].startswith("  40m")
    assert rows(ground(80.0))[0].startswith("  80m")
