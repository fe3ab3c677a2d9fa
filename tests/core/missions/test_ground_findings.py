"""A scenario and missions over real ground: hills below layers and ways, an origin at a wrong height."""

from pathlib import Path

import msgspec
import numpy as np
import pytest

from tui_gcs.core.geometry.elevation import Elevation, ElevationGrid
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.missions import mission_builder as build
from tui_gcs.core.missions.draft import VehicleDraft
from tui_gcs.core.missions.ground_findings import ground_findings
from tui_gcs.core.missions.mission_findings import MissionSite, findings
from tui_gcs.core.missions.performance import Performance
from tui_gcs.core.missions.timed_path import HomePosition, timed_path
from tui_gcs.core.scenario.load import parse
from tui_gcs.core.scenario.model import Scenario

SCENARIO = Path(__file__).parents[3] / "tui_gcs/scenarios/swarm-challenge.toml"
STEP_DEG = 0.0005
FRAME = LocalFrame(Origin(47.0, 8.0, 400.0))


def ground(origin: Origin, hill_m: float = 0.0, base_m: float | None = None, side: int = 81) -> Elevation:
    """Level ground at the origin's height (or `base_m`) with a hill of `hill_m` 111 m north of the origin."""
    heights_m = np.full((side, side), origin.ground_amsl_m if base_m is None else base_m)
    heights_m[side // 2 + 2, side // 2] += hill_m
    half_deg = side // 2 * STEP_DEG
    grid = ElevationGrid(origin.lat_deg - half_deg, origin.lon_deg - half_deg, STEP_DEG, STEP_DEG, heights_m)
    return Elevation("field.asc", [grid])


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return parse(SCENARIO.read_text(), SCENARIO.name)


def texts(scenario: Scenario, elevation: Elevation) -> list[str]:
    return [f"{finding.level.name} {finding.text}" for _, finding in ground_findings(scenario, elevation)]


def test_level_ground_is_as_it_should_be(scenario: Scenario) -> None:
    lowest_m = min(place.layer_m for place in scenario.places)
    expected = f"NOTE ok: the lowest layer passes {lowest_m:.0f} m or more above the ground"
    assert texts(scenario, ground(scenario.origin)) == [expected] * len(scenario.rounds)


def test_a_hill_below_the_lowest_layer(scenario: Scenario) -> None:
    lowest_m = min(place.layer_m for place in scenario.places)
    first = texts(scenario, ground(scenario.origin, lowest_m + 5.0))[0]
    assert first.startswith(f"CAUTION the layer of {lowest_m:g} m is ")
    assert "m below the ground at " in first or "m above the ground at " in first


def test_an_origin_at_another_height_than_the_ground(scenario: Scenario) -> None:
    found = texts(scenario, ground(scenario.origin, base_m=scenario.origin.ground_amsl_m + 30.0))
    assert found[0].startswith("CAUTION ground_amsl_m of the origin is ")
    # Layers are flown above home: ground that is higher everywhere is no hill.
    assert all(text.startswith("NOTE ok") for text in found[1:])


def test_ground_that_is_not_in_the_file(scenario: Scenario) -> None:
    found = texts(scenario, ground(scenario.origin, side=5))
    assert any("the ground is unknown in" in text for text in found)
    elsewhere = msgspec.structs.replace(scenario.origin, lat_deg=-30.0)
    assert [text for text in texts(scenario, ground(elsewhere)) if "100%" in text]


def mission_texts(elevation: Elevation, height_m: float) -> list[str]:
    """Return the findings of a mission 300 m to the north and back at `height_m`."""
    north_m = (0.0, 300.0)
    items = (
        build.take_off(FRAME, (0.0, 0.0), height_m),
        build.waypoint(FRAME, north_m, height_m),
        build.return_home(),
    )
    site = MissionSite(FRAME, elevation=elevation)
    path = timed_path(items, HomePosition(), FRAME, Performance())
    return [str(each) for each in findings(VehicleDraft(mission=items), path, site)]


def test_the_way_of_a_mission_over_a_hill() -> None:
    assert mission_texts(ground(FRAME.origin, 30.0), 60.0) == []
    low = mission_texts(ground(FRAME.origin, 30.0), 28.0)
    (text,) = low
    assert text.startswith("mission 2: the way to it passes 1 m above the ground, 105 m from home")
    assert text.endswith("(and 1 more): 5 m are the least here")
    assert "passes 5 m below the ground" in mission_texts(ground(FRAME.origin, 30.0), 22.0)[0]


def test_the_way_of_a_mission_over_unknown_ground() -> None:
    found = mission_texts(ground(FRAME.origin, side=5), 60.0)
    assert len(found) == 1 and "the ground is unknown on 62% of the way" in found[0]
