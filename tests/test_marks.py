"""No test is lost between the commands: each is run by exactly one of `make test`, `flights`, `endurance` and `keys`.

In a run of all tests, as `make test`, this sees all of them, those of other commands too.
"""

import re
from pathlib import Path

import pytest

from tests.conftest import COLLECTED

ROOT = Path(__file__).parents[1]
COMMANDS = ("test", "flights", "endurance", "keys")
MARKS = ("long", "endurance", "by_keys")


def selections() -> dict[str, str]:
    """The mark expression of each command of the Makefile that runs tests."""
    text = (ROOT / "Makefile").read_text()
    recipes = re.findall(r"^(\w+): .*\n((?:\t.*\n)+)", text, re.MULTILINE)
    found = {name: re.search(r" -m (?:'([^']+)'|(\w+))$", recipe, re.MULTILINE) for name, recipe in recipes}
    return {name: match[1] or match[2] for name, match in found.items() if match is not None and name in COMMANDS}


def test_each_test_is_run_by_exactly_one_command(request: pytest.FixtureRequest) -> None:
    chosen = selections()
    assert tuple(sorted(chosen)) == tuple(sorted(COMMANDS))
    collected = request.config.stash[COLLECTED]
    for item in collected:
        has = {mark: item.get_closest_marker(mark) is not None for mark in MARKS}
        runs = [name for name, expression in chosen.items() if eval(expression, {}, has)]
        assert len(runs) == 1, f"{item.nodeid} is run by {runs}"


def test_a_run_of_one_mark_finds_it_in_the_text_of_each_file(request: pytest.FixtureRequest) -> None:
    """Such a run imports only the files in which the mark is written out (conftest.py)."""
    for item in request.config.stash[COLLECTED]:
        for mark in MARKS:
            if item.get_closest_marker(mark) is not None:
                assert f"mark.{mark}" in item.path.read_text(encoding="utf-8"), item.nodeid
