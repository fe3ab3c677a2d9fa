"""Every hostile input is judged by the same oracle."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.hostile.oracle import Oracle


@pytest.fixture
def attack(tmp_path: Path) -> Iterator[Callable[..., Oracle]]:
    """Makes a station under attack and its twin: `attack(2)` flies two vehicles. Each must end with `holds`."""
    made: list[Oracle] = []

    def make(vehicles: int = 2, **how: Any) -> Oracle:
        made.append(Oracle(tmp_path / str(len(made)), vehicles, **how))
        return made[-1]

    yield make
    for one in made:
        one.close()
    assert made, "this fixture is for attacks"
    assert all(one.judged for one in made), "no verdict"
