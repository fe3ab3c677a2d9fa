"""Paths of missions with times, conflicts between them, surveys, and findings."""

import math
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.geometry.zones import Circle, Rectangle, Role, Zone
from tui_gcs.core.missions import corridor, fences, survey
from tui_gcs.core.missions import mission_builder as build
from tui_gcs.core.missions.draft import MissionDraft, VehicleDraft
from tui_gcs.core.missions.forecast import Forecast
from tui_gcs.core.missions.mission_conflicts import conflicts
from tui_gcs.core.missions.mission_findings import FindingLevel, MissionSite, battery_left_pct, findings
from tui_gcs.core.missions.patrol_crossings import patrols
from tui_gcs.core.missions.performance import Performance
from tui_gcs.core.missions.timed_path import HomePosition, TimedPath, timed_path
from tui_gcs.core.plans.model import (
    AMSL,
    JUMP,
    LAND,
    LOITER_TURNS,
    LOITER_UNLIMITED,
    MISSION_FRAME,
    PlanItem,
    PlanKind,
)
from tui_gcs.core.protocol.common import Annotation
from tui_gcs.core.scenario.model import OperatingArea, Round

FRAME = LocalFrame(Origin(52.07, -0.628, 110.0))
CRAFT = Performance()
AREA = OperatingArea(Rectangle((0.0, 0.0), 600.0, 600.0), 10.0, 60.0)
ROUND = Round("one", 600.0, AREA, (Zone("church", Role.NO_FLY, Circle((100.0, 100.0), 30.0)),))
SITE = MissionSite(FRAME, ROUND)


def to(east_m: float, north_m: float, height_m: float = 30.0) -> PlanItem:
    return build.waypoint(FRAME, (east_m, north_m), height_m)


def way(*items: PlanItem, home_m: tuple[float, float] = (0.0, 0.0)) -> TimedPath:
    return timed_path(items, HomePosition(home_m, 110.0), FRAME, CRAFT)


class Leg(NamedTuple):
    item: int
    from_m: tuple[float, float, float]
    to_m: tuple[float, float, float]
    begin_s: float
    end_s: float
    hold_s: float


def legs(path: TimedPath) -> tuple[Leg, ...]:
    ends = [(x, y, z) for x, y, z in path.corners_m.tolist()]
    rows = zip(path.leg_items.tolist(), pairwise(ends), path.leg_times_s.tolist(), strict=True)
    return tuple(Leg(item, *places, *times) for item, places, times in rows)


def up(height_m: float) -> PlanItem:
    return build.take_off(FRAME, (0.0, 0.0), height_m)


UP, BACK = up(30.0), build.return_home()


# ---------------------------------------------------------------- times


def test_a_leg_takes_what_speed_and_acceleration_say() -> None:
    flown = way(UP, to(400, 0))
    climb, leg = legs(flown)
    assert climb.end_s == pytest.approx(30 / 2.5 + 2.5 / 2.5, abs=0.01)  # v = 2.5 m/s, and half of v/a at each end
    assert leg.end_s - leg.begin_s == pytest.approx(400 / 8 + 8 / 2.5, abs=0.01)
    assert flown.length_m == pytest.approx(430, abs=0.01)


def test_straight_rows_are_flown_through_and_right_angles_are_stops() -> None:
    straight = way(UP, to(100, 0), to(200, 0), to(400, 0))
    corner = way(UP, to(200, 0), to(200, 200))
    assert straight.duration_s == pytest.approx(way(UP, to(400, 0)).duration_s, abs=0.01)
    assert corner.duration_s == pytest.approx(straight.duration_s + 8 / 2.5, abs=0.01)


def test_shares_of_the_items_add_up_to_the_whole() -> None:
    flown = way(UP, replace(to(200, 0), params=(20.0, 0.0, 0.0, 0.0)), to(200, 200), BACK)
    assert sum(seconds for _, seconds in flown.shares.values()) == pytest.approx(flown.duration_s)
    assert sum(metres for metres, _ in flown.shares.values()) == pytest.approx(flown.length_m)
    assert flown.shares[1][0] == pytest.approx(200, abs=0.1)


def test_a_climb_is_no_faster_than_the_vehicle_climbs() -> None:
    assert legs(way(UP, to(10, 0, 80)))[1].end_s - way(UP).duration_s >= 50 / CRAFT.climb_m_s
    assert legs(way(UP, to(10, 0, 5)))[1].end_s - way(UP).duration_s >= 25 / CRAFT.descent_m_s


def test_holds_delays_speeds_and_landing_take_their_time() -> None:
    plain = way(UP, to(200, 0), to(400, 0)).duration_s
    held = way(UP, replace(to(200, 0), params=(20.0, 0.0, 0.0, 0.0)), to(400, 0))
    assert held.duration_s == pytest.approx(plain + 20 + 8 / 2.5, abs=0.1)  # and a stop
    assert held.arrivals_s[2] == held.duration_s
    delayed = way(UP, to(200, 0), PlanItem(93, MISSION_FRAME, (20.0, 0.0, 0.0, 0.0)), to(400, 0))
    assert delayed.duration_s == pytest.approx(held.duration_s)
    slow = way(UP, PlanItem(178, MISSION_FRAME, (1.0, 4.0, -1.0, 0.0)), to(400, 0))
    assert legs(slow)[-1].end_s - legs(slow)[-1].begin_s == pytest.approx(400 / 4 + 4 / 2.5, abs=0.01)
    down = way(UP, PlanItem(LAND))
    assert down.lands
    assert down.duration_s - way(UP).duration_s > 20 / 1.5 + 10 / 0.5


def test_a_return_climbs_goes_home_and_lands() -> None:
    flown = way(up(10.0), to(100, 0, 10), BACK, to(500, 0))
    assert flown.lands
    assert legs(flown)[-1].to_m == (0.0, 0.0, 0.0)
    assert flown.points_m[:, 2].max() == pytest.approx(CRAFT.return_height_m)
    assert 3 not in flown.arrivals_s, "nothing comes after a return"


def test_heights_above_the_sea_and_circles() -> None:
    flown = way(UP, PlanItem(LOITER_TURNS, AMSL, (2.0, 0.0, 50.0, 0.0), *_degrees(100, 0), 150.0))
    assert flown.points_m[-1][2] == pytest.approx(40.0)
    radii = np.hypot(flown.points_m[-60:, 0] - 100, flown.points_m[-60:, 1])
    assert radii.max() == pytest.approx(50, abs=0.1)
    assert flown.length_m == pytest.approx(30 + math.hypot(50, 10) + 2 * math.tau * 50, rel=0.02)


def test_a_mission_without_end_is_marked() -> None:
    assert way(UP, PlanItem(LOITER_UNLIMITED, 3, x=1, y=1, z=30.0)).endless
    assert way(UP, to(10, 0), PlanItem(JUMP, MISSION_FRAME, (1.0, -1.0, 0.0, 0.0))).endless


def test_nonsense_is_no_way() -> None:
    assert legs(way()) == ()
    nowhere = way(replace(to(1, 1), z=math.nan))
    assert nowhere.is_empty and legs(nowhere) == ()
    assert nowhere.arrivals_s == {} and nowhere.shares == {}


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.floats(-300, 300), st.floats(-300, 300), st.floats(1, 90)), min_size=1, max_size=12))
def test_no_vehicle_is_predicted_faster_than_it_flies(places: list[tuple[float, float, float]]) -> None:
    flown = way(UP, *(to(*place) for place in places), BACK)
    assert (np.diff(flown.t_s) >= 0).all()
    moving = np.diff(flown.t_s) > 1e-6
    steps = np.diff(flown.points_m, axis=0)[moving] / np.diff(flown.t_s)[moving, None]
    assert np.hypot(steps[:, 0], steps[:, 1]).max(initial=0) <= CRAFT.speed_m_s + 1e-6
    assert steps[:, 2].max(initial=0) <= CRAFT.climb_m_s + 1e-6
    assert -steps[:, 2].min(initial=0) <= CRAFT.descent_m_s + 1e-6


# ---------------------------------------------------------------- conflicts


def test_two_that_cross_at_the_same_time_collide() -> None:
    ways = {1: way(UP, to(200, 200), BACK), 2: way(UP, to(0, 200), BACK, home_m=(200.0, 0.0))}
    (found,) = conflicts(ways, 10.0, 5.0)
    assert found.together
    assert found.place_m == pytest.approx((100, 100), abs=3)


def test_crossing_paths_are_distinguished_from_collisions() -> None:
    late = replace(to(200, 0), params=(60.0, 0.0, 0.0, 0.0))
    ways = {1: way(UP, to(200, 200)), 2: way(UP, late, to(0, 200), home_m=(200.0, 0.0))}
    (found,) = conflicts(ways, 10.0, 5.0)
    assert not found.together
    assert found.second_s > found.first_s + 30


def test_other_heights_and_other_places_are_no_conflict() -> None:
    above = {1: way(UP, to(200, 200)), 2: way(up(40.0), to(0, 200, 40), home_m=(200.0, 0.0))}
    beside = {1: way(UP, to(200, 0)), 2: way(UP, to(200, 20), home_m=(0.0, 20.0))}
    assert conflicts(above, 10.0, 5.0) == []
    assert conflicts(beside, 10.0, 5.0) == []


def test_a_landed_vehicle_is_no_conflict() -> None:
    ways = {1: way(UP, PlanItem(LAND)), 2: way(UP, to(-200, 0), to(-200, 100), home_m=(50.0, 0.0))}
    (found,) = conflicts(ways, 10.0, 5.0)  # the way of 2 leads over the place that 1 climbs from
    assert found.together == (found.first_s < ways[1].duration_s and abs(found.first_s - found.second_s) < 1)
    assert conflicts({1: ways[1]}, 10.0, 5.0) == []


def test_a_mission_that_crosses_a_planners_tour_is_reported() -> None:
    look = Forecast()
    look.frame, look.performance = FRAME, CRAFT
    look.draft = MissionDraft({1: VehicleDraft(mission=(UP, to(200, 200), BACK))})
    loop = Annotation("polyline", ((100.0, 60.0), (140.0, 60.0), (140.0, 160.0), (100.0, 160.0), (100.0, 60.0)))
    open_line = Annotation("polyline", loop.points_m[:-1])
    look.patrols = patrols({1: ("home", 30.0), 2: ("home", 30.0), 3: ("home", 60.0)}, {"home": (open_line, loop)})
    assert look.compare_paths()
    (found,) = look.conflicts  # 3 flies on another layer, and 1 has a mission of its own
    assert (found.first, found.second, found.on_tour, found.together) == (1, 2, True, False)
    assert math.isfinite(found.first_s)
    assert not look.compare_paths(), "nothing changed"
    look.patrols = patrols({2: ("home", 30.0)}, {"home": (open_line,)})
    assert look.compare_paths() and not look.conflicts


def test_an_edit_compares_only_the_pairs_it_is_about_and_may_be_left_between_two() -> None:
    look = Forecast()
    look.frame, look.performance = FRAME, CRAFT
    ways = {v: VehicleDraft(mission=(UP, to(200, 10.0 * v), BACK)) for v in range(1, 9)}
    look.draft = MissionDraft(ways)
    assert sum(1 for _ in look.comparing()) == 28
    assert sum(1 for _ in look.comparing()) == 0
    look.draft = MissionDraft(ways | {8: VehicleDraft(mission=(UP, to(200, 300), BACK))})
    halfway = look.comparing()
    assert next(halfway, "over") is None
    assert sum(1 for _ in look.comparing()) == 6, "what was compared before it was left is not compared again"


# ---------------------------------------------------------------- surveys


SHAPES = {
    "rectangle": ((0, 0), (300, 0), (300, 100), (0, 100)),
    "L": ((0, 0), (300, 0), (300, 100), (100, 100), (100, 300), (0, 300)),
    "U": ((0, 0), (300, 0), (300, 300), (200, 300), (200, 100), (100, 100), (100, 300), (0, 300)),
}


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("angle_deg", [0.0, 37.0, 90.0])
@pytest.mark.parametrize("entry", range(4))
def test_a_survey_sees_the_whole_area(name: str, angle_deg: float, entry: int) -> None:
    outline = shapely.Polygon(SHAPES[name])
    found = survey.lanes(survey.Survey(SHAPES[name], 20.0, angle_deg, entry=entry))
    seen = shapely.union_all([shapely.LineString(lane).buffer(10.001, cap_style="square") for lane in found])
    assert outline.difference(seen).area < 0.01 * outline.area
    outside = shapely.union_all(shapely.linestrings(np.array(found))).difference(outline.buffer(0.01))
    assert outside.is_empty


def test_turns_are_made_outside() -> None:
    found = survey.lanes(survey.Survey(SHAPES["rectangle"], 20.0, 0.0, turn_m=15.0))
    assert {y for lane in found for _, y in lane} == {-15.0, 115.0}


@pytest.mark.parametrize("vehicles", [1, 2, 3, 5])
def test_a_survey_is_shared_out_evenly(vehicles: int) -> None:
    found = survey.lanes(survey.Survey(SHAPES["rectangle"], 5.0, 0.0))
    homes = [(10.0 * v, -20.0) for v in range(vehicles)]
    shares = survey.split(found, homes, 8.0, 2.0)
    assert sorted(lane for share in shares for lane in share) == sorted(found)
    times = [
        timed_path(
            build.whole(FRAME, home, build.lane_items(FRAME, share, 30.0), 30.0), HomePosition(home), FRAME, CRAFT
        ).duration_s
        for share, home in zip(shares, homes, strict=True)
    ]
    assert max(times) / min(times) < 1.25


def test_more_vehicles_than_lanes_leave_some_without() -> None:
    shares = survey.split([((0.0, 0.0), (0.0, 50.0))], [(0.0, 0.0), (5.0, 0.0)], 8.0, 2.0)
    assert sorted(map(len, shares)) == [0, 1]


@pytest.mark.parametrize(
    ("asked", "why"),
    [
        (survey.Survey(SHAPES["L"], 0.1), "apart"),
        (survey.Survey(SHAPES["L"], math.nan), "apart"),
        (survey.Survey(((0, 0), (10, 10), (10, 0), (0, 10)), 5.0), "crosses itself"),
        (survey.Survey(((0, 0), (1, 1)), 5.0), "empty"),
        (survey.Survey(((0, 0), (3000, 0), (0, 3000)), 1.0), "lanes: at most"),
    ],
)
def test_impossible_surveys_are_refused(asked: survey.Survey, why: str) -> None:
    with pytest.raises(survey.GeneratorError, match=why):
        survey.lanes(asked)


def test_a_corridor_is_flown_in_lanes_and_cut_in_equal_lengths() -> None:
    line = ((0.0, 0.0), (200.0, 0.0), (300.0, 100.0))
    parts = corridor.paths(corridor.Corridor(line, 40.0, 20.0), 2)
    assert len(parts) == 2
    seen = shapely.union_all([shapely.LineString(part).buffer(10.01) for part in parts])
    assert shapely.LineString(line).buffer(20.0, cap_style="flat").difference(seen).area < 20
    assert corridor.paths(corridor.Corridor(line, 0.0, 20.0))[0] == line
    assert corridor.paths(corridor.Corridor(line, 0.0, 20.0, backwards=True))[0] == line[::-1]
    with pytest.raises(survey.GeneratorError):
        corridor.paths(corridor.Corridor(((0, 0), (0, 0)), 10.0, 10.0))


# ---------------------------------------------------------------- findings


def said(*items: PlanItem, fence: tuple[PlanItem, ...] = (), site: MissionSite = SITE) -> str:
    draft = VehicleDraft(items, fence)
    return "\n".join(map(str, findings(draft, way(*items), site)))


def test_a_good_mission_needs_no_word() -> None:
    assert said(UP, to(200, 0), BACK) == ""


@pytest.mark.parametrize(
    ("items", "text"),
    [
        ((to(200, 0), BACK), "mission 1: it does not begin with a take-off"),
        ((UP, to(200, 0)), "mission: it neither lands nor returns"),
        ((UP, to(400, 0), to(0, 0), BACK), "mission 2: the way to it leaves the operating area (and 1 more)"),
        ((UP, to(200, 200), BACK), "mission 2: the way to it enters no-fly zone church (and 1 more)"),
        ((UP, to(100, 0, 80), BACK), "mission 2: the way to it 80 m is above the operating area (60 m) (and 1 more)"),
        ((UP, to(100, 0), PlanItem(JUMP, 2, (9.0, 1.0, 0.0, 0.0)), BACK), "mission 3: jumps to item 10 of 4"),
    ],
)
def test_findings_name_their_item(items: tuple[PlanItem, ...], text: str) -> None:
    assert text in said(*items)


def test_its_own_fence_and_its_battery_are_looked_at() -> None:
    inside = fences.circle((52.07, -0.628), 150.0)
    assert "mission 2: the way to it leaves its own fence (and 1 more)" in said(UP, to(200, 0), BACK, fence=inside)
    assert said(UP, to(100, 0), BACK, fence=inside) == ""
    tired = replace(SITE, battery_pct=30.0)
    assert "the battery ends at" in said(UP, to(200, 0), BACK, site=tired)
    weak = replace(SITE, performance=replace(CRAFT, endurance_s=60.0))
    assert "the battery does not last" in said(UP, to(200, 0), BACK, site=weak)


def test_the_battery_falls_with_time() -> None:
    flown = way(UP, to(200, 0), BACK)
    assert battery_left_pct(flown, SITE) == pytest.approx(100 - 100 * flown.duration_s / 1200)


def test_what_cannot_be_sent_is_an_error_and_comes_first() -> None:
    draft = VehicleDraft((to(0, 0),), fences.circle((52.07, -0.628), -5.0))
    found = findings(draft, way(*draft.mission), SITE)
    assert (found[0].level, found[0].kind) == (FindingLevel.ERROR, PlanKind.FENCE)


def test_what_its_autopilot_would_refuse_is_an_error() -> None:
    high = replace(to(100, 0), frame=10)
    px4 = replace(SITE, autopilot="PX4", home_deg=(52.07, -0.628))
    assert "mission: PX4 knows no heights above the ground" in said(UP, high, BACK, site=px4)
    elsewhere = fences.circle((52.08, -0.628), 100.0)
    assert "home is outside of what it allows" in said(UP, to(10, 0), BACK, fence=elsewhere, site=px4)
    assert said(UP, to(10, 0), BACK, fence=fences.circle((52.07, -0.628), 100.0), site=px4) == ""


def _degrees(east_m: float, north_m: float) -> tuple[int, int]:
    lat_deg, lon_deg = FRAME.to_geodetic(east_m, north_m)
    return round(lat_deg * 1e7), round(lon_deg * 1e7)


# ---------------------------------------------------------------- begin and end


def test_items_after_the_end_are_reported_as_not_flown() -> None:
    stay = PlanItem(LOITER_UNLIMITED, 3, x=520_700_000, y=-6_280_000, z=30.0)
    after = "mission 4: comes after the mission's end, item 3: not counted, not flown"
    assert f"{after} (and 1 more)" in said(UP, to(50, 0), BACK, to(90, 0), to(99, 0))
    assert "comes after" in said(UP, stay, BACK)
    assert "comes after" not in said(UP, to(50, 0), PlanItem(JUMP, MISSION_FRAME, (1.0, 2.0, 0.0, 0.0)), BACK)


def test_a_take_off_that_does_not_climb_is_reported() -> None:
    assert "mission 1: a take-off to 0 m above home" in said(up(0.0), to(50, 0), BACK)
    assert "a take-off to" not in said(UP, to(50, 0), BACK)
