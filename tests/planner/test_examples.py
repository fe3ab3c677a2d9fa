"""The reference planners in `examples/planners`: each runs on every vehicle and centrally, and reaches its purpose."""

from pathlib import Path

import pytest

from tests.planner.rigs.example_flights import FOLDER, NAMES, ExampleFlight, planner_file, scenario_of
from tui_gcs.core.scenario.model import Communication
from tui_gcs.planner.runtime import registry
from tui_gcs.rehearsal.lock_step import FlightConditions, world_of_spec
from tui_gcs.rehearsal.rehearse import rehearse

FIVE_MINUTES_LINES = 140


@pytest.mark.parametrize("name", NAMES)
def test_an_example_is_one_short_file_with_declared_metrics_and_a_scenario(name: str) -> None:
    file = planner_file(name)
    info = registry.file_info(file.path, file.sha256)

    assert len(file.path.read_text().splitlines()) <= FIVE_MINUTES_LINES
    assert info.name == name
    assert info.metrics
    assert [team.planner for team in scenario_of(name).teams] == [name]


@pytest.mark.parametrize("name", NAMES)
def test_the_same_seed_gives_the_same_flight_bit_by_bit_with_losses(name: str) -> None:
    radio = Communication(range_m=60.0, loss=0.3, delay_s=0.2)
    flights = [ExampleFlight(name, "per_vehicle", 3, radio) for _ in range(2)]
    for flight in flights:
        flight.fly(8.0)

    assert flights[0].plans == flights[1].plans
    assert len(set(flights[0].plans)) > 10


def test_lloyd_with_a_perfect_radio_flies_as_its_central_form() -> None:
    central, each = (ExampleFlight("lloyd", form, 4, Communication()) for form in ("per_team", "per_vehicle"))
    figure_m = central.fly(15.0)

    assert each.fly(15.0) == pytest.approx(figure_m, rel=1e-6)
    assert each.metrics["mean_distance_m"] == pytest.approx(central.metrics["mean_distance_m"], rel=1e-6)


@pytest.mark.endurance
@pytest.mark.parametrize("name", NAMES)
def test_a_bad_radio_costs_little_and_none_at_all_costs_much(name: str) -> None:
    def figure(radio: Communication, form: str = "per_vehicle") -> float:
        return sum(ExampleFlight(name, form, seed, radio).fly() for seed in (21, 22)) / 2  # type: ignore[arg-type]

    central = figure(Communication(), "per_team")
    bad = figure(Communication(range_m=60.0, loss=0.3, delay_s=0.2))
    alone = figure(Communication(range_m=0.0))
    if name == "lloyd":  # metres: less is better
        assert bad <= 1.1 * central
        assert alone > 1.3 * bad
    else:
        assert bad >= 0.85 * central
        assert alone <= bad + 0.05


@pytest.mark.endurance
@pytest.mark.parametrize("name", NAMES)
def test_its_rehearsal_passes_every_gate(name: str, tmp_path: Path) -> None:
    scenario = scenario_of(name)
    text = (FOLDER / f"{name}.toml").read_text()
    conditions = FlightConditions()
    if name == "pursuit":
        from tui_gcs.core.scenario.intruder_waves import intruder_waves

        spec = {"intruders": intruder_waves(scenario, 3, 7), "sensor": {"range_m": 90.0}}
        conditions = FlightConditions(world=world_of_spec(spec))
    files = {name: planner_file(name)}
    result, problem = rehearse(scenario, text, tmp_path, lambda *_: None, conditions, files=files)

    assert problem == ""
    assert [check.name for check in result.checks if not check.ok] == []
