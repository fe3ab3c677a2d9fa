"""The tests of planners share `flights.py`."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from flights import swarm

from tests.core.designs import once

__all__ = ["swarm"]


@pytest.fixture
def designed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """For tests of what is done with a tour, not of how it is found."""
    monkeypatch.setattr("tui_gcs.planner.patrol.patrol.begun", once)
