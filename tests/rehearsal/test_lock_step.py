"""The whole system headless: simulator, station and planners in one process, round 1 of the shipped scenario."""

import json
from pathlib import Path

import msgspec
import pytest

from tui_gcs.core.scenario.load import load, parse
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.rehearsal.rehearse import rehearse

SHIPPED = Path(__file__).parents[2] / "tui_gcs" / "scenarios" / "swarm-challenge.toml"


@pytest.mark.endurance  # measured for a minute, and with what comes after it: tests/system/test_paper_mission.py
def test_round_1_of_the_shipped_scenario_holds_every_check(tmp_path: Path) -> None:
    result, problem = rehearse(load(SHIPPED), SHIPPED.read_text(), tmp_path, lambda share, headline: None, rounds=1)
    assert problem == ""
    assert [check for check in result.checks if not check.ok] == []
    assert [(r.round, r.zone, r.role, r.n) for r in result.rounds] == [
        ("round 1", "home", "defend", 4),
        ("round 1", "field", "attack", 4),
    ]
    for measured in result.rounds:
        assert measured.measured_s >= 180.0
        assert measured.coverage == 1.0
        assert measured.ratio is not None and 0.5 < measured.ratio <= 2.0


def short() -> Scenario:
    """Two vehicles over a small zone, measured for 20 s; a better tour is searched for in their first two seconds."""
    small = parse(SHIPPED.read_text().replace("radius_m = 80.0", "radius_m = 35.0"))
    team = msgspec.structs.replace(small.teams[0], vehicles=(1, 2), parameters={"search": 60})
    results = msgspec.structs.replace(small.results, measured_s=20.0)
    return msgspec.structs.replace(small, teams=(team,), places=small.places[:2], results=results)


def flown(folder: Path) -> tuple[bytes, bytes, str]:
    """The recording, the journal and the result of a short run."""
    folder.mkdir()
    heard: list[float] = []
    result, problem = rehearse(short(), "", folder, lambda share, headline: heard.append(share), rounds=1)
    assert problem == ""
    assert heard == sorted(heard) and heard[-1] == 1.0, "progress only grows"
    (measured,) = result.rounds
    assert measured.measured_s >= 20.0 and measured.coverage == 1.0
    assert measured.ratio is not None and measured.ratio > 0.5
    recording, journal = ((folder / log).read_bytes() for log in ("run.tlog", "run.jsonl"))
    return recording, journal, json.dumps(msgspec.to_builtins(result))


@pytest.mark.long
def test_the_same_seed_gives_the_same_run_byte_for_byte(tmp_path: Path) -> None:
    first = flown(tmp_path / "first")
    assert len(first[0]) > 100_000
    assert flown(tmp_path / "second") == first
