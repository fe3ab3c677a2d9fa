"""A link over which a vehicle is heard and not reached is alarmed, by link and vehicle, until the vehicle answers."""

import random
from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.launch.fleet import AUTOPILOTS, SimFleet
from tests.core.rigs.wires import Wire, Wired
from tui_gcs.core.fleet.identity.path import Path, PathState
from tui_gcs.core.mavlink.frames import cut_datagram, decode
from tui_gcs.core.mavlink.sources import Slot, Source, Stream
from tui_gcs.core.services.timesync import ASK_GAP_S
from tui_gcs.core.services.up_ways import ANSWER_S, MIN_MISSED, UpWay, missing_for_certain
from tui_gcs.rehearsal.lock_step import TOKEN

MakeWired = Callable[..., Wired]
HOUR = round(3600 / ASK_GAP_S)
"""Requests of an hour."""
FRAMES_PER_S = 8
"""As few as a vehicle sends that shares a telemetry radio."""


class Air:
    """One path with loss both ways, and the requests that are sent over it; a virtual clock in steps of a request."""

    def __init__(self, down: float, up: float, seed: int) -> None:
        source = Source("", "near", ("vehicle", 1))
        self.stream = Stream(source)
        self.path = Path(source, PathState.USED, 0.0, streams=[self.stream], autopilot_stream=self.stream)
        self.slot = Slot(self.stream, 1, 1, 0)
        self.path.slots[0] = self.slot
        self.way = UpWay(self.path)
        self.down, self.up, self.chance = down, up, random.Random(seed)
        self.now = 0.0

    def ask(self) -> "Air":
        """Send one request, and pass the time to the next one."""
        number = round(self.now * 1e9)
        self.way.ask(number, self.now)
        answered = self.chance.random() >= self.up and self.chance.random() >= self.down
        if answered:
            self.way.answer(number)
        for _ in range(round(ASK_GAP_S * FRAMES_PER_S)):
            if self.chance.random() < self.down:
                self.stream.lost += 1
            else:
                self.slot.count += 1
        self.now += ASK_GAP_S
        self.stream.last_heard_s = self.now - 0.1
        self.way.settle(self.now)
        return self


@given(st.floats(0.0, 0.4), st.integers(0, 2**32))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_an_hour_of_any_loss_both_ways_is_no_dead_way_up(loss: float, seed: int) -> None:
    air = Air(loss, loss, seed)
    assert not any(air.ask().path.up_way_dead for _ in range(HOUR))


@given(st.floats(0.0, 0.4), st.floats(0.0, 0.4), st.integers(0, 2**32))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_a_way_up_that_is_worse_than_the_way_down_is_learned(down: float, up: float, seed: int) -> None:
    air = Air(down, 0.0, seed)
    for step in range(60):  # it grows in five minutes
        air.up = up * step / 60
        air.ask()
    assert not any(air.ask().path.up_way_dead for _ in range(HOUR))


@pytest.mark.parametrize(("loss", "seconds"), [(0.0, 20.0), (0.02, 40.0), (0.1, 70.0), (0.33, 200.0)])
@pytest.mark.parametrize("seed", range(20))
def test_a_dead_way_up_is_found_the_sooner_the_better_the_link_was(loss: float, seconds: float, seed: int) -> None:
    air = Air(loss, loss, seed)
    for _ in range(60):
        air.ask()
    air.up, died_s = 1.0, air.now
    while not air.path.up_way_dead:
        assert air.ask().now - died_s <= seconds
    air.up = air.down = 0.0
    assert not air.ask().path.up_way_dead


def test_no_answer_is_missing_while_the_vehicle_is_not_heard() -> None:
    air = Air(0.0, 1.0, 1)
    for _ in range(2):
        air.ask()
    air.way.ask(99, air.now)
    air.way.settle(air.now + ANSWER_S)
    assert air.way.missed == 2 and not air.path.up_way_dead


@pytest.mark.parametrize(("chance", "count"), [(0.001, 3), (0.02, 4), (0.09, 6), (0.36, 14), (0.55, 24)])
def test_how_many_missing_answers_are_no_chance(chance: float, count: int) -> None:
    assert missing_for_certain(chance) == count
    assert chance**count <= 1e-6 < chance ** (count - 1) or count == MIN_MISSED


# ---------------------------------------------------------------- a whole station


def alarmed(flight: Wired) -> list[tuple[str, tuple[int, ...], str]]:
    alarms = [alarm for alarm in flight.station.alarms.alarms() if alarm.state != "over"]
    return [(a.cause, a.vehicles, a.text) for a in alarms if a.cause in ("up-way", "unreached")]


def is_request(data: bytes) -> bool:
    """Whether it is a TIMESYNC request of ours."""
    messages = [decode(frame) for frame in cut_datagram(data).frames]
    return any(message and message.name == "TIMESYNC" and message.fields["tc1"] == 0 for message in messages)


def of_kind(flight: Wired, autopilot: str) -> Wired:
    """Its vehicles have another autopilot."""
    flight.sim = SimFleet([replace(spec, autopilot=autopilot) for spec in flight.sim.specs], seed=1, token=TOKEN)
    flight.fleets = [flight.sim]
    return flight


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize(
    ("names", "dead", "cause"),
    [(("near",), 0, "unreached"), (("near", "far"), 0, "up-way"), (("near", "far"), 1, "up-way")],
)
def test_a_dead_way_up_is_alarmed_until_it_answers(
    wired: MakeWired, names: tuple[str, ...], dead: int, cause: str, autopilot: str
) -> None:
    flight = of_kind(wired(1, wires=[Wire(name) for name in names]), autopilot).run(60.0)
    assert alarmed(flight) == []
    flight.wires[dead].loses = lambda way, data: way == "down"
    assert flight.until(lambda: alarmed(flight) == [(cause, (1,), f"over {names[dead]}")], 60.0) <= 30.0
    flight.run(60.0)
    assert alarmed(flight) == [(cause, (1,), f"over {names[dead]}")]
    flight.wires[dead].loses = lambda way, data: False
    assert flight.until(lambda: alarmed(flight) == [], 60.0) <= 15.0


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_orders_leave_over_the_link_on_which_they_arrive(wired: MakeWired, autopilot: str) -> None:
    flight = of_kind(wired(1, wires=[Wire("near"), Wire("far")]), autopilot)
    flight.run(30.0)
    vehicle = flight.station.picture.fleet.vehicles[1]
    dead, lives = vehicle.link, {"near": "far", "far": "near"}[vehicle.link]
    wire = flight.wires[[wire.name for wire in flight.wires].index(dead)]
    wire.loses = lambda way, data: way == "down"
    assert flight.until(lambda: vehicle.link == lives, 60.0) <= 30.0
    flight.run(60.0)
    assert vehicle.link == lives  # the path that only hears is not taken again, however fresh
    wire.loses = lambda way, data: False
    flight.run(60.0)
    flight.wires[1 - flight.wires.index(wire)].up = False
    assert flight.until(lambda: vehicle.link == dead, 5.0) <= 2.0


def test_where_no_order_arrives_the_link_does_not_change(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("near"), Wire("far")])
    flight.run(30.0)
    vehicle = flight.station.picture.fleet.vehicles[1]
    for wire in flight.wires:
        wire.loses = lambda way, data: way == "down"
    flight.until(lambda: [cause for cause, *_ in alarmed(flight)] == ["unreached"], 60.0)
    used = vehicle.link
    for _ in range(60):
        flight.run(1.0)
        assert vehicle.link == used


def test_a_vehicle_is_asked_once_in_five_seconds_over_all_its_links(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("near"), Wire("far")]).run(60.0)
    since_s = flight.clock.now()
    flight.wires[1].loses = lambda way, data: way == "down"
    flight.run(120.0)
    asked = [wire for wire in flight.wires for t, data in wire.seen if t > since_s and is_request(data)]
    assert 22 <= len(asked) <= 24
    assert len({wire.name for wire in asked}) == 2


def test_a_link_that_is_silent_is_lost_and_not_alarmed_twice(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("near")]).run(60.0)
    flight.wires[0].up = False
    flight.run(60.0)
    assert alarmed(flight) == []


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(0, marks=pytest.mark.long),
        pytest.param(1, marks=pytest.mark.endurance),
        pytest.param(2, marks=pytest.mark.endurance),
    ],
)
def test_an_hour_on_a_link_that_loses_a_third_both_ways(wired: MakeWired, seed: int) -> None:
    chance = random.Random(seed)
    flight = wired(1, wires=[Wire("near", loses=lambda way, data: chance.random() < 0.33)])
    for _ in range(720):
        flight.run(5.0)
        assert alarmed(flight) == []
