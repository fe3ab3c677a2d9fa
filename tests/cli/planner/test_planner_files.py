"""`--planner FILE`: a planner of one's own flies; what is wrong with a file is one line; nobody else runs its code."""

import json
import os
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

import pytest

from tui_gcs.cli.common import (
    MAX_LOG_FOLDERS,
    bound_folders,
    new_folder,
    planner_files,
    read_planners,
    read_scenario,
    report_planners,
)
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.core.protocol.planning import ParamInfo
from tui_gcs.planner.runtime import describe
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.planner_errors import PlannerError
from tui_gcs.planner.runtime.registry import load

CIRCLE = """
import sys
print("loaded", file=sys.stdout)
from tui_gcs.planner.api import Intent, Output, Param, Planner


class Circle(Planner):
    name = "circle"
    version = "3"
    params = (Param("speed_m_s", float, 5.0, 1.0, 8.0, "m/s", "ground speed"),)

    def step(self, ctx):
        x, y = self.task.zone.shape.centre_m
        fleet = ctx.fleet
        return Output([Intent(int(i), "orbit", position_m=(x, y, z), radius_m=40.0, speed_m_s=5.0)
                       for i, z in zip(fleet.id[fleet.active], fleet.layer_m[fleet.active])])
"""
SCENARIO = Path(__file__).parents[3] / "tui_gcs/scenarios/swarm-challenge.toml"


@pytest.fixture
def circle(tmp_path: Path) -> Path:
    file = tmp_path / "circle.py"
    file.write_text(CIRCLE)
    return file


def flown_by(planner: str, folder: Path) -> Path:
    scenario = folder / "mine.toml"
    scenario.write_text(SCENARIO.read_text().replace('planner = "patrol"', f'planner = "{planner}"'))
    return scenario


def test_a_file_says_what_it_declares_and_is_not_run_here(circle: Path) -> None:
    before = set(sys.modules)
    info = read_planners([str(circle)])["circle"]
    assert (info.name, info.version, info.rate_hz) == ("circle", "3", 5.0)
    assert info.params == (ParamInfo("speed_m_s", "float", 5.0, 1.0, 8.0, "m/s", "ground speed"),)
    assert info.file == str(circle.resolve())
    assert info.sha256 == sha256(CIRCLE.encode()).hexdigest()
    assert not [name for name in set(sys.modules) - before if "tui_gcs_planner" in name]


@pytest.mark.parametrize(
    ("source", "told"),
    [
        ("def f(:\n", "circle.py:1: invalid syntax"),
        ("\n\nimport numpyy\n", "circle.py:3: ModuleNotFoundError: No module named 'numpyy'"),
        ("x = 1\n", "circle.py: defines no planner"),
        (
            CIRCLE.replace('"circle"', '"../circle"'),
            "circle.py: name = '../circle': must be 1 to 64 of A-Z a-z 0-9 _ -",
        ),
        (CIRCLE.replace('    name = "circle"\n', ""), "circle.py: name = '': must be"),
        (CIRCLE.replace('version = "3"', "rate_hz = 50"), "rate_hz 50 is not from 1 to 20"),
        (CIRCLE.replace("float, 5.0", "float, 9.0"), "the default of speed_m_s must be at most 8 m/s"),
        (CIRCLE.replace("float, 5.0", "list, 5.0"), "each is a Param of float, int, bool or str"),
        ("raise SystemExit(0)\n", "circle.py:1: SystemExit: 0"),
        ("import os\nos._exit(0)\n", "planners cannot be described"),
    ],
)
def test_what_is_wrong_with_a_file_is_one_line(circle: Path, source: str, told: str) -> None:
    circle.write_text(source)
    with pytest.raises(CommandError) as error:
        read_planners([str(circle)])
    assert told in str(error.value)
    assert str(error.value).startswith("--planner ") and "\n" not in str(error.value)


def test_a_file_that_does_not_end_loading_is_told(circle: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    circle.write_text("import time\ntime.sleep(60)\n")
    monkeypatch.setattr(describe, "LOAD_LIMIT_S", 0.5)
    with pytest.raises(CommandError, match="does not finish loading within"):
        read_planners([str(circle)])


def test_a_file_that_prints_without_end_is_told_and_fills_no_memory(
    circle: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import resource

    circle.write_text("import sys\nwhile True: sys.stderr.write('x' * 100_000)\n")
    monkeypatch.setattr(describe, "LOAD_LIMIT_S", 1.0)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(CommandError, match="does not finish loading within"):
        read_planners([str(circle)])
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000


def test_a_link_to_itself_is_told(tmp_path: Path) -> None:
    link = tmp_path / "me.py"
    link.symlink_to(link)
    with pytest.raises(CommandError, match=r"me.py: cannot be read"):
        read_planners([str(link)])


def test_two_files_of_one_name_are_refused(circle: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.py"
    other.write_text(CIRCLE)
    with pytest.raises(CommandError, match=r"other.py: planner 'circle' is in .*circle.py, too"):
        read_planners([str(circle), str(other)])


def test_a_scenario_names_the_planner_not_the_file(circle: Path, tmp_path: Path) -> None:
    planners = read_planners([str(circle)])
    assert read_scenario(str(flown_by("circle", tmp_path)), planners)[0].teams[0].planner == "circle"
    with pytest.raises(CommandError, match="circle"):
        read_scenario(str(flown_by("circle", tmp_path)))
    for wrong in ("circle.py", "./circle", "/tmp/circle.py"):
        with pytest.raises(CommandError, match=r"is a file; a scenario names planners only.*--planner FILE.py"):
            read_scenario(str(flown_by(wrong, tmp_path)), planners)


def test_a_file_that_changed_is_not_loaded(circle: Path) -> None:
    files = planner_files(read_planners([str(circle)]))
    assert load("circle", files).name == "circle"
    circle.write_text(CIRCLE + "# changed\n")
    with pytest.raises(
        PlannerError, match=r"circle.py: changed since the start \(sha256 [0-9a-f]{12}, was [0-9a-f]{12}\)"
    ):
        load("circle", files)
    assert PlannerHost("red", files).revision == -1


def test_a_file_takes_the_place_of_a_known_planner(circle: Path) -> None:
    circle.write_text(CIRCLE.replace('"circle"', '"patrol"'))
    files = planner_files(read_planners([str(circle)]))
    assert load("patrol", files).__name__ == "Circle"
    assert load("patrol").__name__ == "Patrol"


def test_the_known_planners_are_described_too() -> None:
    done = subprocess.run(describe.command(), capture_output=True, check=True)
    names = [info.name for info in describe.parse(done.stdout)]
    assert "patrol" in names


@pytest.mark.long
def test_a_lock_step_run_flies_a_file(circle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from tui_gcs.core.protocol import common as m
    from tui_gcs.core.protocol.bus import REQUEST
    from tui_gcs.rehearsal.lock_step import LockStep

    planners = read_planners([str(circle)])
    scenario, toml, _ = read_scenario(str(flown_by("circle", tmp_path)), planners)
    flight = LockStep(scenario, toml, tmp_path, files=planner_files(planners))

    def ask(request: m.AnyRequest) -> m.Reply:
        return m.decode(flight.bus.ask(REQUEST.format(principal="test"), m.encode(request)), m.Reply)

    try:
        for _ in range(20 * 120):
            flight.step()
            if flight.clock.now() > 8.0 and flight.station.flight.executive.run is m.RunPhase.IDLE:
                ask(m.Start(vehicles=tuple(range(1, 9))))
            courses = {type(f.course).__name__ for f in flight.station.flight.flights}
            if courses == {"Orbit"}:
                break
        assert courses == {"Orbit"}
        assert [info.name for info in ask(m.GetPlanners()).planners] == ["circle"]
    finally:
        flight.close()


def test_status_and_run_file_name_the_file(circle: Path) -> None:
    from tui_gcs.client.launcher import _builtins

    info = read_planners([str(circle)])["circle"]
    assert json.loads(json.dumps(_builtins(info)))["sha256"] == info.sha256


def test_a_file_that_flies_nobody_is_told_before_the_start(
    circle: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    planners = read_planners([str(circle)])
    for named, warned in (("circle", False), ("waypoints", True)):
        report_planners(planners, read_scenario(str(flown_by(named, tmp_path)), planners)[0])
        told = capsys.readouterr().err
        assert told.startswith(f"planner circle 3: {circle.resolve()}  sha256 ")
        assert ("WARNING: planner circle flies no vehicle" in told) is warned
        assert not warned or "(they say waypoints)" in told


@pytest.mark.long
def test_the_path_of_a_file_is_one_line_without_control_characters(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mine\n\x1b[31mred.py"
    with pytest.raises(CommandError) as missing:
        read_planners([str(file)])
    file.write_text(CIRCLE)
    planners = read_planners([str(file)])
    report_planners(planners, read_scenario(None)[0])
    with pytest.raises(CommandError) as twice:
        read_planners([str(file)] * 2)
    for told in (str(missing.value), str(twice.value), *capsys.readouterr().err.splitlines()):
        assert (told.isprintable() and "red.py" in told) or "WARNING" in told


def test_two_flights_of_one_second_have_folders_of_their_own(tmp_path: Path) -> None:
    assert [new_folder(tmp_path, "rehearsal-1").name for _ in range(3)] == [
        "rehearsal-1",
        "rehearsal-1-2",
        "rehearsal-1-3",
    ]
    with pytest.raises(FileNotFoundError):
        new_folder(tmp_path / "none", "rehearsal-1")


def test_logs_of_rehearsals_are_bounded_and_nothing_else_is_touched(tmp_path: Path) -> None:
    for day in range(1, MAX_LOG_FOLDERS + 4):
        folder = tmp_path / f"rehearsal-202611{day:02}-101500"
        folder.mkdir()
        (folder / "run.tlog").write_bytes(b"x")
        os.utime(folder, (day, day))
    others = ["rehearsal-mine", "headless-20261101-101500", "2026-11-01T10-15.tlog", "rehearsal-20261101-101500.html"]
    for name in others:
        (tmp_path / name).mkdir()
    (tmp_path / "rehearsal-20260101-101500").symlink_to(tmp_path / "rehearsal-mine")
    assert bound_folders(tmp_path, "rehearsal").endswith(": 3 older removed\n")
    left = {path.name for path in tmp_path.iterdir()}
    assert left >= {*others, "rehearsal-20260101-101500", "rehearsal-20261104-101500"}
    assert not left & {f"rehearsal-2026110{day}-101500" for day in (1, 2, 3)}
    assert bound_folders(tmp_path, "rehearsal") == ""
