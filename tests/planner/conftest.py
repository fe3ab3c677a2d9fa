"""The tests of planners share `flights.py`."""

import pytest

from tests.core.rigs.designs import once
from tests.planner.rigs.flights import swarm

__all__ = ["swarm"]


@pytest.fixture
def designed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """For tests of what is done with a tour, not of how it is found."""
    monkeypatch.setattr("tui_gcs.planner.patrol.patrol.begin_search", once)
