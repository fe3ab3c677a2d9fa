"""Several links to one vehicle, and clients that connect anew: the whole station in lock-step."""

from typing import Any

import pytest

from tests.core.rigs import orders
from tests.core.rigs.wires import LOST_TEXT, MakeWired, Wire, Wired
from tui_gcs.core.guard.permission import PASS
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Freshness, Phase
from tui_gcs.core.records.event_log import WARNING
from tui_gcs.core.records.tlog_reader import read_tlog


def alarms(flight: Wired) -> list[str]:
    return [e.text for e in flight.events() if e.severity <= WARNING]


# ---------------------------------------------------------------- two links to one vehicle


@pytest.mark.parametrize("numbers", [False, True], ids=["copies", "numbered by link"])
def test_a_vehicle_on_two_links_is_one_vehicle(wired: MakeWired, numbers: bool) -> None:
    flight = wired(2, wires=[Wire("near"), Wire("far", delay_s=0.2, numbers=numbers)]).run(10.0)
    assert sorted(flight.station.picture.fleet.vehicles) == [1, 2]
    for v in (1, 2):
        assert [path.source.link for path in flight.vehicle(v).used_paths()] == ["near", "far"]
        assert flight.vehicle(v).link == "near"
        assert "also heard on far: the same vehicle" in flight.texts(f"vehicle {v}")
        assert not flight.vehicle(v).why_not_commanded and flight.vehicle(v).integrity.reboots == 0
        assert flight.vehicle(v).loss_pct == 0.0


def test_what_comes_twice_is_recorded_and_told_once(wired: MakeWired, tmp_path: Any) -> None:
    flight = wired(1, wires=[Wire("near"), Wire("far", delay_s=0.4)]).run(10.0)
    since_s = flight.clock.wall()
    acks: list[int] = []
    flight.station.picture.fleet.on_message("COMMAND_ACK", lambda v, fields: acks.append(fields["command"]))
    reported: list[int] = []
    flight.station.picture.fleet.on_message("STATUSTEXT", lambda v, fields: reported.append(fields["severity"]))
    flight.run(5.0)
    flight.sim._pilots[0].platform.outbox.text(4, "only once")
    flight.run(2.0)
    flight.station.comms.command_encoder.position(1, PASS, (50.0, 200.0, 30.0))
    flight.station.comms.commands.submit(orders.speed(flight, 1, 5.0))
    flight.run(2.0)
    assert acks == [178] and reported == [4]
    assert flight.texts("vehicle 1").count("only once") == 1
    flight.close()
    frames = [f.raw for t, f in read_tlog(tmp_path / "run.tlog") if t > since_s and f.system == 1]
    assert len(frames) > 100 and len(set(frames)) == len(frames)
    assert flight.station.picture.fleet.dropped["copy over a second link"] > 100


@pytest.mark.long
@pytest.mark.parametrize("first", ["near", "far"])
@pytest.mark.parametrize("numbers", [False, True], ids=["copies", "numbered by link"])
def test_the_fresh_link_is_used(wired: MakeWired, first: str, numbers: bool) -> None:
    near, far = Wire("near", delay_s=0.02, numbers=numbers), Wire("far", delay_s=0.8, numbers=numbers)
    near.up, far.up = first == "near", first == "far"
    flight = wired(1, wires=[near, far]).run(5.0)
    assert flight.vehicle().link == first
    near.up = far.up = True
    flight.run(10.0)
    assert flight.vehicle().link == "near"
    flight.run(120.0)
    assert flight.vehicle().link == "near"
    assert flight.vehicle().integrity.reboots == 0 and "rebooted" not in flight.texts()
    assert len([t for t in flight.texts() if "used instead" in t]) <= 1
    assert flight.clock.now() - flight.vehicle().telemetry.position_s < 0.3


@pytest.mark.long
@pytest.mark.parametrize("numbers", [False, True], ids=["copies", "numbered by link"])
def test_one_link_dies_in_flight_and_nobody_notices(wired: MakeWired, numbers: bool) -> None:
    near, far = Wire("near", delay_s=0.02, numbers=numbers), Wire("far", delay_s=0.8, numbers=numbers)
    flight = wired(2, wires=[near, far]).flying().run(10.0)
    reported = len(flight.events())
    near.up = False
    flight.until(lambda: {flight.vehicle(v).link for v in (1, 2)} == {"far"}, 2.0, "the other link is used")
    flight.run(1.0)
    since_s = flight.clock.now()
    flight.run(10.0)
    assert flight.phases() == {Phase.FLYING}
    assert not flight.names(near, since_s).count("SET_POSITION_TARGET_GLOBAL_INT")
    assert flight.names(far, since_s).count("SET_POSITION_TARGET_GLOBAL_INT") >= 80
    texts = [e.text for e in flight.events()[reported:]]
    assert LOST_TEXT not in texts and "rebooted" not in texts
    assert flight.ask(m.Hold()).ok
    flight.run(4.0)
    assert all(flight.speed(v) < 0.5 for v in flight.ids)
    assert "hold: confirmed" in flight.texts("vehicle 1")


def test_both_links_die_and_one_returns(wired: MakeWired) -> None:
    near, far = Wire("near", delay_s=0.02), Wire("far", delay_s=0.2)
    flight = wired(1, wires=[near, far]).run(10.0)
    near.up = far.up = False
    lost_s = flight.until(lambda: flight.vehicle().freshness(flight.clock.now()) is Freshness.LOST, 5.0)
    assert 3.4 <= lost_s <= 4.0
    flight.run(10.0)
    assert flight.texts("vehicle 1").count(LOST_TEXT) == 1
    far.up = True
    back_s = flight.until(lambda: flight.vehicle().freshness(flight.clock.now()) is Freshness.OK, 3.0)
    assert back_s <= 2.0
    flight.run(1.0)
    assert flight.vehicle().link == "far" and flight.vehicle().integrity.reboots == 0


def test_a_link_that_flaps_floods_nobody_and_leaks_nothing(wired: MakeWired) -> None:
    near, far = Wire("near", delay_s=0.02), Wire("far", delay_s=0.8)
    flight = wired(1, wires=[near, far]).run(10.0)
    reported = len(alarms(flight))
    all_told = len(flight.events())
    for _ in range(50):
        near.up = False
        flight.run(2.0)
        near.up = True
        flight.run(2.0)
        assert flight.vehicle().freshness(flight.clock.now()) is not Freshness.LOST
    vehicle = flight.vehicle()
    assert len(alarms(flight)) == reported
    assert len(flight.events()) - all_told <= 20
    assert len(vehicle.paths) == 2 and all(len(path.streams) == 1 for path in vehicle.paths)
    assert vehicle.duplicate_filter is not None and len(vehicle.duplicate_filter) < 400
    assert vehicle.integrity.reboots == 0 and not vehicle.why_not_commanded


def test_the_only_link_flaps(wired: MakeWired) -> None:
    near = Wire("near")
    flight = wired(1, wires=[near]).run(10.0)
    reported = len(alarms(flight))
    for _ in range(50):
        near.up = False
        flight.run(2.0)
        near.up = True
        flight.run(2.0)
    assert len(alarms(flight)) == reported
    assert len(flight.vehicle().paths) == 1 and flight.vehicle().integrity.reboots == 0


def test_a_byte_stream_that_is_cut_again_and_again_leaks_nothing(wired: MakeWired) -> None:
    near = Wire("near")
    near.link.stream = True
    flight = wired(1, wires=[near]).run(5.0)
    for _ in range(50):
        near.link.inject(b"", ("sim", 0))
        flight.run(0.5)
    assert len(flight.vehicle().path.streams) == 1
    assert flight.vehicle().integrity.reboots == 0


def test_an_ack_over_the_other_link_counts(wired: MakeWired) -> None:
    """The link in use loses all acknowledgements; they come over the other one."""
    near, far = Wire("near", numbers=True), Wire("far", delay_s=0.1)
    flight = wired(1, wires=[near, far]).run(10.0)
    near.loses = lambda way, data: way == "up" and data[7:10] == b"\x4d\0\0"
    done: list[str] = []
    action = orders.speed(flight, 1, 5.0)
    action.on_done = lambda _, outcome, why: done.append(outcome.value)
    flight.station.comms.commands.submit(action)
    flight.run(1.0)
    assert done == ["confirmed"] and action.sent == 1


def test_another_link_costs_no_questions_about_rates(wired: MakeWired) -> None:
    """What was counted before the second link came still counts."""
    near, far = Wire("near", delay_s=0.02), Wire("far", delay_s=0.5, up=False)
    flight = wired(1, wires=[near, far]).run(30.0)
    since_s = flight.clock.now()
    far.up = True
    flight.run(30.0)
    assert len(flight.vehicle().used_paths()) == 2
    assert 511 not in flight.commands(near, since_s) + flight.commands(far, since_s)
    assert flight.vehicle().loss_pct == 0.0


def test_the_radio_of_a_second_link_is_heard(wired: MakeWired) -> None:
    from tui_gcs.core.mavlink.encode import Encoder

    flight = wired(1, wires=[Wire("near"), Wire("far", delay_s=0.3)]).run(10.0)
    said = {"rssi": 200, "remrssi": 190, "noise": 40, "remnoise": 40, "rxerrors": 0, "fixed": 0}
    flight.wires[1].link.inject(Encoder(51, 68).encode("RADIO_STATUS", txbuf=66, **said), ("sim", 0))
    flight.run(0.1)
    assert [link.radio for link in flight.status().links] == ["", "txbuf 66 % rssi 200/190"]


def test_frames_lost_on_one_link_come_over_the_other(wired: MakeWired) -> None:
    import random

    chance = random.Random(3)
    wires = [Wire(name, loses=lambda way, data: chance.random() < 0.5) for name in ("one", "two")]
    flight = wired(1, wires=wires).run(20.0)
    reported: list[str] = []
    flight.station.picture.fleet.on_message("STATUSTEXT", lambda v, fields: reported.append(fields["text"]))
    for k in range(100):
        flight.sim._pilots[0].platform.outbox.text(6, f"number {k}")
        flight.run(0.2)
    assert len(reported) == len(set(reported)) >= 65
    assert LOST_TEXT not in flight.texts()
    assert 30.0 < flight.vehicle().loss_pct < 70.0


def test_the_same_id_on_another_network_is_another_vehicle(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("near"), Wire("north", network="north", delay_s=0.1)]).run(10.0)
    assert sorted(flight.station.picture.fleet.vehicles) == [1, 1001]
    assert flight.vehicle(1001).system == 1 and flight.vehicle(1001).network == "north"
    assert not flight.vehicle(1).why_not_commanded and not flight.vehicle(1001).why_not_commanded
    near, north = flight.wires
    since_s = flight.clock.now()
    flight.station.comms.commands.submit(orders.speed(flight, 1001, 5.0))
    flight.run(1.0)
    assert flight.commands(north, since_s).count(178) == 1 and 178 not in flight.commands(near, since_s)
    assert flight.station.picture.fleet.vehicles[1001].identity.identified


# ---------------------------------------------------------------- clients that connect anew


def test_a_client_that_connects_anew_is_the_same_vehicle_and_no_second_one(wired: MakeWired) -> None:
    """TCP: a new connection has a new address, and from the old one nothing will ever come again."""
    port = [1000]
    flight = wired(1, wires=[Wire("near"), Wire("far", place=lambda fleet, index: ("client", port[0] + index))])
    flight.run(10.0)
    assert [path.source.link for path in flight.vehicle().used_paths()] == ["near", "far"]
    intake = flight.station.picture.fleet.intakes[""]
    for _ in range(3):
        intake.chunks("far", [(b"", ("client", port[0]))], flight.clock.now())
        port[0] += 100
        flight.run(12.0)
        used = [path.source.address for path in flight.vehicle().used_paths() if path.source.link == "far"]
        assert used == [("client", port[0])]
        assert not flight.vehicle().identity.blocked and len(flight.vehicle().paths) == 2
    assert not [text for text in alarms(flight) if "second source" in text or "DUPLICATE" in text]


def test_the_only_client_that_connects_anew_is_followed(wired: MakeWired) -> None:
    port = [1000]
    flight = wired(1, wires=[Wire("far", place=lambda fleet, index: ("client", port[0] + index))]).run(10.0)
    flight.station.picture.fleet.intakes[""].chunks("far", [(b"", ("client", port[0]))], flight.clock.now())
    port[0] += 100
    flight.run(8.0)
    assert flight.vehicle().address == ("client", port[0])
    assert flight.vehicle().freshness(flight.clock.now()) is Freshness.OK
    assert not flight.vehicle().identity.blocked
