"""Vehicles change teams while they fly: an edit of the scenario moves them, and nothing else about them."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.core.rigs.rig import Rig, toml
from tui_gcs.core.process.state_store import StateStore
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Intent, Phase
from tui_gcs.core.scenario.load import parse

MakeRig = Callable[..., Rig]

MOVED = toml().replace("vehicles = [1, 2, 3, 4]", "vehicles = [1, 2, 3]").replace("[5, 6, 7, 8]", "[4, 5, 6, 7, 8]")


def apply(flight: Rig, text: str) -> m.Reply:
    return flight.ask(m.ApplyScenario(base_revision=flight.station.active.revision, toml=text))


def on_slots(flight: Rig) -> dict[str, tuple[int, int]]:
    controllers = flight.station.active.team_controllers
    return {
        name: (controller.on_slot(), len(flight.station.flight.flights.members(name)))
        for name, controller in controllers.items()
    }


@pytest.mark.long
def test_a_defender_goes_over_to_the_attackers_and_both_teams_patrol_on(rig: MakeRig) -> None:
    flight = rig(8, wants=None).flying()
    flight.until(lambda: on_slots(flight) == {"defend": (4, 4), "attack": (4, 4)}, 90.0, "all on slot")
    layer_m = flight.station.flight.flights.by_id[4].layer_m
    reply = apply(flight, MOVED)
    assert reply.ok and reply.text == "scenario applied; vehicle 4 to attack"
    flight.until(lambda: on_slots(flight) == {"defend": (3, 3), "attack": (5, 5)}, 90.0, "all on their new slots")
    flight.run(30.0)
    assert flight.phases() == {Phase.FLYING}
    assert flight.station.flight.guard.vetoes == {}, "nobody was told anything by a planner that is not its own"
    assert flight.station.flight.flights.by_id[4].layer_m == layer_m
    assert abs(flight.place(4)[2] - layer_m) < 1.5
    assert flight.ask(m.Return()).ok
    flight.until(lambda: not flight.sim.armed.any(), 200.0, "all landed")


def test_until_its_new_planner_speaks_it_ends_its_course_and_its_old_one_moves_it_no_more(rig: MakeRig) -> None:
    flight = rig(8, planning=False).flying()
    old = flight.station.active.team_controllers["defend"].task
    assert old is not None
    flight.plan(*[Intent(v, "goto", position_m=(200.0 + 20.0 * v, 200.0, old.layers_m[v])) for v in old.members])
    course = flight.station.flight.flights.by_id[4].course
    assert course is not None and apply(flight, MOVED).ok
    flight.plan(Intent(4, "goto", position_m=(100.0, 100.0, old.layers_m[4])), revision=old.revision)
    assert flight.station.flight.flights.by_id[4].course is course
    assert flight.station.flight.guard.vetoes == {}, "a plan that was on its way is no fault"
    new = flight.station.active.team_controllers["attack"].task
    assert new is not None and new.members == (4, 5, 6, 7, 8) and new.layers_m[4] == old.layers_m[4]
    flight.plan(Intent(4, "goto", position_m=(400.0, 200.0, old.layers_m[4])), team="attack")
    flight.run(1.8)
    assert flight.speed(4) > 2.0


FREE = re.sub(r"\nvehicle = \d", "", toml()) + "\n[[place]]\nplace_m = [65.0, 230.0]\nlayer_m = 83.0\n"
"""Places that anybody may have, and one more than is needed."""


@pytest.mark.long
@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("[1, 2, 3, 4]", "[1, 2, 3]", "vehicle 4 would be in no team, and is not on the ground"),
        ("[1, 2, 3, 4]", "[1, 2, 3, 4, 9]", "vehicle 9 has no take-off place of its own"),
        ("vehicles = [1, 2, 3, 4]", "count = 4", "how many vehicles a team has cannot change in flight: name them"),
        ('name = "defend"\nzone', 'name = "shield"\nzone', "teams cannot be added, removed or renamed in flight"),
    ],
    ids=["nowhere", "from nowhere", "by count", "renamed"],
)
def test_what_would_leave_somebody_without_a_team_or_a_place_is_refused(
    rig: MakeRig, old: str, new: str, told: str
) -> None:
    assert old in FREE
    flight = rig(mission=parse(FREE)).flying()
    before = {f.vehicle: f.team for f in flight.station.flight.flights}
    reply = apply(flight, FREE.replace(old, new))
    assert not reply.ok and reply.text == f"not applied: {told}"
    assert {f.vehicle: f.team for f in flight.station.flight.flights} == before


def test_a_layer_outside_the_other_zones_band_is_refused_by_name(rig: MakeRig) -> None:
    flight = rig(8).flying()
    name = flight.station.active.team_controllers["attack"].team.zone
    zone = f'name = "{name}"\n'
    low = flight.station.flight.flights.by_id[4].layer_m
    banded = MOVED.replace(zone, f"{zone}alt_min_m = {low + 1.0}\nalt_max_m = 90.0\n", 1)
    reply = apply(flight, banded)
    assert [(r.vehicle, "is outside" in r.text) for r in reply.results] == [(4, True)]


def test_a_restarted_station_knows_who_went_over(rig: MakeRig, tmp_path: Path) -> None:
    flight = rig(8).flying()
    assert apply(flight, MOVED).ok
    StateStore(tmp_path / "memory.json").remember(flight.station.parts, flight.station.frontend)
    flight.restart_station(StateStore(tmp_path / "memory.json"))
    assert flight.station.flight.flights.members("attack") == (4, 5, 6, 7, 8)
