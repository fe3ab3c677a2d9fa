"""What consoles may ask, and why they are refused."""

from collections.abc import Callable

import msgspec
import pytest

from tests.core.rigs.rig import Rig, scenario, toml
from tui_gcs.core.geometry.zones import Circle, Rectangle
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import REQUEST
from tui_gcs.core.protocol.common import FleetFrame, Intent, Phase, PlannerTask, Reply
from tui_gcs.core.scenario.model import OperatingArea

MakeRig = Callable[..., Rig]


def raw(flight: Rig, payload: bytes, principal: str = "console-1") -> Reply:
    return m.decode(flight.bus.ask(REQUEST.format(principal=principal), payload), Reply)


def scenario_now(flight: Rig) -> m.ScenarioChanged:
    now = flight.ask(m.GetScenario()).scenario
    assert now is not None
    return now


def apply(flight: Rig, text: str, revision: int | None = None) -> Reply:
    return flight.ask(m.ApplyScenario(scenario_now(flight).revision if revision is None else revision, text))


# ---------------------------------------------------------------- first words


def test_hello_says_the_protocol_and_a_mismatch_is_one_clear_line(rig: MakeRig) -> None:
    flight = rig(1)
    assert flight.ask(m.Hello(protocol=m.PROTOCOL, who="console")).ok
    reply = flight.ask(m.Hello(protocol=99, who="console"))
    assert not reply.ok and reply.text == f"station speaks protocol {m.PROTOCOL}, you 99"


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"\x00",
        b"garbage",
        msgspec.msgpack.encode({"request": "self-destruct"}),
        msgspec.msgpack.encode({"request": "hold", "vehicles": "all"}),
        msgspec.msgpack.encode({"request": "hold", "vehicles": [1], "force": True}),
        msgspec.msgpack.encode({"request": "start"}),
    ],
    ids=lambda payload: payload[:12].hex(),
)
def test_bytes_that_are_no_request_are_refused_in_one_line_and_counted(rig: MakeRig, payload: bytes) -> None:
    flight = rig(1)
    reply = raw(flight, payload)
    assert not reply.ok and reply.text.startswith("request not understood")
    assert "\n" not in reply.text
    assert flight.station.conditions.dropped["request not understood"] == 1


@pytest.mark.parametrize("request_", [m.Start((1,)), m.Hold(), m.Resume(), m.Return(), m.Shutdown()])
def test_a_planner_worker_may_look_but_not_command(rig: MakeRig, request_: m.AnyRequest) -> None:
    flight = rig(1).ready()
    reply = flight.ask(request_, principal="planner-defend")
    assert not reply.ok and reply.text == "a planner worker may not command"
    assert flight.ask(m.GetTask(team="defend"), principal="planner-defend").task is not None
    assert flight.phases() == {Phase.GROUND} and not flight.station.conditions.ending


def test_who_commanded_last_is_shown_and_journalled(rig: MakeRig) -> None:
    flight = rig(1).ready()
    flight.ask(m.GetScenario(), principal="console-7")
    assert flight.station.frontend.requests.in_control == ""
    flight.ask(m.Start((1,)), principal="console-7")
    assert flight.station.frontend.requests.in_control == "console-7"
    assert "round 1 started: 1 vehicles (1)" in flight.texts("console-7")


def test_events_are_numbered_and_missed_ones_can_be_had(rig: MakeRig) -> None:
    flight = rig(1).ready()
    everything = flight.ask(m.GetEvents(after=0)).events
    assert [e.seq for e in everything] == list(range(1, len(everything) + 1))
    assert flight.ask(m.GetEvents(after=5)).events == everything[5:]
    assert flight.ask(m.GetEvents(after=10**6)).events == ()
    assert not flight.ask(m.GetTask(team="nobody")).ok


# ---------------------------------------------------------------- rounds


@pytest.mark.long
def test_a_round_cannot_start_while_a_vehicle_is_outside_its_area(rig: MakeRig) -> None:
    """Round 2 ends at x = 235: vehicle 2, at its place at x = 240, is named; vehicle 1 at 220 is not."""
    whole = scenario(2)
    small = OperatingArea(Rectangle(centre_m=(117.5, 200.0), width_m=235.0, height_m=400.0), 20.0, 90.0)
    rounds = (whole.rounds[0], msgspec.structs.replace(whole.rounds[1], area=small))
    flight = rig(mission=msgspec.structs.replace(whole, rounds=rounds)).flying().run(40.0)
    reply = flight.ask(m.SwitchRound(index=1))
    assert not reply.ok and reply.text == "round 2 not started: outside its operating area"
    assert [(r.vehicle, r.text) for r in reply.results] == [(2, "5 m outside")]
    assert flight.station.active.round_index == 0 and flight.phases() == {Phase.FLYING}
    flight.ask(m.Return())
    flight.run(15.0)
    assert not flight.ask(m.SwitchRound(index=1)).ok, "nor on the way home"


def test_a_round_whose_band_excludes_a_layer_names_its_vehicle(rig: MakeRig) -> None:
    whole = scenario(2)
    low = msgspec.structs.replace(whole.rounds[1].area, alt_max_m=30.0)
    rounds = (whole.rounds[0], msgspec.structs.replace(whole.rounds[1], area=low))
    flight = rig(mission=msgspec.structs.replace(whole, rounds=rounds)).flying()
    reply = flight.ask(m.SwitchRound(index=1))
    text = "its layer 34 m is outside 20-30 m, the band of zone home"
    assert [(r.vehicle, r.text) for r in reply.results] == [(2, text)]


@pytest.mark.parametrize("index", [-1, 3, 10**9])
def test_there_are_only_so_many_rounds(rig: MakeRig, index: int) -> None:
    reply = rig(1).ask(m.SwitchRound(index=index))
    assert not reply.ok and "there are 3" in reply.text


def test_no_round_is_switched_while_vehicles_climb(rig: MakeRig) -> None:
    flight = rig(1).ready()
    flight.ask(m.Start((1,)))
    assert flight.ask(m.SwitchRound(index=1)).text == "not while the fleet is starting"


# ---------------------------------------------------------------- scenario


def test_an_edit_is_applied_and_every_planner_gets_a_new_task(rig: MakeRig) -> None:
    flight = rig(8).ready()
    before = scenario_now(flight)
    reply = apply(flight, toml().replace("radius_m = 80.0", "radius_m = 60.0"))
    assert reply.ok and reply.scenario is not None and reply.scenario.revision > before.revision
    task = flight.ask(m.GetTask(team="defend")).task
    assert task is not None and task.zone.shape == Circle(centre_m=(150.0, 200.0), radius_m=60.0)
    assert "radius_m = 60.0" in scenario_now(flight).toml


def test_an_edit_of_what_has_changed_meanwhile_is_refused(rig: MakeRig) -> None:
    flight = rig(8)
    began = scenario_now(flight).revision
    assert apply(flight, toml().replace("radius_m = 80.0", "radius_m = 60.0")).ok
    reply = apply(flight, toml().replace("radius_m = 80.0", "radius_m = 70.0"), revision=began)
    assert not reply.ok and "has changed since you began to edit" in reply.text
    assert "radius_m = 60.0" in scenario_now(flight).toml


def test_another_round_is_not_another_scenario(rig: MakeRig) -> None:
    flight = rig(8)
    began = scenario_now(flight).revision
    assert flight.ask(m.SwitchRound(index=1)).ok
    assert apply(flight, toml().replace("radius_m = 80.0", "radius_m = 60.0"), revision=began).ok
    assert flight.station.active.round_index == 1


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("radius_m = 80.0", "radius_m = -80.0", "radius_m"),
        ("radius_m = 80.0", "radius_m = ", "line"),
        ('zone = "home"', 'zone = "hame"', "hame"),
        ("seed = 42", "sead = 42", "sead"),
    ],
)
def test_text_that_is_no_scenario_is_refused_with_the_reason(rig: MakeRig, old: str, new: str, says: str) -> None:
    flight = rig(8)
    reply = apply(flight, toml().replace(old, new))
    assert not reply.ok and says in reply.text
    assert scenario_now(flight).toml == toml()


def test_in_flight_places_may_be_written_in_another_order(rig: MakeRig) -> None:
    flight = rig(8).flying()
    before, first, *others = toml().split("[[place]]\n")
    assert apply(flight, "[[place]]\n".join([before, *others, "\n" + first])).ok
    assert {f.layer_m for f in flight.station.flight.flights} == {27.0 + 7.0 * i for i in range(8)}
    assert flight.phases() == {Phase.FLYING}


@pytest.mark.long
def test_in_flight_zones_may_change(rig: MakeRig) -> None:
    flight = rig(8).flying()
    assert apply(flight, toml().replace("radius_m = 80.0", "radius_m = 60.0")).ok
    flight.run(1.0)
    assert flight.phases() == {Phase.FLYING}


@pytest.mark.long
@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("lat_deg = 52.0720", "lat_deg = 52.0730", "the origin cannot change in flight"),
        ("layer_m = 27.0", "layer_m = 28.0", "layers cannot change in flight"),
        ('name = "attack"\nzone', 'name = "attackers"\nzone', "teams cannot be added, removed or renamed"),
    ],
)
def test_in_flight_places_layers_and_teams_may_not(rig: MakeRig, old: str, new: str, says: str) -> None:
    flight = rig(8).flying()
    assert old in toml()
    reply = apply(flight, toml().replace(old, new))
    assert not reply.ok and says in reply.text
    flight.run(1.0)
    assert flight.phases() == {Phase.FLYING}


@pytest.mark.long
def test_an_edit_may_not_leave_a_vehicle_outside(rig: MakeRig) -> None:
    """The new area is 180 m high, up to y = 290; vehicles 7 and 8 fly at y = 320."""

    def wants(frame: FleetFrame, task: PlannerTask) -> list[Intent]:
        y = {7: 320.0, 8: 320.0}
        return [
            Intent(v, "goto", position_m=(200.0 + 20.0 * v, y.get(v, 200.0), task.layers_m[v])) for v in task.members
        ]

    flight = rig(8, wants=wants).flying().run(50.0)
    reply = apply(flight, toml().replace("height_m = 400.0", "height_m = 180.0", 1))
    assert not reply.ok and "outside the new operating area" in reply.text, reply
    assert [(r.vehicle, r.text) for r in reply.results] == [(7, "30 m outside"), (8, "30 m outside")]


# ---------------------------------------------------------------- the end


def test_a_station_does_not_end_while_anything_is_armed(rig: MakeRig) -> None:
    flight = rig(2).flying()
    reply = flight.ask(m.Shutdown())
    assert not reply.ok and reply.text == "not while armed: vehicles 1-2 (tui-gcs return or tui-gcs land lands them)"
    assert not flight.station.conditions.ending
    flight.ask(m.Return())
    flight.until(lambda: not flight.sim.armed.any(), 150.0)
    flight.run(2.0)
    assert flight.ask(m.Shutdown()).ok and flight.station.conditions.ending


def test_a_layer_outside_the_zone_s_own_band_does_not_start(rig: MakeRig) -> None:
    whole = rig(2).scenario
    home, *others = whole.rounds[0].zones
    narrow = msgspec.structs.replace(home, alt_min_m=30.0, alt_max_m=60.0)
    first = msgspec.structs.replace(whole.rounds[0], zones=(narrow, *others))
    flight = rig(2, mission=msgspec.structs.replace(whole, rounds=(first, *whole.rounds[1:]))).ready()
    reply = flight.ask(m.Start(vehicles=(1, 2)))
    assert not reply.ok
    assert [r.text for r in reply.results] == ["its layer 27 m is outside 30-60 m, the band of zone home", ""]
