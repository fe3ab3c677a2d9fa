"""The paper's own mission in one flight: eight vehicles, three rounds switched live, losses, a killed station."""

import re
from pathlib import Path

import msgspec
import pytest

from tests.rehearsal.test_rehearse_weather import CALM_RATIO
from tui_gcs.core.scenario.load import load
from tui_gcs.rehearsal.fault_schedule import losses, restart
from tui_gcs.rehearsal.rehearse import rehearse
from tui_gcs.rehearsal.report.flight_recording import FlightRecord
from tui_gcs.rehearsal.report.page import page

SHIPPED = Path(__file__).parents[2] / "tui_gcs" / "scenarios" / "swarm-challenge.toml"
LOST_S, RESTART_S = 250.0, 450.0
"""Mission time: in round 2, and in round 3."""


@pytest.mark.long
def test_eight_vehicles_three_rounds_a_loss_and_a_killed_station(tmp_path: Path) -> None:
    shipped = load(SHIPPED)
    scenario = msgspec.structs.replace(shipped, results=msgspec.structs.replace(shipped.results, measured_s=60.0))
    records: list[FlightRecord] = []
    result, problem = rehearse(
        scenario,
        SHIPPED.read_text(),
        tmp_path,
        lambda share, text: None,
        faults=[*losses([f"6@{LOST_S:.0f}"]), *restart(RESTART_S)],
        watch=lambda bus, referee: records.append(FlightRecord(scenario, bus)),
    )
    assert problem == ""
    assert [check for check in result.checks if not check.ok] == []
    whole = [(r.round, r.zone, r.n) for r in result.rounds if not r.cut_short]
    assert whole == [
        ("round 1", "home", 4),
        ("round 1", "field", 4),
        ("round 2", "home", 4),
        ("round 2 (6 lost)", "field", 3),
        ("round 3 (after a hold)", "home", 4),
        ("round 3 (after a hold)", "field", 3),
    ]

    (record,) = records
    planned_s = {
        zone.zone.name: zone.metrics["predicted_worst_s"]
        for round_ in record.rounds
        for zone in round_.zones
        if round_.round.name == "round 1"
    }
    for measured in result.rounds[:2]:  # as long as nothing has failed, what is planned is flown
        assert measured.round == "round 1" and measured.worst_idleness_s is not None
        assert measured.worst_idleness_s <= CALM_RATIO * planned_s[measured.zone], measured.zone
    text = page(record, result, problem, conditions=[], happened=[(LOST_S, "vehicle 6 falls silent")])
    captions = re.findall(r"<figcaption>\((.)\) (round \d), T\+\d+ s: (.*?)</figcaption>", text)
    assert captions == [
        ("a", "round 1", "8 vehicles fly"),
        ("b", "round 2", "7 vehicles fly, 1 lost or left on the way"),
        ("c", "round 3", "7 vehicles fly"),
    ]
