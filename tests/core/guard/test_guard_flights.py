"""No stream of random intents leads a simulated vehicle out of the area, into a no-fly zone, or into another vehicle.

The whole station in lock-step with the simulator, judged by where vehicles really are; see `wild`. Long runs:
python -m tests.bench guard.
"""

from pathlib import Path

import pytest

from tests.core.rigs.wild import Weather, run_wild

CALM = Weather(0.0, 0.0)


@pytest.mark.parametrize("autopilots", ["ardupilot", "px4", "mixed"])
@pytest.mark.parametrize(
    "seed", [pytest.param(1, marks=pytest.mark.long), pytest.param(2, marks=pytest.mark.endurance)]
)
def test_random_intents(tmp_path: Path, autopilots: str, seed: int) -> None:
    found = run_wild(tmp_path, seed, 12.0, autopilots, CALM)
    assert found.problems() == []
    assert found.flight.station.flight.guard.vetoes.total() > 0, "there was something to refuse"


@pytest.mark.parametrize(
    "seed", [pytest.param(11, marks=pytest.mark.long), pytest.param(12, marks=pytest.mark.endurance)]
)
def test_random_intents_with_losses_and_changes_of_round(tmp_path: Path, seed: int) -> None:
    assert run_wild(tmp_path, seed, 12.0, "mixed", CALM, trouble=True).problems() == []


@pytest.mark.long
def test_random_intents_in_the_wind(tmp_path: Path) -> None:
    assert run_wild(tmp_path, 21, 12.0, "mixed", Weather(6.0, 0.3), trouble=True).problems() == []
