"""`tui-gcs check`: findings of scenarios, plans and other files, and how it ends."""

import json
import math
import re
import resource
import struct
from pathlib import Path

import msgspec
import numpy as np
import pytest

from tests.rigs.reports import report_of
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.files.bounded import TimeUsedUp, bounded
from tui_gcs.cli.files.check_preview import _Budget, search_steps
from tui_gcs.cli.flights.scenario_options import ScenarioChanges
from tui_gcs.cli.main import main
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.missions import mission_builder as build
from tui_gcs.core.missions.draft import MissionDraft, VehicleDraft
from tui_gcs.core.missions.draft_file import SavedDraft, to_bytes
from tui_gcs.core.missions.scenario_findings import gate_findings, preview_findings
from tui_gcs.core.protocol.common import PreviewResult
from tui_gcs.core.scenario.load import parse
from tui_gcs.planner.runtime.plan_forecast import MAX_SEARCH_STEPS

SCENARIO = Path(__file__).parents[3] / "tui_gcs/scenarios/swarm-challenge.toml"
WPL = (
    "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47.3977000\t8.5456000\t488\t1\n"
    "1\t0\t3\t22\t0\t0\t0\t0\t47.3977000\t8.5456000\t15\t1\n2\t0\t3\t82\t0\t0\t0\t0\t47.3978000\t8.5457000\t20\t1\n"
    "3\t0\t2\t20\t0\t0\t0\t0\t0\t0\t0\t1\n"
)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_a_scenario(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(SCENARIO)]) == 0
    out = capsys.readouterr().out
    assert "note    round 1, home: ok: 70 m inside the operating area\n" in out and "nothing is wrong" in out
    Path("a.toml").write_text(SCENARIO.read_text().replace("radius_m = 80.0", "radius_m = 800.0"))
    line = SCENARIO.read_text().splitlines().index("[[round.zone]]") + 1
    assert main(["check", "a.toml"]) == 1
    assert f"ERROR   round[1].zone[1] (line {line}): zone 'home' reaches outside" in capsys.readouterr().out
    Path("b.toml").write_text(SCENARIO.read_text().replace('planner = "patrol"', 'planner = "mine"'))
    assert main(["check", "b.toml"]) == 0
    assert "caution team defend: planner 'mine' is none of the known ones" in capsys.readouterr().out


def plateau(lat_deg: float, lon_deg: float) -> None:
    """Write plateau.asc around a place: level at 110 m, and 72 m higher from about 250 m east of it on."""
    rows = "\n".join(" ".join("182" if column > 46 else "110" for column in range(80)) for _ in range(80))
    corner = f"xllcenter {lon_deg - 0.02}\nyllcenter {lat_deg - 0.02}"
    Path("plateau.asc").write_text(f"ncols 80\nnrows 80\n{corner}\ncellsize 0.0005\nNODATA_value -9999\n{rows}")


def test_the_ground_below_a_scenario_and_a_mission(capsys: pytest.CaptureFixture[str]) -> None:
    origin = parse(SCENARIO.read_text(), "a.toml").origin
    plateau(origin.lat_deg, origin.lon_deg)
    assert main(["check", str(SCENARIO), "--terrain", "plateau.asc"]) == 0
    assert re.search(r"caution round 1: the layer of [\d.]+ m is \d+ m below the ground at", capsys.readouterr().out)
    plateau(47.3977, 8.5456)
    Path("over.waypoints").write_text(WPL.replace("8.5457000\t20", "8.5550000\t20"))
    assert main(["check", "over.waypoints", "--terrain", "plateau.asc"]) == 0
    assert "caution mission 2: the way to it passes 5" in capsys.readouterr().out
    assert main(["check", str(SCENARIO), "--terrain", "none.asc"]) == 2
    assert "--terrain none.asc: No such file or directory" in capsys.readouterr().err


@pytest.mark.long
def test_what_planners_would_make_of_it_and_where_teams_meet(capsys: pytest.CaptureFixture[str]) -> None:
    """Two small zones on each other, one round, two vehicles each."""
    text = SCENARIO.read_text()
    head, *rounds = text.split("[[round]]")
    end = rounds[-1][rounds[-1].index("[[team]]") :]
    area = rounds[0][rounds[0].index("[round.area]") : rounds[0].index("[[round.zone]]")]
    zones = f'name = "r"\nduration_s = 60.0\n\n{area}'
    for name, role, east_m in (("home", "defend", 150.0), ("field", "attack", 160.0)):
        zones += f'[[round.zone]]\nname = "{name}"\nrole = "{role}"\nshape = "circle"\n'
        zones += f"centre_m = [{east_m}, 200.0]\nradius_m = 20.0\n\n"
    Path("a.toml").write_text(f"{head}[[round]]\n{zones}{end}")
    assert main(["check", "a.toml"]) == 0
    assert "separation" not in capsys.readouterr().out
    assert main(["check", "a.toml", "--preview"]) == 0
    out = capsys.readouterr().out
    assert re.search(r"note    r: defend: 4 planned: [\d.]+ s worst, [\d.]+ x ideal, separation [\d.]+ x\n", out)
    assert re.search(r"r: defend and attack: separation 1\.\d\d x after \d+ s at \[\d+ \d+\] \([1-4] and [5-8]\):", out)
    assert "note    preview: planned for ArduPilot, up to 1.1 m beside its course (--autopilot)\n" in out
    assert main(["check", "a.toml", "--preview", "--autopilot", "px4"]) == 0
    assert "planned for PX4, up to 1.25 m beside its course" in capsys.readouterr().out
    Path("b.kml").write_text("<kml/>")
    assert main(["check", "b.kml", "--preview"]) == 2


def test_a_preview_that_is_too_fine_says_so_at_once(capsys: pytest.CaptureFixture[str]) -> None:
    text = re.sub("footprint_radius_m = 15.0", "footprint_radius_m = 0.001", SCENARIO.read_text())
    Path("fine.toml").write_text(text)
    main(["check", "fine.toml", "--preview"])
    out = capsys.readouterr().out
    line = "round 1: defend: no plan: a footprint of 0.001 m radius in a zone of 20106 m2 is too fine to plan: "
    assert line + "1.79 m at least" in out


def test_a_preview_ends_when_the_time_for_all_teams_is_used_up(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(SCENARIO), "--preview", "--seconds", "0.03"]) == 0
    out = capsys.readouterr().out
    for round_ in ("round 1", "round 2", "round 3"):
        assert f"caution {round_}: defend, attack: no plan: the 0.03 s for all teams are used up (--seconds" in out
    assert "planned:" not in out
    for wrong in ("0", "-1", "nan", "soon"):
        with pytest.raises(SystemExit):
            main(["check", str(SCENARIO), "--preview", "--seconds", wrong])
    assert main(["check", str(SCENARIO), "--seconds", "5"]) == 2
    assert "--seconds is of --preview" in capsys.readouterr().err


def test_teams_share_the_time_of_a_preview_and_what_one_leaves_is_for_those_that_wait() -> None:
    budget = _Budget(10.0, 2, 5)
    first, second = budget.next_share_s(), budget.next_share_s()
    assert first == second == pytest.approx(4.0)
    assert budget.limit_s(first) == 10.0, "one core for all of the time"
    budget.done(first, 1.0)
    assert budget.next_share_s() == pytest.approx(5.0)
    budget.done(second, 10.0)
    assert budget.next_share_s() == pytest.approx(2.0)
    budget.done(5.0, 9.0)
    assert budget.next_share_s() == 0.0, "all of it is used"


def test_a_team_with_a_larger_share_of_the_time_is_granted_more_steps_of_search() -> None:
    assert search_steps(1.0) == 0, "a share that is enough for a first plan only"
    few, some, all_ = search_steps(10.0 * 2 / 6), search_steps(20.0 * 2 / 6), search_steps(60.0 * 2 / 6)
    assert 0 < few < some < MAX_SEARCH_STEPS <= all_


@pytest.mark.long
def test_two_previews_of_one_file_have_the_same_figures(capsys: pytest.CaptureFixture[str]) -> None:
    """With so much time that the clock ends no search, steps alone decide how far each goes."""
    main(["scenario", "new", "small.toml", "--origin", "52.072,-0.628,110", "--vehicles", "2", "--teams", "1"])
    capsys.readouterr()
    seen = []
    for _ in range(2):
        assert main(["check", "small.toml", "--preview", "--seconds", "60"]) == 0
        seen.append([line for line in capsys.readouterr().out.splitlines() if "planned:" in line])
    assert len(seen[0]) == 1 and seen[0] == seen[1] and "of the search" not in seen[0][0]


def test_a_search_that_was_cut_short_is_told_beside_its_figures() -> None:
    found = PreviewResult("defend", 0, "done", {"searched": 0.2}, worst_s=26.0, ratio=1.25, vehicles=4)
    assert "1.25 x ideal, after 20% of the search: a flight may be better" in preview_findings(found)[0].text
    found = msgspec.structs.replace(found, metrics={"searched": 1.0})
    assert preview_findings(found)[0].text.endswith("1.25 x ideal")


def test_a_preview_says_which_gates_a_rehearsal_would_fail() -> None:
    """A star with three slow vehicles was "nothing is wrong" here, and failed its rehearsal with 3.40 x."""
    scenario = parse(SCENARIO.read_text())
    round_ = scenario.rounds[0]
    found = PreviewResult("defend", 0, "done", {"period_s": 800.0}, worst_s=26.0, vehicles=4, ideal_s=20.0, bound_s=9.0)
    lines = [f"{each.text}: {each.detail}" for each in gate_findings(scenario, round_, found)]
    assert lines == [
        "^ defend: duration_s 300 is too short to be measured: "
        "700 s are enough; a rehearsal flies on until then, a real flight does not"
    ]
    found = msgspec.structs.replace(found, metrics={"period_s": 100.0}, worst_s=42.0)
    (slow,) = gate_findings(scenario, round_, found)
    assert slow.text == "^ defend: 2.10 x ideal fails the gate worst_ratio_max 2"
    narrow = msgspec.structs.replace(found, bound_s=36.0)
    assert gate_findings(scenario, round_, narrow) == [], "no plan is under the bound"
    assert preview_findings(narrow)[0].text.endswith(", 1.17 x bound")
    assert gate_findings(scenario, round_, PreviewResult("defend", 0, "failed", text="no")) == []


def test_a_preview_ends_when_its_time_or_memory_is_used_up() -> None:
    with pytest.raises(TimeUsedUp), bounded(0.05, 400_000_000):
        try:
            while True:
                math.sqrt(2.0)
        except Exception:  # noqa: BLE001 - as a planner's host does
            pytest.fail("what guards against planners would keep it from ending")
    with pytest.raises(MemoryError), bounded(10.0, 50_000_000):
        np.ones(100_000_000, np.uint8)
    assert resource.getrlimit(resource.RLIMIT_DATA)[0] == resource.RLIM_INFINITY


def test_a_scenario_that_cannot_be_read_is_said_whatever_the_other_file_holds(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("empty.waypoints").write_text("QGC WPL 110\n")
    Path("bad.toml").write_text("x = [")
    assert main(["check", "empty.waypoints"]) == 0
    capsys.readouterr()
    assert main(["check", "empty.waypoints", "--scenario", "bad.toml"]) == 2
    assert "bad.toml" in capsys.readouterr().err
    assert main(["check", str(SCENARIO), "--round", "2"]) == 2
    assert "a scenario is looked at as a whole" in capsys.readouterr().err


def test_a_zone_that_nobody_serves(capsys: pytest.CaptureFixture[str]) -> None:
    more = '[[round.zone]]\nname = "spare"\nrole = "{}"\nshape = "circle"\ncentre_m = [40.0, 40.0]\nradius_m = 5.0\n\n'
    for role, reported in (("defend", True), ("no-fly", False)):
        text = SCENARIO.read_text()
        Path("a.toml").write_text(text.replace("[[round.zone]]", more.format(role) + "[[round.zone]]", 1))
        main(["check", "a.toml"])
        assert ("no team serves spare: no vehicle flies there" in capsys.readouterr().out) is reported


WALL = """[[round.zone]]
name = "wall"
role = "no-fly"
shape = "rectangle"
centre_m = [300.0, %.1f]
width_m = 10.0
height_m = %.1f

"""


@pytest.mark.parametrize(("north_m", "height_m", "is_closed"), [(200.0, 400.0, True), (150.0, 300.0, False)])
def test_a_zone_to_which_no_way_leads(
    north_m: float, height_m: float, is_closed: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    """A wall across the field; 100 m shorter it leaves a way round its end."""
    wall = WALL % (north_m, height_m)
    Path("wall.toml").write_text(SCENARIO.read_text().replace("[[round.zone]]", wall + "[[round.zone]]", 1))
    assert main(["check", "wall.toml"]) == int(is_closed)
    found = "ERROR   round 1, team attack: attack: no way leads from the take-off places of 5-8 to field" in (
        out := capsys.readouterr().out
    )
    assert found is is_closed
    assert ("wall and the margin of 5 m leave none" in out) is is_closed
    assert "no way leads from the take-off places of 1-4" not in out, "home is on their side"


def checked(capsys: pytest.CaptureFixture[str], text: str) -> tuple[int, str]:
    Path("wrong.toml").write_text(text)
    code = main(["check", "wrong.toml"])
    return code, capsys.readouterr().out


def test_parameters_that_a_planner_does_not_take_are_found_before_the_flight(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """`check` said "nothing is wrong", and the rehearsal ended after 90 s with five vehicles that were not ready."""
    first = "vehicles = [1, 2, 3, 4]\n"
    text = SCENARIO.read_text()
    code, out = checked(capsys, text.replace(first, f"{first}parameters = {{ speed_fractoin = 0.5 }}\n"))
    line = text.splitlines().index(first.strip()) + 2
    assert code == 1
    assert f"ERROR   team[1].parameters.speed_fractoin (line {line}): planner patrol: speed_fractoin" in out
    assert "(did you mean speed_fraction?)" in out
    code, out = checked(capsys, text.replace(first, f"{first}parameters = {{ speed_fraction = 5.0 }}\n"))
    assert code == 1 and f"(line {line}): planner patrol: speed_fraction must be at most 0.985" in out
    with pytest.raises(CommandError, match=r"wrong.toml: team\[1\].parameters.speed_fraction \(line"):
        ScenarioChanges({}).made(Path("wrong.toml").read_text(), "wrong.toml")


def test_a_planner_that_is_mistyped_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    code, out = checked(capsys, SCENARIO.read_text().replace('planner = "patrol"', 'planner = "patroll"', 1))
    assert code == 0 and "'patroll' is none of the known ones (did you mean patrol?)" in out


def test_what_no_vehicle_can_see_or_do(capsys: pytest.CaptureFixture[str]) -> None:
    text = SCENARIO.read_text()
    code, out = checked(capsys, text.replace("geofence_margin_m = 5.0", "geofence_margin_m = 200.0"))
    assert code == 1 and "ERROR   round 1, team defend: defend: nothing of home can be seen" in out
    stranger = '[[class]]\nname = "slow"\nvehicles = [4, 77]\nspeed_m_s = 5.0\n'
    weak = "capacity_wh = 10.0\nhover_w = 200.0\ncruise_w = 180.0\n"
    task = '[[task]]\nname = "well"\nplace_m = [300.0, 200.0]\n'
    code, out = checked(capsys, text + stranger + weak + task)
    assert code == 0 and "class slow: 77 in no team" in out and "task well" not in out
    assert "defend: 4 of class slow return before the round is over: a battery lasts 153 s until return_pct" in out
    house = (WALL % (200.0, 100.0)).replace("width_m = 10.0", "width_m = 40.0")
    code, out = checked(capsys, text.replace("[[round.zone]]", house + "[[round.zone]]", 1) + task)
    assert "task well: 26 m from where vehicles may fly, and they see 15 m: no vehicle can do it" in out


def test_gates_that_no_flight_can_pass_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    """`check` said "nothing is wrong", and the rehearsal failed whatever was planned."""
    text = SCENARIO.read_text()
    code, out = checked(capsys, text.replace("worst_ratio_max = 2.0", "worst_ratio_max = 0.5"))
    assert code == 0
    assert "defend: worst_ratio_max 0.5 allows a worst idleness of 10.5 s: no plan is under 18.0 s (bound)" in out
    code, out = checked(capsys, text.replace("on_slot_max_s = 120.0", "on_slot_max_s = 2.0"))
    assert "caution round 1, team attack: attack: on_slot_max_s 2 is shorter than the way of vehicle 5: 41 s" in out
    assert "round 2, team" not in "".join(line for line in out.splitlines() if "on_slot_max_s" in line)
    slow = '[[class]]\nname = "slow"\nvehicles = [3]\nspeed_m_s = 0.05\n'
    code, out = checked(capsys, text + slow)
    assert "defend: on_slot_max_s 120 is shorter than the way of vehicle 3: 210 s to home at its speed" in out
    late = '[[task]]\nname = "well"\nplace_m = [450.0, 200.0]\ndeadline_s = 20\n'
    code, out = checked(capsys, text + late)
    assert "task well: the nearest take-off place is 49 s away, its deadline 20 s: no vehicle can do it in time" in out
    checked(capsys, text + late.replace("20\n", "90\n"))
    main(["check", str(SCENARIO)])
    assert "caution" not in capsys.readouterr().out


def test_a_zone_of_which_nothing_is_seen_is_not_called_too_small_for_its_team(
    capsys: pytest.CaptureFixture[str],
) -> None:
    text = SCENARIO.read_text()
    _, out = checked(capsys, text.replace("geofence_margin_m = 5.0", "geofence_margin_m = 200.0"))
    assert "nothing of home can be seen" in out and "too small" not in out
    _, out = checked(capsys, text.replace("radius_m = 80.0", "radius_m = 11.0"))
    assert "home is too small for 4 vehicles: one path has room for 1" in out


def test_layers_with_nothing_to_spare(capsys: pytest.CaptureFixture[str]) -> None:
    """30 vehicles on layers exactly as far apart as is allowed were held by the guard 1800 times in a rehearsal."""
    Path("a.toml").write_text(SCENARIO.read_text().replace("layer_m = 34.0", "layer_m = 32.5"))
    assert main(["check", "a.toml"]) == 0
    assert "caution round 1, team defend: defend: layers of 1-2 are less than 6 m from" in capsys.readouterr().out
    main(["check", str(SCENARIO)])
    assert "layers of" not in capsys.readouterr().out


def test_where_a_border_crosses_itself_is_told_to_the_decimetre(capsys: pytest.CaptureFixture[str]) -> None:
    zone = '[[round.zone]]\nname = "z"\nrole = "no-fly"\nshape = "polygon"\nvertices_m = {}\n\n'
    crossed = zone.format("[[0.0, 100.0], [80.0, 100.0], [80.0, 200.0], [107.3, 164.1]]")
    Path("a.toml").write_text(SCENARIO.read_text().replace("[[round.zone]]", crossed + "[[round.zone]]", 1))
    assert main(["check", "a.toml"]) == 1
    assert "the border crosses itself near [80 147.8];" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("corners", "why"),
    [
        ("[[1,1],[1.01,1.01],[1.01,1],[1,1.01],[1,1]]", "the polygon crosses itself near"),
        ("[[179.9,1],[-179.9,1],[-179.9,1.1],[179.9,1]]", "the polygon reaches over the antimeridian"),
        ("[[0,89.99],[90,89.99],[180,89.99],[0,89.99]]", "the polygon reaches over a pole"),
    ],
)
def test_an_area_that_can_be_no_zone(corners: str, why: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.geojson").write_text(f'{{"type":"Polygon","coordinates":[{corners}]}}')
    assert main(["check", "a.geojson"]) == 1
    assert f"ERROR   area 1: {why}" in capsys.readouterr().out


def test_missions_of_many_vehicles_as_the_screen_says_of_them(capsys: pytest.CaptureFixture[str]) -> None:
    frame = LocalFrame(parse(SCENARIO.read_text(), "a").origin)
    there = [build.waypoint(frame, (300.0, 200.0), 30.0)]
    plans = {v: VehicleDraft(build.whole(frame, (20.0 * v, 0.0), there, 30.0)) for v in (1, 2)}
    plans[3] = VehicleDraft((*plans[1].mission, there[0]))
    Path("all.json").write_bytes(to_bytes(SavedDraft(MissionDraft(plans))))
    assert main(["check", "all.json", "--scenario", str(SCENARIO)]) == 1
    out = capsys.readouterr().out
    assert "ERROR   1 and 2 MEET at " in out and "0 m in height" in out
    assert "caution vehicle 3: mission 4: comes after the mission's end, item 3" in out
    assert "note    vehicle 1: " in out and " at the end\n" in out
    main(["check", "all.json"])
    assert "taken for its first place (--scenario FILE.toml)" in capsys.readouterr().out
    Path("all.json").write_text('{"missions":1,"vehicles":{"1":{"mission":[[1]]}}}')
    assert main(["check", "all.json"]) == 2
    assert "all.json: no missions of this program:" in capsys.readouterr().err


def test_a_mission_for_each_autopilot(capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.waypoints").write_text(WPL)
    assert main(["check", "a.waypoints", "--autopilot", "ardupilot"]) == 0
    out = capsys.readouterr().out
    assert "mission: 3 items: " in out and "nothing is wrong" in out
    assert main(["check", "a.waypoints", "--autopilot", "px4", "--json"]) == 1
    report = report_of(capsys.readouterr().out, "check")
    assert report["ok"] is False and report["data"]["findings"][0] == {
        "level": "error", "where": "mission 2", "text": "PX4 takes no spline (command 82) in a mission"
    }  # fmt: skip


def test_a_mission_in_the_area_of_a_scenario(capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.waypoints").write_text(WPL)
    assert main(["check", "a.waypoints", "--scenario", str(SCENARIO)]) == 0
    assert "leaves the operating area" in capsys.readouterr().out
    assert main(["check", "a.waypoints", "--home", "8.5,47.4"]) == 0
    assert "km from where it starts" in capsys.readouterr().out
    assert main(["check", "a.waypoints", "--home", "north"]) == 2


def test_a_plan_whose_way_is_not_in_the_file(capsys: pytest.CaptureFixture[str]) -> None:
    scan = {"type": "ComplexItem", "complexItemType": "StructureScan", "version": 3}
    plan = {"fileType": "Plan", "mission": {"version": 2, "items": [scan]}}
    Path("a.plan").write_text(json.dumps(plan))
    assert main(["check", "a.plan"]) == 1
    assert "ERROR   mission: item 1, StructureScan: its way is not in the file" in capsys.readouterr().out


def test_parameters_that_say_who_a_vehicle_is(capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.param").write_text("SYSID_THISMAV,3\nMIS_TOTAL,4\n")
    assert main(["check", "a.param"]) == 0
    out = capsys.readouterr().out
    assert "caution SYSID_THISMAV is part of a vehicle's identity" in out and "note    MIS_TOTAL is reckoned" in out


def test_what_cannot_be_read_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.plan").write_text("{")
    for name in ("a.plan", "gone.plan", "gone.toml"):
        assert main(["check", name]) == 2
        error = capsys.readouterr().err
        assert name in error and error.count("\n") == 1


@pytest.mark.parametrize(
    ("name", "data", "what"),
    [
        ("area.kml", b"no XML at all\n", "is named .kml, and is no XML document"),
        ("area.kmz", b"1 2\n", "is named .kmz, and is no ZIP archive"),
        ("field.plan", b"A 1\n", "is named .plan, and is no JSON object"),
        ("flight.tlog", struct.pack(">Q", 1_700_000_000_000_000) + b"\xfd\x09\0\0", "is a telemetry log (.tlog"),
        ("raw.tlog", b"\xfe\x09\0\0\0", "is a stream of MAVLink frames without times"),
        ("7.bin", b"\xa3\x95\x80\x80", "is a log of ArduPilot (.bin)"),
        ("7.ulg", b"ULog\x01\x12\x35\x01", "is a log of PX4 (.ulg)"),
        ("old.mission", b'{"groundStation": "QGroundControl", "items": []}', "is an old mission of QGroundControl"),
    ],
)
def test_a_file_of_another_kind_is_named(name: str, data: bytes, what: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path(name).write_bytes(data)
    assert main(["check", name]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"tui-gcs: {name}: {what}") and error.count("\n") == 1


def test_a_file_of_another_kind_by_its_name_is_read_all_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    Path("mission.plan").write_text(WPL)
    assert main(["check", "mission.plan"]) == 0
    assert "its first line is home" in capsys.readouterr().out


@pytest.mark.parametrize("command", [16, 17, 18, 19, 31, 82, 94])
def test_no_place_is_here_for_ardupilot_and_a_fault_for_px4(command: int, capsys: pytest.CaptureFixture[str]) -> None:
    """ArduPilot's own missions hold such items; a PX4 would fly to the Gulf of Guinea."""
    Path("a.waypoints").write_text(
        "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47.3977\t8.5456\t488\t1\n1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t20\t1\n"
        f"2\t0\t3\t{command}\t1\t0\t0\t0\t0\t0\t0\t1\n3\t0\t3\t20\t0\t0\t0\t0\t0\t0\t0\t1\n"
    )
    assert main(["check", "a.waypoints", "--autopilot", "ardupilot"]) == 0
    out = capsys.readouterr().out
    assert "note    mission 2: 0, 0 is no place: ArduPilot does it where it is then\n" in out
    assert "up to 20 m above home" in out and "height of home" not in out
    assert main(["check", "a.waypoints"]) == 0
    assert "caution mission 2: 0, 0 is no place: an ArduPilot does it where it is then" in capsys.readouterr().out
    assert main(["check", "a.waypoints", "--autopilot", "px4"]) == 1
    assert "ERROR   mission: item 2 has no place (0, 0): PX4 would fly there" in capsys.readouterr().out


def test_for_whom_a_first_line_is_home(capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.txt").write_text(WPL.replace("0\t1\t0\t16", "0\t1\t3\t16"))
    assert main(["check", "a.txt", "--autopilot", "ardupilot"]) == 0
    assert "note    its first line is home in frame 3, as ArduPilot takes it" in capsys.readouterr().out
    main(["check", "a.txt", "--autopilot", "px4"])
    assert "note    its first line is an item: its frame is 3, and PX4 has no home" in capsys.readouterr().out


def test_parameters_that_are_given_twice(capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.parm").write_text("RTL_ALT 30\nRTL_ALT 40\n")
    assert main(["check", "a.parm"]) == 0
    assert "caution not kept: line 1: RTL_ALT 30: line 2 says 40, the last counts" in capsys.readouterr().out
