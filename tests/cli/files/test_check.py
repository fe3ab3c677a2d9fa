"""`tui-gcs check`: findings of scenarios, plans and other files, and how it ends."""

import json
import re
from pathlib import Path

import pytest

from tui_gcs.cli.main import main
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.missions import mission_builder as build
from tui_gcs.core.missions.draft import MissionDraft, VehicleDraft
from tui_gcs.core.missions.draft_file import SavedDraft, to_bytes
from tui_gcs.core.scenario.load import parse

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
    assert re.search(r"note    r: defend: 4 planned: [\d.]+ s worst, [\d.]+ x bound, separation [\d.]+ x\n", out)
    assert re.search(r"r: defend and attack: separation 1\.\d\d x after \d+ s at \[\d+ \d+\] \([1-4] and [5-8]\):", out)
    assert "note    preview: planned at once for ArduPilot, up to 1.1 m beside its course (--autopilot)\n" in out
    assert main(["check", "a.toml", "--preview", "--autopilot", "px4"]) == 0
    assert "planned at once for PX4, up to 1.25 m beside its course" in capsys.readouterr().out
    Path("b.kml").write_text("<kml/>")
    assert main(["check", "b.kml", "--preview"]) == 2


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
    for role, told in (("defend", True), ("no-fly", False)):
        text = SCENARIO.read_text()
        Path("a.toml").write_text(text.replace("[[round.zone]]", more.format(role) + "[[round.zone]]", 1))
        main(["check", "a.toml"])
        assert ("no team serves spare: nobody flies there" in capsys.readouterr().out) is told


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
    told = json.loads(capsys.readouterr().out)
    assert told["ok"] is False and told["findings"][0] == {
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
    assert "caution SYSID_THISMAV says who a vehicle is" in out and "note    MIS_TOTAL is reckoned" in out


def test_what_cannot_be_read_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.plan").write_text("{")
    for name in ("a.plan", "gone.plan", "gone.toml"):
        assert main(["check", name]) == 2
        error = capsys.readouterr().err
        assert name in error and error.count("\n") == 1
