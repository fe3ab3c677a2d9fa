"""The tests of the core share `rig`: the whole system on a virtual clock."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest

from tests.core.rigs.designs import remembered
from tests.core.rigs.rig import Rig, scenario, toml
from tests.core.rigs.wires import Wired


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Callable[..., Rig]]:
    """Makes whole systems: `rig(3)` has three vehicles; `wants=None` uses the real planners.

    Each tour is designed once in a run of tests, also one for a task that changes in flight, and not searched on for.
    """
    made: list[Rig] = []

    def make(vehicles: int = 3, **options: Any) -> Rig:
        made.append(Rig(options.pop("mission", None) or scenario(vehicles), toml(), tmp_path, **options))
        return made[-1]

    with patch("tui_gcs.planner.patrol.patrol.begin_search", remembered):
        yield make
    for one in made:
        one.close()


@pytest.fixture
def wired(tmp_path: Path) -> Iterator[Callable[..., Wired]]:
    """Makes systems with several links: `wired(1, wires=[Wire("near"), Wire("far", delay_s=0.8)])`."""
    made: list[Wired] = []

    def make(vehicles: int = 1, **options: Any) -> Wired:
        made.append(Wired(options.pop("mission", None) or scenario(vehicles), toml(), tmp_path, **options))
        return made[-1]

    yield make
    for one in made:
        one.close()
