"""`tui-gcs planner …`: as a researcher types it; mistakes of hers are one line, and a planner may hang or crash."""

from collections.abc import Callable
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest
from msgspec.structs import replace

from tests.planner.rigs import bad_planners as bad
from tests.rigs.reports import report_of
from tui_gcs.cli.main import command_line_parser, main
from tui_gcs.cli.planner import check as planner_check
from tui_gcs.cli.planner import check_flights
from tui_gcs.cli.planner import list as planner_list
from tui_gcs.planner import api
from tui_gcs.planner.check.subject import checked_planner
from tui_gcs.planner.check.suite import CHECKS
from tui_gcs.planner.patrol.patrol import Patrol
from tui_gcs.planner.runtime import registry
from tui_gcs.planner.runtime.planner_file import load_file

Tell = Callable[..., tuple[int, str, str]]


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def tell(capsys: pytest.CaptureFixture[str]) -> Tell:
    """tell(words…): exit code, stdout, stderr."""

    def run(*words: str) -> tuple[int, str, str]:
        code = main(["planner", *words])
        out = capsys.readouterr()
        assert "Traceback" not in out.out + out.err
        return code, out.out, out.err

    return run


# ---------------------------------------------------------------- new


def test_a_new_planner_is_short_and_loads(tell: Tell, here: Path) -> None:
    code, out, _ = tell("new", "star-fish")
    assert code == 0
    assert "tui-gcs planner check star_fish.py" in out
    assert f"the top of {api.__file__}\n" in out
    assert len((here / "star_fish.py").read_text().splitlines()) <= 40
    assert load_file(here / "star_fish.py").name == "star-fish"


def test_what_is_there_is_not_overwritten(tell: Tell, here: Path) -> None:
    (here / "mine.py").write_text("precious")
    code, _, err = tell("new", "mine")
    assert (code, err.count("\n")) == (2, 1)
    assert "is there already" in err
    assert (here / "mine.py").read_text() == "precious"


@pytest.mark.parametrize(
    "name", ["", "Mine", "9lives", "a b", "../mine", "x" * 40, "class", "json", "patrol", "mine.py"]
)
def test_names_that_cannot_be_are_told(name: str, tell: Tell, here: Path) -> None:
    code, _, err = tell("new", name)
    assert (code, err.count("\n")) == (2, 1)
    assert list(here.iterdir()) == []


def test_a_folder_that_is_not_there_is_told(tell: Tell) -> None:
    code, _, err = tell("new", "mine", "--dir", "nowhere")
    assert code == 2 and "cannot be written (No such file or directory)" in err


# ---------------------------------------------------------------- list


def test_known_planners_and_what_can_be_set(tell: Tell) -> None:
    code, out, _ = tell("list")
    assert code == 0
    assert f"patrol {Patrol.version}  5 Hz  (built in)" in out
    assert "margin_m          0.0 m       0 … 5" in out
    report = report_of(tell("list", "--json")[1], "planner list")
    rows = {row["name"]: row for row in report["data"]["planners"]}
    margin = next(p for p in rows["patrol"]["parameters"] if p["name"] == "margin_m")
    assert (margin["default"], margin["unit"], margin["maximum"]) == (0.0, "m", 5.0)


def test_a_broken_package_is_shown_with_its_reason(tell: Tell, monkeypatch: pytest.MonkeyPatch) -> None:
    points = [EntryPoint("sinker", "no_such_module:Sinker", registry.GROUP)]
    for module in (registry, planner_list):
        monkeypatch.setattr(module, "entry_points", lambda **_: points)
    code, out, _ = tell("list")
    assert code == 1
    assert "sinker" in out and "BROKEN" in out and "No module named 'no_such_module'" in out
    assert f"patrol {Patrol.version}" in out


# ---------------------------------------------------------------- check


def check(tell: Tell, source: str, *words: str) -> tuple[int, str]:
    Path("mine.py").write_text(source)
    code, out, err = tell("check", "mine.py", "--quick", *words)
    assert err == ""
    return code, out


@pytest.mark.long
def test_the_new_planner_passes_every_check_and_flies(tell: Tell) -> None:
    tell("new", "mine")
    code, out, err = tell("check", "mine.py", "--quick")
    assert (code, err) == (0, ""), out
    assert out.endswith("mine.py: everything holds\n")
    for told in ("ok    restart", "ok    flight         separation", "a hang: all hold", "garbage intents for 12 s"):
        assert told in out


@pytest.mark.long
@pytest.mark.parametrize("name", ["mine.py", "waypoints"])
def test_the_new_planner_and_strips_fly_all_rounds_without_a_veto(
    name: str, tell: Tell, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`--quick` flies only the first round. Each is measured for a minute: what is new happens at its beginning."""
    scenario, *rest = check_flights.read_scenario(None)
    briefly = replace(scenario, results=replace(scenario.results, measured_s=60.0))
    monkeypatch.setattr(check_flights, "read_scenario", lambda _: (briefly, *rest))
    tell("new", "mine")
    found = list(check_flights.shipped(checked_planner(name, 1, False, lambda: None)))
    assert [f for f in found if f.verdict == "FAIL"] == []
    assert [f.verdict for f in found if f.value.startswith("guard vetoes: 0 ")] == ["ok"]
    for round_ in scenario.rounds:
        assert any(f.value.startswith(round_.name) for f in found), round_.name


def test_one_that_is_wrong_fails_with_what_to_do(tell: Tell) -> None:
    code, out = check(tell, bad.BY_ID, "--only", "vehicle order", "--only", "fleet sizes")
    assert code == 1
    assert "FAIL  vehicle order" in out and "-> give places by where vehicles are" in out
    assert "ok    fleet sizes" in out
    assert out.endswith("mine.py: 1 FAIL\n")


@pytest.mark.long
def test_every_name_that_a_report_prints_can_be_asked_for(tell: Tell) -> None:
    _, out = check(tell, bad.GOOD, *(word for name in CHECKS for word in ("--only", name)))
    printed = {line[6:20].strip() for line in out.splitlines() if line[:5] in ("ok   ", "FAIL ", "note ")}
    assert printed >= {"loads", "other process", "memory"}
    for name in printed:
        assert planner_check.wanted_checks([name]) or name == "loads"


def test_loading_alone_and_what_another_check_finds(tell: Tell) -> None:
    assert check(tell, bad.GOOD, "--only", "loads")[1].splitlines()[0] == "ok    loads          class Mine of mine.py"
    assert "\nok    other process  " in check(tell, bad.GOOD, "--only", "other process")[1]


def test_the_same_as_json(tell: Tell) -> None:
    code, out = check(tell, bad.BY_ID, "--only", "vehicle order", "--json")
    report = report_of(out, "planner check")
    assert (code, report["ok"]) == (1, False)
    assert [(f["check"], f["verdict"]) for f in report["data"]["findings"]] == [
        ("loads", "ok"),
        ("vehicle order", "FAIL"),
    ]


def test_a_mistake_of_syntax_is_one_line_and_ends_it(tell: Tell) -> None:
    code, out = check(tell, "class Mine(\n")
    assert code == 1
    assert "FAIL  loads          mine.py:1: '(' was never closed" in out
    assert out.count("FAIL") == 2  # the line and the sum


def test_what_the_planner_prints_is_no_finding(tell: Tell) -> None:
    code, out = check(tell, "print('hello'); print('{')\n" + bad.GOOD, "--only", "flies")
    assert code == 0 and "hello" not in out


@pytest.mark.long
@pytest.mark.parametrize(
    ("source", "told"),
    [
        ("HANGS", "no sign of life for 3 s at mine.py:27 in step: it hangs"),
        ("CRASHES", "the process died of SIGSEGV at mine.py:26 in step"),
        ("EXITS", "the process ended with code 3"),
    ],
)
def test_a_planner_that_takes_its_process_down(
    source: str, told: str, tell: Tell, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(planner_check, "SILENT_S", 3.0)
    code, out = check(tell, getattr(bad, source))
    assert code == 1
    assert f"FAIL  flies          {told}" in out


@pytest.mark.parametrize(
    ("source", "told"),
    [
        (
            bad.source(after="len(rows) or __import__('os')._exit(0)"),
            "FAIL  fleet sizes    the process ended with code 0",
        ),
        ("__import__('os')._exit(0)\n" + bad.GOOD, "FAIL  loads          the process ended with code 0"),
    ],
    ids=["in a step", "while it is loaded"],
)
def test_who_ends_its_process_without_an_error_has_not_passed(source: str, told: str, tell: Tell) -> None:
    code, out = check(tell, source, "--only", "fleet sizes")
    assert code == 1 and told in out and out.endswith("mine.py: 1 FAIL\n")


@pytest.mark.long
def test_a_file_that_never_finishes_loading_is_told_with_its_line(tell: Tell, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(planner_check, "LOADING_SILENT_S", 4.0)
    code, out = check(tell, "\nwhile True: pass\n" + bad.GOOD)
    assert code == 1
    assert "FAIL  loads          does not finish loading within 4 s at mine.py:2\n" in out


def test_other_checks_go_on_where_one_takes_the_process_down(tell: Tell) -> None:
    source = bad.source(after="len(rows) or __import__('os')._exit(3)")  # without vehicles only
    code, out = check(tell, source, "--only", "flies", "--only", "fleet sizes", "--only", "step time")
    assert code == 1
    assert "FAIL  fleet sizes    the process ended with code 3" in out
    assert "ok    step time" in out


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("nowhere.py",), "there is no such file"),
        (("petrol",), "no planner of that name (there are: "),
        (("patrol", "--only", "taste"), "no check of that name; there are: loads, other process, declares, flies,"),
    ],
)
def test_what_cannot_be_checked_is_one_line(words: tuple[str, ...], told: str, tell: Tell) -> None:
    code, _, err = tell("check", *words)
    assert (code, err.count("\n")) == (2, 1)
    assert told in err


def test_every_action_explains_itself(capsys: pytest.CaptureFixture[str]) -> None:
    for action in ("new", "list", "check", "watch"):
        with pytest.raises(SystemExit):
            command_line_parser().parse_args(["planner", action, "--help"])
        assert "usage: tui-gcs planner" in capsys.readouterr().out
