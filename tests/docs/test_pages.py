"""The manual and the README: what they tell a reader to type is understood, and what they show works.

A block of commands has a mark before it. `<!-- run -->`: it is run here. `<!-- long -->`: it takes minutes or needs a
terminal. `<!-- hardware -->`: it needs vehicles, or installs something. All of them are parsed by the real parser.
Blocks of Python are whole planner files, which are loaded and flown; those of TOML are read.
"""

import importlib.util
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

from tui_gcs.actions.orders import ORDERS
from tui_gcs.actions.scopes import SCOPES
from tui_gcs.cli.installation.general_options import commands
from tui_gcs.cli.main import command_line_parser
from tui_gcs.client.user_settings import SETTINGS, problem_of
from tui_gcs.core.alarms.causes import CAUSES
from tui_gcs.planner.check.declarations import declares, flies
from tui_gcs.planner.check.subject import checked_planner

ROOT = Path(__file__).parents[2]
README = ROOT / "README.md"
PAGES = [
    README,
    *sorted(p for p in (ROOT / "docs").rglob("*.md") if p.parent.name not in ("reference", "docs", "decisions")),
]
BLOCK = re.compile(r"(?:<!-- (\w+) -->\n)?```(\w*)\n(.*?)```", re.DOTALL)
PARSER = command_line_parser()
OTHERS = ("pip", "pipx", "make")
"""Programs beside ours that a page may name."""


def generator(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / f"docs/{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def blocks(path: Path, language: str) -> list[tuple[str, str]]:
    """(mark, text) of the blocks in a language."""
    return [(mark, text) for mark, kind, text in BLOCK.findall(path.read_text(encoding="utf-8")) if kind == language]


def typed(text: str) -> list[list[str]]:
    """The words of each line, without remarks, redirections and `&`."""
    lines = (shlex.split(re.sub(r"\s[>&]\s?\S*.*$", "", line), comments=True) for line in text.splitlines())
    return [words for words in lines if words]


def by_page(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("path", PAGES, ids=by_page)
def test_every_command_is_one(path: Path):
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    for mark, text in blocks(path, "bash"):
        assert mark in ("run", "long", "hardware") or path == README, text
        for words in typed(text):
            assert words[0] in ("tui-gcs", *OTHERS), words
            if words[0] == "make":
                assert words[1] in targets
            elif words[0] == "tui-gcs":
                PARSER.parse_args(words[1:])  # exits with a message if it is not understood


@pytest.mark.parametrize("path", [p for p in PAGES if "<!-- run -->" in p.read_text(encoding="utf-8")], ids=by_page)
def test_commands_that_are_marked_are_run(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("TUI_GCS_RUNTIME_DIR", str(tmp_path / "run"))
    for words in [words for mark, text in blocks(path, "bash") if mark == "run" for words in typed(text)]:
        command = [sys.executable, "-m", "tui_gcs", *words[1:]]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{words}: {done.stderr}"


PYTHON = [(path, text) for path in PAGES for _, text in blocks(path, "python")]
PLANNERS = [(path, text) for path, text in PYTHON if "(Planner):" in text and 'name = "' in text]


@pytest.mark.parametrize(("path", "text"), PYTHON)
def test_every_block_of_python_compiles(path: Path, text: str):
    compile(text, path.name, "exec")


@pytest.mark.parametrize(
    ("path", "text"), PLANNERS, ids=[re.findall(r'name = "(\w+)"', text)[0] for _, text in PLANNERS]
)
def test_every_planner_flies(path: Path, text: str, tmp_path: Path):
    file = tmp_path / "mine.py"
    file.write_text(text, encoding="utf-8")
    subject = checked_planner(str(file), 1, True, lambda: None)
    found = [*declares(subject), *flies(subject)]
    assert [finding for finding in found if finding.verdict == "FAIL"] == []


TASKS = {
    "fly/console": {
        "Hold everything": "start_stop hold_all",
        "Bring everything home": "return_all",
        "Land everything where it is": "land_all",
        "Hold, return or land some": "orders order:hold order:return order:land return_selected",
        "Fly on after a hold": "resume order:resume",
        "Press `Space` on the ground": "start_stop",
        "press `Esc` and `P`": "show_checks",
        "Fly another round": "choose_round",
        "the next vehicle, the one before": "select_next",
        "then `all`, `none`": "select",
        "go to a place": "orders order:go_to",
        "change altitude": "order:climb",
        "orbit a place": "order:circle",
        "follow another vehicle": "order:follow",
        "nudge": "order:nudge",
        "limit the speed": "order:speed",
        "take off, arm, disarm": "order:take_off order:arm order:disarm",
        "a mode of the autopilot": "order:mode",
        "fly the mission on board": "order:mission order:continue",
        "point the gimbal": "order:gimbal order:photo order:video order:video_stop",
        "back to its planner": "order:resume",
        "stop the motors": "order:kill",
        "`a` acknowledges it": "acknowledge",
        "lists all alarms": "show_alarms",
        "turns the bell": "toggle_bell",
        "another part of the map": "zoom_in fit",
        "always in view": "follow",
        "coordinates, distance": "cursor measure",
        "other things on the map": "layers grid dots",
        "as cells or as a table": "show_vehicles turn_view filter",
        "why a team performs": "show_planners",
        "what happened before": "show_journal of_selected",
        "parameters of the fleet": "show_parameters",
        "checks before a start": "show_checks",
        "the plan: zones": "show_plan",
        "the map again": "show_fly",
        "other colours": "next_theme redraw",
        "leaves the console": "detach",
    },
    "fly/when-things-break": {
        "`Space` holds all": "start_stop",
        "to hold all, or": "hold_all return_all",
        "gives it back to its planner, ": "orders order:resume",
        "brings it home. Or": "return_selected order:hold",
        "lets the planners go on": "resume return_all",
        "`M` shows why": "show_planners",
        "`J` shows which": "show_journal",
        "order WAYS MEET": "order:mission_meet",
        "which round and zones the station assumes": "show_plan",
        "lands it where it is": "order:land",
    },
    "plan/plan-screen": {
        "`e` to edit on the map": "move_on_map",
        "undoes": "undo redo",
        "applies it to the station": "apply save",
        "add a zone": "add_zone",
        "take zones from": "open",
        "copy a zone": "copy_zone",
        "add a round like this": "add_round delete_round",
        "add a team": "team_page add_zone",
        "change names": "settings",
        "`^R` shows all lines": "read_whole how_many",
        "opens missions, fences": "missions",
        "generate a survey": "generate",
        "choose mission, fence": "kind",
        "a polygon or a circle": "new_polygon new_circle",
        "send it to vehicles": "upload",
        "read what a vehicle holds": "download compare",
        "give it to other vehicles": "copy",
        "save all missions": "write",
        "sends again what failed": "again cancel",
    },
}
"""By page: words of a line, and the actions whose keys this line must name (`order:` for one of the menu of orders)."""


@pytest.mark.parametrize("page", TASKS)
def test_a_task_is_done_with_the_keys_that_its_page_names(page: str):
    keys: dict[str, set[str]] = {}
    for actions in SCOPES.values():
        for action in actions:
            if action.help and action.shown:
                keys.setdefault(action.id, set()).update({action.shown, *action.shown.replace("/", " ").split()})
    keys |= {f"order:{order.id}": {order.key} for order in ORDERS}
    paragraphs = re.split(r"\n(?=\||\d\.|\n)", (ROOT / f"docs/{page}.md").read_text(encoding="utf-8"))
    for words, actions in TASKS[page].items():
        found = [p for p in paragraphs if words in " ".join(p.split())]
        assert found, words
        named = set(re.findall(r"`([^`]+)`", " ".join(found)))
        for name in actions.split():
            assert named & keys[name], f"{words}: {name} is done with {sorted(keys[name])}"


def test_blocks_of_settings_and_scenarios_are_sound():
    texts = [(path, text) for path in PAGES for _, text in blocks(path, "toml")]
    assert len(texts) > 1
    for path, text in texts:
        content = tomllib.loads(text)
        if path.name == "install.md":
            assert [problem_of(key, value) for key, value in content.items()] == [""] * len(content)


def test_a_field_with_a_house_is_a_scenario(tmp_path: Path):
    page = ROOT / "docs/plan/scenario.md"
    (zone,) = [text for _, text in blocks(page, "toml") if "house" in text]
    file = tmp_path / "field.toml"
    run = [sys.executable, "-m", "tui_gcs"]
    new = [*run, "scenario", "new", str(file), "--vehicles", "12", "--teams", "1"]
    subprocess.run(new, check=True, capture_output=True)
    # A zone stands in the round, which ends where the teams begin.
    file.write_text(file.read_text(encoding="utf-8").replace("[[team]]", f"{zone}\n[[team]]", 1), encoding="utf-8")
    done = subprocess.run([*run, "check", str(file)], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
    assert "m2 in no-fly zone house: never seen" in done.stdout, "it is a hole: it lies in the field"


def test_the_readme_is_short():
    text = README.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 150
    assert len(text.split()) <= 1200
    assert "make test" in text


def test_the_reference_has_every_command_key_setting_and_exit_code():
    reference = generator("make_reference")
    pages = {name: make() for name, make in reference.PAGES.items()}
    for path, _ in commands(PARSER):
        if path:
            assert f"# tui-gcs {' '.join(path)}\n" in pages["cli.md"]
    assert all(
        f"`{action.id}`" in pages["keys.md"]
        for actions in reference.SCOPES.values()
        for action in actions
        if action.help and action.shown
    )
    assert all(f"`{key}`" in pages["settings.md"] for key in SETTINGS)
    assert all(f"`{cause.tag}`" in pages["alarms.md"] for cause in CAUSES)
    assert "[hold" not in pages["alarms.md"]
    assert "`no answer`" in pages["exit-codes.md"]
    assert "### FleetFrame" in pages["messages.md"]
    assert "| `home_spread_m` | `float ≥ 0, ≤ 1000` | `3.0` | How much" in pages["scenario.md"]


def test_the_manual_page_has_every_command():
    page = generator("make_reference").manual_page()
    assert page.startswith(".TH")
    for path, _ in commands(PARSER):
        assert not path or f".SS tui\\-gcs {' '.join(path)}".replace("-", "\\-").replace("\\\\-", "\\-") in page


def test_what_is_said_about_dependencies_is_in_the_table_of_platforms():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    page = (ROOT / "docs/reference/platforms.md").read_text(encoding="utf-8").lower()
    names = [re.match(r"[\w.-]+", line)[0] for line in project["dependencies"]]  # type: ignore[index]
    assert [name for name in names if f"| {name} |" not in page] == []
