"""Findings about a plan for one autopilot, and about a scenario."""

from dataclasses import replace
from pathlib import Path

from tests.core.rigs.plan_peers import circle, fence, mission, rally, square, waypoint
from tui_gcs.core.firmware.plan_dialects import ARDUPILOT, GENERIC, PX4, PlanDialect
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.missions.draft import VehicleDraft
from tui_gcs.core.missions.mission_findings import FindingLevel
from tui_gcs.core.missions.plan_findings import PlanTarget, autopilot_findings
from tui_gcs.core.missions.scenario_findings import findings
from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind
from tui_gcs.core.scenario.load import parse

HOME = (47.3977, 8.5456)
SCENARIO = (Path(__file__).parents[3] / "tui_gcs/scenarios/swarm-challenge.toml").read_text()


def said(*items: PlanItem, fence_: Plan | None = None, rally_: Plan | None = None, by: PlanDialect = GENERIC) -> str:
    draft = VehicleDraft(items, fence_.items if fence_ else (), rally_.items if rally_ else ())
    found = autopilot_findings(draft, PlanTarget(by, LocalFrame(Origin(*HOME, 0.0)), HOME))
    return "\n".join(f"{finding.level.name} {finding}" for finding in found)


def test_a_sound_mission_needs_no_words() -> None:
    for dialect in (ARDUPILOT, PX4, GENERIC):
        assert said(*mission(8).items, fence_=fence(*square()), rally_=rally(20.0), by=dialect) == ""


def test_a_command_that_the_autopilot_does_not_take() -> None:
    wait = PlanItem(200, 2)
    spline = waypoint(1, command=82)
    assert "ERROR mission 1: ArduPilot takes no command 200" in said(wait, spline, by=ARDUPILOT)
    assert "ERROR mission 2: PX4 takes no spline (command 82) in a mission (and 1 more)" in said(
        wait, spline, spline, by=PX4
    )
    assert said(wait, spline) == "", "nobody knows who flies it"


def test_heights_that_are_easily_wrong() -> None:
    found = said(waypoint(1), replace(waypoint(2), frame=0, z=500.0))
    assert found == "CAUTION mission: heights are above different things: 1 above sea level, 1 above home"
    assert "mission 2: is at the height of home" in said(waypoint(1), waypoint(2, z=0.0))
    assert "mission 1: 510 m above home: meant above sea level? (and 1 more)" in said(
        waypoint(1, z=510.0), waypoint(2, z=520.0)
    )
    assert "PX4 knows no heights above the ground" in said(replace(waypoint(1), frame=10), by=PX4)


def test_places_that_are_far_away() -> None:
    wrong_way_round = PlanItem(16, 3, x=85_456_000, y=473_977_000, z=20.0)
    assert "CAUTION mission 1: 5" in said(wrong_way_round) and "km from where it starts" in said(wrong_way_round)


def test_a_landing_or_rally_point_where_the_fence_does_not_let_it_be() -> None:
    land = PlanItem(21, 3, x=473_979_000, y=85_457_000)
    no = fence(*square(), circle(30.0))
    assert "ERROR mission 1: lies outside of what the fence allows" in said(land, fence_=no)
    far = Plan(PlanKind.RALLY, (PlanItem(5100, 3, x=474_100_000, y=85_456_000, z=20.0),))
    assert "ERROR rally 1: lies outside" in said(fence_=fence(*square()), rally_=far)


# ---------------------------------------------------------------- scenarios


def test_a_team_that_cannot_see_its_zone_in_time() -> None:
    short = SCENARIO.replace("duration_s = 300.0", "duration_s = 15.0", 1)
    assert short != SCENARIO
    cautions = [f"{where}: {each.text}" for where, each in findings(parse(short)) if each.level is FindingLevel.CAUTION]
    assert cautions[0] == (
        "round 1, team defend: defend: cannot see all of home once: 21 s at best, 15 s flown"
    ) and all(text.startswith("round 1") for text in cautions)
    assert not [each for _, each in findings(parse(SCENARIO)) if each.level is not FindingLevel.NOTE]
