"""Two vehicles with one id are found, and neither is commanded: the whole station in lock-step."""

from typing import Any

import pytest

from tests.core.rigs import orders
from tests.core.rigs.wires import MakeWired, Wire, Wired, apart, at, only
from tui_gcs.core.mavlink.intake import MAX_SOURCES
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Freshness, Phase
from tui_gcs.core.records.event_log import ALERT


def twins_told(flight: Wired, within_s: float = 5.0) -> None:
    """The id is blocked, and that is shown everywhere."""
    flight.until(lambda: bool(flight.vehicle().why_not_commanded), within_s, "two vehicles with one id")
    flight.run(0.2)
    assert "several vehicles use id 1" in flight.vehicle().why_not_commanded
    status = flight.status()
    assert "several vehicles use id 1" in status.not_ready[1]
    assert "NOT COMMANDED" in status.alarm and "several vehicles" in status.alarm
    assert flight.frame is not None and "several vehicles" in flight.frame.problem[flight.frame.ids.index(1)]
    reply = flight.ask(m.Start(vehicles=(1,)))
    assert not reply.ok and "several vehicles use id 1" in reply.results[0].text
    assert [e for e in flight.events() if e.severity == ALERT and "DUPLICATE ID" in e.text]


def only_stops_pass(flight: Wired) -> None:
    since_s = flight.clock.now()
    uplink = flight.station.comms.uplink
    before = uplink.refused.total()
    flight.station.comms.commands.submit(orders.prepare(flight, 1))
    flight.run(1.0)
    assert uplink.refused.total() > before
    assert all(176 not in flight.commands(wire, since_s) for wire in flight.wires)
    flight.station.comms.commands.submit(orders.land(flight, 1))
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
        flight.vehicle().identity.uid = "" if uid == "none" else (b"f" * 17 + b"\0").hex()
    if age_s == 0.0:  # just switched on: it is quiet at first
        flight.run(1.0)
    twins_told(flight)
    only_stops_pass(flight)
    flight.remove(twin)
    flight.until(lambda: not flight.vehicle().why_not_commanded, 16.0, "resolved")
    assert "only one vehicle uses this id again" in flight.texts("vehicle 1")
    flight.run(20.0)
    assert not flight.vehicle().why_not_commanded and flight.vehicle().freshness(flight.clock.now()) is Freshness.OK


@pytest.mark.parametrize("case", list(CASES))
def test_it_stays_blocked_while_both_are_there(wired: MakeWired, case: str) -> None:
    flight = wired(1, wires=fresh(CASES[case])).run(20.0)
    flight.stranger(age_s=100.0)
    twins_told(flight)
    for _ in range(120):
        flight.run(0.5)
        assert flight.vehicle().why_not_commanded
    said = [e for e in flight.events() if "DUPLICATE ID" in e.text]
    assert len(said) <= 3


@pytest.mark.parametrize("turn_s", [1.5, 3.0, 6.0])
def test_two_that_a_relay_lets_through_by_turns_are_two(wired: MakeWired, turn_s: float) -> None:
    """Each turn came out as a reboot: whatever had been arranged was forgotten again and again, and nobody was told."""
    whose = [0]

    def by_turns(fleet: int, _index: int) -> tuple[str, int] | None:
        return ("relay", 0) if fleet == whose[0] else None

    flight = wired(1, wires=[Wire("near", place=by_turns)]).run(20.0)
    flight.stranger(age_s=100.0)
    flight.same_uid()
    flight.vehicle().identity.uid = ""
    before = flight.vehicle().integrity.reboots
    for turn in range(1, 9):
        whose[0] = turn % 2
        flight.run(turn_s)
    assert "several vehicles use id 1 on one address" in flight.vehicle().why_not_commanded
    assert flight.vehicle().integrity.reboots <= before + 1


def test_in_flight_a_stranger_elsewhere_does_not_stop_ours_from_being_steered(wired: MakeWired) -> None:
    for wires in (fresh(CASES["same link, other address"]), fresh(CASES["other link"])):
        flight = wired(1, wires=wires).flying().run(5.0)
        flight.stranger(age_s=100.0)
        flight.run(8.0)
        since_s = flight.clock.now()
        assert flight.vehicle().identity.blocked and not flight.vehicle().why_not_commanded
        flight.run(5.0)
        assert flight.phase(1) is Phase.FLYING
        assert len(flight.sent_to(1, since_s=since_s)) >= 20
        assert not [raw for t, raw in flight.wires[-1].seen if t > since_s and len(wires) > 1 and raw[7] == 86]


def test_in_flight_twins_at_one_address_get_stops_only(wired: MakeWired) -> None:
    flight = wired(1, wires=fresh(CASES["same address"])).flying().run(5.0)
    flight.stranger(age_s=100.0)
    flight.until(lambda: bool(flight.vehicle().why_not_commanded), 5.0)
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
        assert not flight.vehicle().why_not_commanded


def test_a_camera_with_an_address_of_its_own_is_no_second_vehicle(wired: MakeWired) -> None:
    from tui_gcs.core.mavlink.encode import Encoder

    flight = wired(1, wires=[Wire("near")]).run(10.0)
    camera = Encoder(1, 100)
    fields = {"type": 30, "autopilot": 8, "base_mode": 0, "custom_mode": 0, "system_status": 4, "mavlink_version": 3}
    for k in range(200):
        if k == 100:
            flight.wires[0].up = False
        flight.wires[0].link.inject(camera.encode("HEARTBEAT", **fields), ("camera", 1))
        flight.run(0.2)
    assert not flight.vehicle().identity.blocked
    assert flight.vehicle().address == ("sim", 0), "nor does it tell where its vehicle is"
    assert flight.station.picture.fleet.dropped["component at another address"] >= 150


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
    assert len(flight.station.picture.fleet.intakes[""].sources) < MAX_SOURCES


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


@pytest.mark.parametrize("link", ["near", "far"], ids=["same link", "another link"])
@pytest.mark.parametrize("delay_s", [0.1, 0.7, 12.0])
def test_replayed_frames_do_not_make_two_vehicles(wired: MakeWired, delay_s: float, link: str) -> None:
    near, far = Wire("near"), Wire("far", place=only(9))
    flight = wired(1, wires=[near, far]).run(6.0)
    target = near if link == "near" else far
    plain, kept = near.from_vehicle, []

    def replay(now: float, data: bytes, address: Any) -> None:
        plain(now, data, address)
        kept.append((now + delay_s, data))
        while kept and kept[0][0] <= now:
            target.link.inject(kept.pop(0)[1], ("stranger", 1))

    near.from_vehicle = replay  # type: ignore[method-assign]
    for _ in range(40):
        flight.run(1.0)
        assert "several vehicles" not in flight.vehicle().why_not_commanded
    assert flight.vehicle().address == ("sim", 0)
    # Over another link copies that are hardly late are what a second link of the vehicle brings.
    assert any("a replay" in text for text in flight.texts()) == (link == "near" or delay_s > 3.0)


@pytest.mark.parametrize("delay_s", [0.02, 0.8, 1.7])
@pytest.mark.parametrize("autopilots", ["ardupilot", "px4"])
def test_a_second_link_is_not_called_a_replay(wired: MakeWired, autopilots: str, delay_s: float) -> None:
    """At the start of a station, and when it starts anew while the vehicle is heard."""
    flight = wired(1, wires=[Wire("near"), Wire("far", delay_s=delay_s)], autopilots=autopilots).run(10.0)
    flight.boot_station()
    flight.run(10.0)
    assert {path.source.link for path in flight.vehicle().paths} == {"near", "far"}
    assert not [text for text in flight.texts() if "a replay" in text]


def test_five_seconds_that_are_replayed_again_and_again_do_not_make_two_vehicles(wired: MakeWired) -> None:
    near = Wire("near")
    flight = wired(1, wires=[near]).run(6.0)
    plain, kept = near.from_vehicle, []

    def record(now: float, data: bytes, address: Any) -> None:
        plain(now, data, address)
        kept.append((now, data))

    near.from_vehicle = record  # type: ignore[method-assign]
    flight.run(5.0)
    near.from_vehicle = plain  # type: ignore[method-assign]
    begin_s, captured = kept[0][0], list(kept)
    for _ in range(6):
        played_s, waiting = flight.clock.now(), list(captured)
        while waiting:
            while waiting and waiting[0][0] - begin_s <= flight.clock.now() - played_s:
                near.link.inject(waiting.pop(0)[1], ("stranger", 1))
            flight.step()
        assert not flight.vehicle().why_not_commanded
