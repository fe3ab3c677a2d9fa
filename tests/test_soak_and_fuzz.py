"""The commands that run for hours work: each is run for seconds, and what makes them fail is tried."""

import pytest

from tests import fuzz, soak
from tests.soak import Look, growth_mb_h, problems_of


def looks(*, hours: float, mb_h: float = 0.0, files: int = 40, more_files: int = 0) -> list[Look]:
    """One look a minute; the memory grows by `mb_h` after 10 MB in the first hour."""
    count = round(60 * hours)
    grown = [10.0 * min(k / 60, 1.0) + mb_h * max(k / 60 - 1.0, 0.0) for k in range(count + 1)]
    return [Look(k / 60, 80.0 + mb, files + more_files * k // count, 8) for k, mb in enumerate(grown)]


def test_a_soak_that_went_well() -> None:
    assert problems_of(looks(hours=24.0, mb_h=0.9, more_files=4), heard_at_end=8, alive=True) == []
    assert problems_of(looks(hours=0.5, mb_h=9.0), heard_at_end=8, alive=True) == [], "the first hour is not judged"


def test_what_makes_a_soak_fail() -> None:
    assert growth_mb_h(looks(hours=3.0, mb_h=1.5)) == pytest.approx(1.5)
    assert problems_of(looks(hours=3.0, mb_h=1.5), heard_at_end=8, alive=True) == ["memory grew by 1.50 MB/h"]
    assert problems_of(looks(hours=3.0, more_files=5), heard_at_end=8, alive=True) == ["5 more files are open"]
    assert problems_of(looks(hours=3.0), heard_at_end=7, alive=True) == ["7 of 8 vehicles are heard at the end"]
    dead = [*looks(hours=2.0), Look(2.02, 0.0, 0, 0)]
    assert problems_of(dead, heard_at_end=8, alive=False) == ["the station died"]


@pytest.mark.long
@pytest.mark.process
def test_a_soak_of_seconds(capsys: pytest.CaptureFixture[str]) -> None:
    assert soak.main(3.0 / 3600.0) == 0
    first, *_, last = capsys.readouterr().out.splitlines()
    assert first.endswith("8 heard")
    assert last.startswith("memory +0.00 MB/h after the first hour, ")


@pytest.mark.process
def test_a_round_of_fuzzing(capfd: pytest.CaptureFixture[str]) -> None:
    assert fuzz.main(0.0, "well_made") == 0
    assert "1 rounds, 0.00 h to go" in capfd.readouterr().out


@pytest.mark.process
def test_a_failed_round_ends_it_and_names_its_seed(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fuzz.time, "time", lambda: 77.0)
    assert fuzz.main(1.0, "no case has this name") == 1
    assert "FAILED with FUZZ_SEED=77 after 0 rounds" in capfd.readouterr().out
