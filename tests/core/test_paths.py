"""Several links to one vehicle, several vehicles with one id, addresses that change: the whole station in lock-step."""

from collections.abc import Callable
from typing import Any

import orders
import pytest
from wires import Wire, Wired

from tui_gcs.core import messages as m
from tui_gcs.core.events import ALERT, NOTICE, WARNING
from tui_gcs.core.links import Address
from tui_gcs.core.messages import Freshness, Phase
from tui_gcs.core.tlog import read_tlog
from tui_gcs.core.wire.intake import MOST_SOURCES

MakeWired = Callable[..., Wired]
LOST_TEXT = "LOST: nothing heard for 3.5 s"


def at(port: int) -> Callable[[int, int], Address | None]:
    """Vehicles of every fleet behind one router: all at one address each by index."""
    return lambda fleet, index: ("router", port + index)


def apart(fleet: int, index: int) -> Address:
    """Every fleet at addresses of its own."""
    return (f"fleet {fleet}", index)


def only(number: int) -> Callable[[int, int], Address | None]:
    """Only that fleet is heard on this wire."""
    return lambda fleet, index: (f"fleet {number}", index) if fleet == number else None


def alarms(flight: Wired) -> list[str]:
    return [e.text for e in flight.events() if e.severity <= WARNING]


# ---------------------------------------------------------------- two links to one vehicle


@pytest.mark.parametrize("numbers", [False, True], ids=["copies", "numbered by link"])
def test_a_vehicle_on_two_links_is_one_vehicle(wired: MakeWired, numbers: bool) -> None:
    flight = wired(2, wires=[Wire("near"), Wire("far", delay_s=0.2, numbers=numbers)]).run(10.0)
    assert sorted(flight.station.fleet.vehicles) == [1, 2]
    for v in (1, 2):
        assert [path.source.link for path in flight.vehicle(v).used_paths()] == ["near", "far"]
        assert flight.vehicle(v).link == "near"
        assert "also heard on far: the same vehicle" in flight.texts(f"vehicle {v}")
        assert not flight.vehicle(v).no_commands and flight.vehicle(v).reboots == 0
        assert flight.vehicle(v).loss_pct == 0.0


def test_what_comes_twice_is_recorded_and_told_once(wired: MakeWired, tmp_path: Any) -> None:
    flight = wired(1, wires=[Wire("near"), Wire("far", delay_s=0.4)]).run(10.0)
    since_s = flight.clock.wall()
    acks: list[int] = []
    flight.station.fleet.on_message("COMMAND_ACK", lambda v, fields: acks.append(fields["command"]))
    told: list[int] = []
    flight.station.fleet.on_message("STATUSTEXT", lambda v, fields: told.append(fields["severity"]))
    flight.run(5.0)
    flight.sim._pilots[0].text(4, "only once")
    flight.run(2.0)
    flight.station.speech.position(1, (50.0, 200.0, 30.0))
    flight.station.commands.submit(orders.speed(flight, 1, 5.0))
    flight.run(2.0)
    assert acks == [178] and told == [4]
    assert flight.texts("vehicle 1").count("only once") == 1
    flight.close()
    frames = [f.raw for t, f in read_tlog(tmp_path / "run.tlog") if t > since_s and f.system == 1]
    assert len(frames) > 100 and len(set(frames)) == len(frames)
    assert flight.station.fleet.dropped["copy over a second link"] > 100


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
    assert flight.vehicle().reboots == 0 and "rebooted" not in flight.texts()
    assert len([t for t in flight.texts() if "used instead" in t]) <= 1
    assert flight.clock.now() - flight.vehicle().position_s < 0.3


@pytest.mark.parametrize("numbers", [False, True], ids=["copies", "numbered by link"])
def test_one_link_dies_in_flight_and_nobody_notices(wired: MakeWired, numbers: bool) -> None:
    near, far = Wire("near", delay_s=0.02, numbers=numbers), Wire("far", delay_s=0.8, numbers=numbers)
    flight = wired(2, wires=[near, far]).flying().run(10.0)
    told = len(flight.events())
    near.up = False
    flight.until(lambda: {flight.vehicle(v).link for v in (1, 2)} == {"far"}, 2.0, "the other link is used")
    flight.run(1.0)
    since_s = flight.clock.now()
    flight.run(10.0)
    assert flight.phases() == {Phase.FLYING}
    assert not flight.names(near, since_s).count("SET_POSITION_TARGET_GLOBAL_INT")
    assert flight.names(far, since_s).count("SET_POSITION_TARGET_GLOBAL_INT") >= 80
    texts = [e.text for e in flight.events()[told:]]
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
    assert flight.vehicle().link == "far" and flight.vehicle().reboots == 0


def test_a_link_that_flaps_floods_nobody_and_leaks_nothing(wired: MakeWired) -> None:
    near, far = Wire("near", delay_s=0.02), Wire("far", delay_s=0.8)
    flight = wired(1, wires=[near, far]).run(10.0)
    told = len(alarms(flight))
    all_told = len(flight.events())
    for _ in range(50):
        near.up = False
        flight.run(2.0)
        near.up = True
        flight.run(2.0)
        assert flight.vehicle().freshness(flight.clock.now()) is not Freshness.LOST
    vehicle = flight.vehicle()
    assert len(alarms(flight)) == told
    assert len(flight.events()) - all_told <= 20
    assert len(vehicle.paths) == 2 and all(len(path.streams) == 1 for path in vehicle.paths)
    assert vehicle.copies is not None and len(vehicle.copies) < 400
    assert vehicle.reboots == 0 and not vehicle.no_commands


def test_the_only_link_flaps(wired: MakeWired) -> None:
    near = Wire("near")
    flight = wired(1, wires=[near]).run(10.0)
    told = len(alarms(flight))
    for _ in range(50):
        near.up = False
        flight.run(2.0)
        near.up = True
        flight.run(2.0)
    assert len(alarms(flight)) == told
    assert len(flight.vehicle().paths) == 1 and flight.vehicle().reboots == 0


def test_a_byte_stream_that_is_cut_again_and_again_leaks_nothing(wired: MakeWired) -> None:
    near = Wire("near")
    near.link.stream = True
    flight = wired(1, wires=[near]).run(5.0)
    for _ in range(50):
        near.link.inject(b"", ("sim", 0))
        flight.run(0.5)
    assert len(flight.vehicle().path.streams) == 1
    assert flight.vehicle().reboots == 0


def test_an_ack_over_the_other_link_counts(wired: MakeWired) -> None:
    """The link in use loses all acknowledgements; they come over the other one."""
    near, far = Wire("near", numbers=True), Wire("far", delay_s=0.1)
    flight = wired(1, wires=[near, far]).run(10.0)
    near.loses = lambda way, data: way == "up" and data[7:10] == b"\x4d\0\0"
    done: list[str] = []
    action = orders.speed(flight, 1, 5.0)
    action.on_done = lambda _, outcome, why: done.append(outcome.value)
    flight.station.commands.submit(action)
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
    from tui_gcs.core.wire.encode import Encoder

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
    told: list[str] = []
    flight.station.fleet.on_message("STATUSTEXT", lambda v, fields: told.append(fields["text"]))
    for k in range(100):
        flight.sim._pilots[0].text(6, f"number {k}")
        flight.run(0.2)
    assert len(told) == len(set(told)) >= 65
    assert LOST_TEXT not in flight.texts()
    assert 30.0 < flight.vehicle().loss_pct < 70.0


def test_the_same_id_on_another_network_is_another_vehicle(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("near"), Wire("north", network="north", delay_s=0.1)]).run(10.0)
    assert sorted(flight.station.fleet.vehicles) == [1, 1001]
    assert flight.vehicle(1001).system == 1 and flight.vehicle(1001).network == "north"
    assert not flight.vehicle(1).no_commands and not flight.vehicle(1001).no_commands
    near, north = flight.wires
    since_s = flight.clock.now()
    flight.station.commands.submit(orders.speed(flight, 1001, 5.0))
    flight.run(1.0)
    assert flight.commands(north, since_s).count(178) == 1 and 178 not in flight.commands(near, since_s)
    assert flight.station.fleet.vehicles[1001].identified


# ---------------------------------------------------------------- two vehicles with one id


def twins_told(flight: Wired, within_s: float = 5.0) -> None:
    """The id is blocked, and that is shown everywhere."""
    flight.until(lambda: bool(flight.vehicle().no_commands), within_s, "two vehicles with one id")
    flight.run(0.2)
    assert "two vehicles use id 1" in flight.vehicle().no_commands
    status = flight.status()
    assert "two vehicles use id 1" in status.not_ready[1]
    assert "NOT COMMANDED" in status.alarm and "two vehicles" in status.alarm
    assert flight.frame is not None and "two vehicles" in flight.frame.problem[flight.frame.ids.index(1)]
    reply = flight.ask(m.Start(vehicles=(1,)))
    assert not reply.ok and "two vehicles use id 1" in reply.results[0].text
    assert [e for e in flight.events() if e.severity == ALERT and "DUPLICATE ID" in e.text]


def only_stops_pass(flight: Wired) -> None:
    since_s = flight.clock.now()
    door = flight.station.door
    before = door.refused.total()
    flight.station.commands.submit(orders.prepare(flight, 1))
    flight.run(1.0)
    assert door.refused.total() > before
    assert all(176 not in flight.commands(wire, since_s) for wire in flight.wires)
    flight.station.commands.submit(orders.land(flight, 1))
    flight.run(1.0)
    assert any(176 in flight.commands(wire, since_s) for wire in flight.wires)


CASES = {
    "same link, other address": [Wire("near", place=apart)],
    "other link": [Wire("near", place=only(0)), Wire("far", place=only(1))],
    "same address": [Wire("near", place=at(0))],
}


def fresh(wires: list[Wire]) -> list[Wire]:
    return [Wire(wire.name, place=wire.place) for wire in wires]


@pytest.mark.parametrize("age_s", [0.0, 3.0, 60.0, 400.0])
@pytest.mark.parametrize("uid", ["other", "equal", "none"])
@pytest.mark.parametrize("case", list(CASES))
def test_a_second_vehicle_with_the_id_is_found(wired: MakeWired, case: str, uid: str, age_s: float) -> None:
    flight = wired(1, wires=fresh(CASES[case])).run(20.0)
    twin = flight.stranger(age_s=age_s)
    if uid != "other":
        flight.same_uid("\0" * 20 if uid == "none" else "f" * 20)
        flight.vehicle().uid = "" if uid == "none" else (b"f" * 17 + b"\0").hex()
    if age_s == 0.0:  # just switched on: it is quiet at first
        flight.run(1.0)
    twins_told(flight)
    only_stops_pass(flight)
    flight.remove(twin)
    flight.until(lambda: not flight.vehicle().no_commands, 16.0, "resolved")
    assert "only one vehicle uses this id again" in flight.texts("vehicle 1")
    flight.run(20.0)
    assert not flight.vehicle().no_commands and flight.vehicle().freshness(flight.clock.now()) is Freshness.OK


@pytest.mark.parametrize("case", list(CASES))
def test_it_stays_blocked_while_both_are_there(wired: MakeWired, case: str) -> None:
    flight = wired(1, wires=fresh(CASES[case])).run(20.0)
    flight.stranger(age_s=100.0)
    twins_told(flight)
    for _ in range(120):
        flight.run(0.5)
        assert flight.vehicle().no_commands
    said = [e for e in flight.events() if "DUPLICATE ID" in e.text]
    assert len(said) <= 3


def test_in_flight_a_stranger_elsewhere_does_not_stop_ours_from_being_steered(wired: MakeWired) -> None:
    for wires in (fresh(CASES["same link, other address"]), fresh(CASES["other link"])):
        flight = wired(1, wires=wires).flying().run(5.0)
        flight.stranger(age_s=100.0)
        flight.run(8.0)
        since_s = flight.clock.now()
        assert flight.vehicle().blocked and not flight.vehicle().no_commands
        flight.run(5.0)
        assert flight.phase(1) is Phase.FLYING
        assert len(flight.sent_to(1, since_s=since_s)) >= 20
        assert not [raw for t, raw in flight.wires[-1].seen if t > since_s and len(wires) > 1 and raw[7] == 86]


def test_in_flight_twins_at_one_address_get_stops_only(wired: MakeWired) -> None:
    flight = wired(1, wires=fresh(CASES["same address"])).flying().run(5.0)
    flight.stranger(age_s=100.0)
    flight.until(lambda: bool(flight.vehicle().no_commands), 5.0)
    since_s = flight.clock.now()
    flight.run(5.0)
    assert not flight.sent_to(1, since_s=since_s), "nobody knows whom a set-point would reach"
    flight.ask(m.Hold())
    flight.run(5.0)
    assert not flight.sent_to(1, since_s=since_s)
    assert [f["param2"] for _, f in flight.sent_to(1, "COMMAND_LONG", since_s) if f["command"] == 176][:1] == [17]
    assert int(flight.sim.mode[0]) == 17 and flight.speed(1) < 0.5
    reply = flight.ask(m.Return(vehicles=(1,)))
    assert not reply.ok and "only hold is sent" in reply.results[0].text
    assert not flight.sent_to(1, since_s=since_s)


def test_a_stray_heartbeat_now_and_then_blocks_nobody(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("near")]).run(10.0)
    fields = {"type": 2, "autopilot": 3, "base_mode": 81, "custom_mode": 0, "system_status": 3, "mavlink_version": 3}
    for _ in range(6):
        flight.wires[0].link.inject(flight.outgoing.encode("HEARTBEAT", **fields), ("forger", 1))
        flight.run(9.0)
        assert not flight.vehicle().no_commands


def test_a_camera_with_an_address_of_its_own_is_no_second_vehicle(wired: MakeWired) -> None:
    from tui_gcs.core.wire.encode import Encoder

    flight = wired(1, wires=[Wire("near")]).run(10.0)
    camera = Encoder(1, 100)
    fields = {"type": 30, "autopilot": 8, "base_mode": 0, "custom_mode": 0, "system_status": 4, "mavlink_version": 3}
    for k in range(200):
        if k == 100:
            flight.wires[0].up = False
        flight.wires[0].link.inject(camera.encode("HEARTBEAT", **fields), ("camera", 1))
        flight.run(0.2)
    assert not flight.vehicle().blocked
    assert flight.vehicle().address == ("sim", 0), "nor does it tell where its vehicle is"
    assert flight.station.fleet.dropped["component at another address"] >= 150


def test_a_hundred_forged_addresses_leave_room_for_the_true_one(wired: MakeWired) -> None:
    moved: dict[str, Any] = {"to": ("sim", 0)}
    flight = wired(1, wires=[Wire("near", place=lambda fleet, index: moved["to"])]).run(10.0)
    fields = {"type": 2, "autopilot": 3, "base_mode": 81, "custom_mode": 0, "system_status": 3, "mavlink_version": 3}
    for k in range(100):
        flight.wires[0].link.inject(flight.outgoing.encode("HEARTBEAT", **fields), ("forger", k))
        flight.run(0.05)
    assert len(flight.vehicle().paths) <= 8 and flight.vehicle().address == ("sim", 0)
    flight.wires[0].up = False
    flight.run(3.5)
    flight.wires[0].up = True
    moved["to"] = ("sim", 7)
    flight.run(1.5)
    assert flight.vehicle().address == ("sim", 7)
    assert len(flight.station.fleet.intakes[""].sources) < MOST_SOURCES


# ---------------------------------------------------------------- another address


def moving(wired: MakeWired) -> tuple[Wired, dict[str, Address]]:
    """A vehicle whose address can be changed."""
    now: dict[str, Address] = {"place": ("sim", 0)}
    return wired(1, wires=[Wire("near", place=lambda fleet, index: now["place"])]), now


def test_on_the_ground_a_new_address_is_taken_after_three_seconds_and_asked_first(wired: MakeWired) -> None:
    flight, now = moving(wired)
    flight.run(20.0)
    now["place"] = ("sim", 5)
    flight.run(2.8)
    assert flight.vehicle().address == ("sim", 0)
    since_s = flight.clock.now()
    flight.until(lambda: flight.vehicle().address == ("sim", 5), 1.5)
    flight.run(3.0)
    assert flight.vehicle().identified and not flight.vehicle().no_commands
    assert set(flight.names(flight.wires[0], since_s)) <= {"HEARTBEAT", "COMMAND_LONG", "TIMESYNC"}
    assert set(flight.commands(flight.wires[0], since_s)) <= {511, 512}
    assert flight.vehicle().reboots == 0


def test_nothing_but_stops_goes_to_an_address_that_does_not_say_who_it_is(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("near")]).run(20.0)
    flight.sim.silence(0)
    flight.run(4.0)
    fields = {"type": 2, "autopilot": 3, "base_mode": 81, "custom_mode": 0, "system_status": 3, "mavlink_version": 3}
    for _ in range(20):
        flight.wires[0].link.inject(flight.outgoing.encode("HEARTBEAT", **fields), ("elsewhere", 1))
        flight.run(0.5)
    assert flight.vehicle().address == ("elsewhere", 1)
    assert "asked who it is" in flight.vehicle().no_commands
    since_s = flight.clock.now()
    flight.station.commands.submit(orders.prepare(flight, 1))
    flight.run(0.5)
    assert 176 not in flight.commands(flight.wires[0], since_s)


def test_in_flight_a_new_address_is_followed_because_it_is_the_same_vehicle(wired: MakeWired) -> None:
    flight, now = moving(wired)
    flight.flying().run(5.0)
    now["place"] = ("sim", 5)
    flight.until(lambda: flight.vehicle().address == ("sim", 5), 5.0)
    flight.run(2.0)
    assert flight.phase(1) is Phase.FLYING and flight.vehicle().reboots == 0
    since_s = flight.clock.now()
    flight.run(2.0)
    assert len(flight.sent_to(1, since_s=since_s)) >= 8
    assert [e.severity for e in flight.events() if e.text.endswith("the same vehicle")] == [NOTICE]


@pytest.mark.parametrize("uid", ["other", "none"])
def test_in_flight_another_vehicle_does_not_inherit_the_flight(wired: MakeWired, uid: str) -> None:
    """The one that flies falls silent; a second one with its id is switched on, on the ground."""
    flight = wired(1, wires=[Wire("near", place=apart)]).flying().run(5.0)
    flight.remove(0)
    flight.run(1.0)
    flight.stranger(age_s=30.0)
    if uid == "none":
        flight.same_uid()
        flight.vehicle().uid = ""
    flight.run(20.0)
    assert flight.phase(1) is Phase.TAKEN_OUT
    assert flight.vehicle().armed, "what the newcomer says is not taken for ours"
    assert "LOST in the air: vehicle 1" in flight.status().alarm
    assert any("another" in e.text for e in flight.events() if e.severity <= WARNING)
    flight.sim.unsilence(0)
    flight.run(20.0)
    assert flight.phase(1) in (Phase.FLYING, Phase.HOLDING)
    assert flight.vehicle().address == ("fleet 0", 0)


def test_on_the_ground_another_vehicle_takes_the_id_over_and_nothing_of_the_old_one(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("near", place=apart)]).run(20.0)
    before = flight.vehicle().uid
    flight.remove(0)
    flight.stranger(age_s=30.0)
    flight.run(10.0)
    vehicle = flight.vehicle()
    assert vehicle.uid != before and vehicle.address == ("fleet 1", 0)
    assert any("another vehicle has id 1 now" in text for text in flight.texts("vehicle 1"))
    flight.until(lambda: not flight.station.requests.why_not_start(1), 30.0, "the newcomer may start")


def test_a_vehicle_lost_on_one_radio_and_another_one_heard_on_a_second_are_not_mixed(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("a", place=only(0)), Wire("b", place=only(1))]).run(20.0)
    flight.sim.silence(0)
    flight.stranger(age_s=100.0)
    flight.run(10.0)
    assert flight.vehicle().link == "b"
    flight.sim.unsilence(0)
    twins_told(flight, 6.0)
    links = set()
    for _ in range(100):
        flight.run(0.1)
        links.add(flight.vehicle().link)
    assert links == {"b"}


# ---------------------------------------------------------------- reboots


def test_a_reboot_is_noticed_within_two_seconds_and_everything_is_asked_again_once(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("near")]).run(30.0)
    vehicle = flight.vehicle()
    vehicle.prearm_ok, vehicle.home_m = True, (1.0, 2.0, 0.0)
    flight.sim._pilots[0].restart(flight.sim._now_us)
    flight.run(0.1)
    heard_s = vehicle.heartbeat_s
    flight.until(lambda: vehicle.heartbeat_s > heard_s, 5.0, "heard again")
    since_s = flight.clock.now()
    flight.until(lambda: vehicle.reboots == 1, 2.0, "reboot noticed")
    assert not vehicle.prearm_ok and vehicle.home_m is None and vehicle.satellites == -1
    assert not vehicle.identified and not vehicle.has_battery_status
    flight.until(lambda: vehicle.identified and flight.clock.now() - vehicle.position_s < 0.5, 8.0, "in order again")
    flight.run(30.0)
    assert vehicle.reboots == 1 and flight.texts("vehicle 1").count("rebooted") == 1
    intervals = [f["param1"] for t, f in flight.sent_to(1, "COMMAND_LONG", since_s) if f["command"] == 511]
    assert len(intervals) >= 4 and len(set(intervals)) == len(intervals)


def test_a_reboot_on_two_links_is_one(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("near"), Wire("far", delay_s=0.8)]).run(30.0)
    flight.sim._pilots[0].restart(flight.sim._now_us)
    flight.run(30.0)
    assert flight.vehicle().reboots == 1 and not flight.vehicle().no_commands
    assert len(flight.vehicle().used_paths()) == 2


def test_a_start_under_way_ends_when_the_vehicle_reboots(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("near")]).ready()
    flight.until(lambda: not flight.station.requests.why_not_start(1), 60.0)
    assert flight.ask(m.Start(vehicles=(1,))).ok
    flight.sim._pilots[0].restart(flight.sim._now_us)
    flight.run(40.0)
    assert flight.phase(1) is Phase.GROUND and not flight.sim.armed.any()
    assert any("not started" in text for text in flight.texts("vehicle 1"))


def test_a_start_under_way_ends_when_a_boot_clock_begins_anew(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("near")]).ready()
    flight.until(lambda: not flight.station.requests.why_not_start(1), 60.0)
    assert flight.ask(m.Start(vehicles=(1,))).ok
    flight.sim.silence(0)
    fields = {"lat": 1, "lon": 1, "alt": 0, "relative_alt": 0, "vx": 0, "vy": 0, "vz": 0, "hdg": 0}
    flight.wires[0].link.inject(flight.outgoing.encode("GLOBAL_POSITION_INT", time_boot_ms=300, **fields), ("sim", 0))
    flight.run(0.1)
    assert "not started: rebooted" in flight.texts("vehicle 1")


def test_swapped_neighbours_are_no_loss_and_no_doubt(wired: MakeWired) -> None:
    """PX4's two sending threads swap neighbours all the time."""
    held: list[bytes] = []
    wire = Wire("near")
    plain = wire.from_vehicle

    def swapping(now: float, data: bytes, address: Address) -> None:
        held.append(data)
        if len(held) == 2:
            for each in reversed(held):
                plain(now, each, address)
            held.clear()

    wire.from_vehicle = swapping  # type: ignore[method-assign]
    flight = wired(1, wires=[wire]).run(20.0)
    since_s = flight.clock.now()
    flight.run(60.0)
    assert flight.vehicle().loss_pct < 1.0
    assert flight.vehicle().reboots == 0 and not flight.vehicle().blocked
    assert 512 not in flight.commands(wire, since_s)


def test_loss_and_a_second_of_jitter_are_no_twin_no_reboot_and_no_loss_of_contact(wired: MakeWired) -> None:
    import random

    chance = random.Random(5)
    wire = Wire("near", loses=lambda way, data: chance.random() < 0.2)
    plain, held = wire.from_vehicle, list[tuple[float, bytes, Address]]()

    def shaken(now: float, data: bytes, address: Address) -> None:
        held.append((now + chance.uniform(0.0, 1.0), data, address))
        for due in sorted(each for each in held if each[0] <= now):
            held.remove(due)
            plain(now, due[1], due[2])

    wire.from_vehicle = shaken  # type: ignore[method-assign]
    flight = wired(1, wires=[wire]).run(300.0)
    assert not flight.vehicle().blocked and flight.vehicle().reboots == 0
    assert not any(LOST_TEXT in text or "DUPLICATE" in text for text in flight.texts())
    assert flight.commands(wire).count(512) <= 60


# ---------------------------------------------------------------- clients that connect anew


def test_a_client_that_connects_anew_is_the_same_vehicle_and_no_second_one(wired: MakeWired) -> None:
    """TCP: a new connection has a new address, and from the old one nothing will ever come again."""
    port = [1000]
    flight = wired(1, wires=[Wire("near"), Wire("far", place=lambda fleet, index: ("client", port[0] + index))])
    flight.run(10.0)
    assert [path.source.link for path in flight.vehicle().used_paths()] == ["near", "far"]
    intake = flight.station.fleet.intakes[""]
    for _ in range(3):
        intake.chunks("far", [(b"", ("client", port[0]))], flight.clock.now())
        port[0] += 100
        flight.run(12.0)
        used = [path.source.address for path in flight.vehicle().used_paths() if path.source.link == "far"]
        assert used == [("client", port[0])]
        assert not flight.vehicle().blocked and len(flight.vehicle().paths) == 2
    assert not [text for text in alarms(flight) if "second source" in text or "DUPLICATE" in text]


def test_the_only_client_that_connects_anew_is_followed(wired: MakeWired) -> None:
    port = [1000]
    flight = wired(1, wires=[Wire("far", place=lambda fleet, index: ("client", port[0] + index))]).run(10.0)
    flight.station.fleet.intakes[""].chunks("far", [(b"", ("client", port[0]))], flight.clock.now())
    port[0] += 100
    flight.run(8.0)
    assert flight.vehicle().address == ("client", port[0])
    assert flight.vehicle().freshness(flight.clock.now()) is Freshness.OK
    assert not flight.vehicle().blocked
