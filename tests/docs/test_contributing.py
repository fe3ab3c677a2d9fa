"""CONTRIBUTING.md's lists of what to touch: each file and each hook is there, and for the example of a list no other
file of the product is needed."""

import re
from pathlib import Path

import pytest

from tests.docs.test_architecture import names_in

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| `([\w/.]+)` \| (?:`?([\w.]+)`?)? ?\| ?(.*?) ?\|$", re.MULTILINE)
EXAMPLES = {
    "planner": r"\bplanner\.waypoints\b|^class Waypoints\b",
    "telemetry value": r"\bbattery_v\b",
    "screen": r'\bJournalScreen\b|\bJOURNAL_ACTIONS\b|action\(\s*"show_journal"',
    "request": r"\bSetParameters\b",
    "autopilot quirk": r"\bhome_inside\b",
}
"""What the example of each list is found by in the sources."""
NOT_IN_THE_EXAMPLE = {
    "telemetry value": {"tui_gcs/core/rates/message_sets.py"},
    "autopilot quirk": {f"tui_gcs/core/firmware/{name}.py" for name in ("base", "ardupilot", "px4", "multicopter")},
}
"""Files that only other additions of the same kind need."""


def rows(name: str) -> list[tuple[str, str, str]]:
    """(file, hook, why) of one list."""
    part = TEXT.split(f"<!-- list: {name} -->")[1].split("<!-- end -->")[0]
    found = ROW.findall(part)
    assert len(found) == part.count("\n| `"), "a row that cannot be read"
    return found


def test_every_list_has_an_example() -> None:
    assert re.findall(r"<!-- list: (.*) -->", TEXT) == list(EXAMPLES)


@pytest.mark.parametrize("name", EXAMPLES)
def test_each_file_of_a_list_has_what_is_to_be_extended(name: str) -> None:
    for path, hook, _ in rows(name):
        assert (ROOT / path).is_file(), path
        if hook:
            there = names_in(path) if path.endswith(".py") else (ROOT / path).read_text(encoding="utf-8")
            assert hook in there, f"{path}: {hook}"


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_example_needs_exactly_the_files_of_its_list(name: str) -> None:
    example = re.compile(EXAMPLES[name], re.MULTILINE)
    found = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "tui_gcs").rglob("*.py")
        if example.search(path.read_text(encoding="utf-8"))
    }
    listed = {path for path, _, _ in rows(name) if path.startswith("tui_gcs/")} - NOT_IN_THE_EXAMPLE.get(name, set())
    assert found == listed


def test_each_make_target_that_is_named_is_there() -> None:
    targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    assert set(re.findall(r"`make (\w+)", TEXT)) <= targets
