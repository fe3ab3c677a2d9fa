"""Missions of other stations from upload to start: the ways between items, and what is known of what is on board.

See `forward_rig` for the area: a pond of 20 m radius at (100, 100) m, vehicle 1 (ArduCopter) at (50, 50) m.
"""

import pytest

from tests.core.rigs.forward_rig import LOCAL, QGC, Rig, frames, link, messages
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import cut_datagram, decode

TO = {"target_system": 1, "target_component": 1, "mission_type": 0}
HOME = (0.0, 0.0)
ROUND_THE_POND = [HOME, (60.0, 60.0), (60.0, 140.0), (140.0, 140.0)]
OVER_THE_POND = [HOME, (100.0, 60.0), (100.0, 140.0)]


def station() -> Rig:
    flight = Rig(link("udpin:a"), commands=True)
    flight.beat()
    return flight


def count(flight: Rig, items: int, **more: int) -> None:
    flight.say("MISSION_COUNT", **TO, count=items, opaque_id=0, **more)


def send(flight: Rig, seq: int, x: float, y: float, *, command: int = 16, param1: float = 0.0, **more: int) -> bool:
    """Whether an item was taken for the upload."""
    lat, lon = LOCAL.to_geodetic(x, y)
    refused = flight.forwarder.refused.total()
    rest = {"frame": 3, "current": 0, "autocontinue": 1, "param1": param1, "param2": 0, "param3": 0, "param4": 0}
    place = {"x": round(float(lat) * 1e7), "y": round(float(lon) * 1e7), "z": 30.0}
    flight.say("MISSION_ITEM_INT", **TO, seq=seq, command=command, **rest, **place, **more)
    return flight.forwarder.refused.total() == refused


def told(flight: Rig, name: str, component: int = 1, **fields: int) -> None:
    """Vehicle 1 says something."""
    flight.forwarder.feed("", "radio", [Encoder(1, component).encode(name, **fields)])


def request(flight: Rig, seq: int, to: int = 252) -> None:
    """Vehicle 1 requests an item of the upload."""
    told(flight, "MISSION_REQUEST", target_system=to, target_component=190, seq=seq, mission_type=0)


def take(flight: Rig, items: int) -> None:
    """Vehicle 1 takes the whole upload that was announced to it."""
    for seq in range(items):
        request(flight, seq)
    acknowledge(flight)


def acknowledge(flight: Rig, to: int = 252, result: int = 0, component: int = 1) -> None:
    answer = {"target_system": to, "target_component": 190, "type": result, "mission_type": 0, "opaque_id": 0}
    told(flight, "MISSION_ACK", component, **answer)


def upload(flight: Rig, places: list[tuple[float, float]]) -> list[bool]:
    """The whole of it as stations do it, and the vehicle takes it; which items passed the checks."""
    count(flight, len(places))
    passed = [send(flight, seq, *place) for seq, place in enumerate(places)]
    if "mission upload" in flight.uplink.whats:
        take(flight, len(places))
    return passed


def starts(flight: Rig) -> bool:
    """Whether a start is passed on, the vehicle being about to fly to item 1."""
    told(flight, "MISSION_CURRENT", seq=1, total=3, mission_state=2, mission_mode=0, mission_id=0, fence_id=0,
         rally_points_id=0)  # fmt: skip
    passed = len(flight.uplink.taken)
    flight.command(300)
    return flight.uplink.whats[passed:] == ["mission start"]


def test_a_mission_around_the_pond_is_uploaded_and_started() -> None:
    flight = station()
    assert all(upload(flight, ROUND_THE_POND)) and starts(flight)
    assert any(frame.msgid == 47 for frame in frames(flight.links[0], QGC)), "the station hears it too"


def test_a_way_over_the_pond_is_not_passed_on_and_what_came_before_is_not_started() -> None:
    flight = station()
    assert upload(flight, OVER_THE_POND) == [True, True, False]
    assert not flight.uplink.taken, "the vehicle keeps the mission that it had"
    assert "mission item 2: the straight way from (100, 60) m there leaves the operating area" in flight.texts()[-1]
    assert not starts(flight)


def test_items_of_no_upload_are_not_passed_on() -> None:
    flight = station()
    assert not any(send(flight, seq, *place) for seq, place in enumerate(ROUND_THE_POND))
    acknowledge(flight)
    assert not starts(flight)


def test_a_mission_is_not_started_over_the_pond_from_where_the_vehicle_is() -> None:
    flight = station()
    upload(flight, [HOME, (140.0, 140.0)])
    assert not starts(flight)
    flight.vehicles[1].telemetry.position_m = (140.0, 60.0, 30.0)
    assert starts(flight)


def test_out_of_order_is_refused_and_the_same_item_again_is_not() -> None:
    flight = station()
    count(flight, 4)
    assert not send(flight, 1, 60, 60)
    assert send(flight, 0, *HOME) and send(flight, 1, 60, 60)
    assert not send(flight, 3, 60, 140)
    assert send(flight, 1, 60, 60), "the vehicle did not get it, and asks again"
    assert not send(flight, 1, 70, 60), "but it is not changed behind our back"
    assert send(flight, 2, 60, 140) and send(flight, 3, 140, 140)
    assert not send(flight, 4, 140, 140), "more than were announced"
    take(flight, 4)
    assert starts(flight)


def test_only_who_began_an_upload_goes_on_with_it() -> None:
    flight = station()
    count(flight, 2)
    assert not send(flight, 0, *HOME, system=251)
    assert send(flight, 0, *HOME)
    flight.clock.advance(1.0)
    count(flight, 2, system=251)
    assert "an upload of udpin:a 192.0.2.7:14550 252/190 is under way" in flight.texts()[-1]
    assert not send(flight, 0, *HOME, system=251) and send(flight, 1, 60, 60)


@pytest.mark.parametrize(("target", "ok"), [(3, True), (2, False), (1, False), (0, False), (5, False), (6, False)])
def test_jumps_lead_back_and_not_over_the_pond(target: int, ok: bool) -> None:
    flight = station()
    places = [HOME, (60.0, 60.0), (60.0, 90.0), (140.0, 60.0), (140.0, 140.0)]  # to 1 and 2 the pond is in the way
    count(flight, 10)
    assert all(send(flight, seq, *place) for seq, place in enumerate(places))
    assert send(flight, 5, 0, 0, command=177, param1=target) == ok


def test_a_take_off_of_a_copter_leads_nowhere_whatever_place_it_names() -> None:
    flight = station()
    count(flight, 3)
    assert send(flight, 0, *HOME) and send(flight, 1, 140, 60, command=22) and send(flight, 2, 140, 140)
    take(flight, 3)
    assert not starts(flight), "it takes off at (50, 50), and from there the pond is in the way"


def test_what_the_vehicle_did_not_take_is_not_started() -> None:
    flight = station()
    count(flight, 2)
    send(flight, 0, *HOME)
    send(flight, 1, 60, 60)
    request(flight, 0)
    acknowledge(flight)
    assert not starts(flight), "half of it was acknowledged: that is not known to be this one"
    upload(flight, [HOME, (60.0, 60.0)])
    assert starts(flight)
    acknowledge(flight, result=13)
    assert not starts(flight)


@pytest.mark.parametrize("what", ["clear", "count", "hand over", "another station", "a part"])
def test_after_a_change_the_mission_is_not_known(what: str) -> None:
    flight = station()
    upload(flight, [HOME, (60.0, 60.0)])
    if what == "clear":
        flight.say("MISSION_CLEAR_ALL", **TO)
    elif what in ("count", "hand over"):
        count(flight, 1)
        assert what == "count" or send(flight, 0, *HOME)
    elif what == "another station":
        flight.beat(system=251)
        acknowledge(flight, to=251)
    else:
        flight.say("MISSION_WRITE_PARTIAL_LIST", **TO, start_index=1, end_index=1)
        assert flight.uplink.whats[-1] != "mission upload", "never passed on"
    # An announcement is answered here: until the upload is complete the vehicle keeps its mission.
    assert starts(flight) == (what in ("a part", "count"))


def test_only_the_autopilot_tells_of_its_mission() -> None:
    flight = station()
    count(flight, 2)
    send(flight, 0, *HOME)
    send(flight, 1, 60, 60)
    request(flight, 0)
    request(flight, 1)
    acknowledge(flight, component=191)
    assert not starts(flight)


def test_a_mission_being_flown_is_not_changed() -> None:
    flight = station()
    count(flight, 2)
    flight.vehicles[1].telemetry.custom_mode = 3  # AUTO: ArduPilot would fly to each new item at once
    passed = len(flight.uplink.taken)
    count(flight, 2)
    flight.say("MISSION_CLEAR_ALL", **TO)
    assert not send(flight, 0, *HOME) and len(flight.uplink.taken) == passed
    assert "it flies its mission: have it hold" in " ".join(flight.texts())
    flight.vehicles[1].telemetry.armed = False
    assert not send(flight, 0, *HOME), "the refused upload has ended"
    count(flight, 2)
    assert send(flight, 0, *HOME)


def test_nothing_is_set_on_an_armed_vehicle_nor_its_position_made_rare() -> None:
    flight = station()
    passed = len(flight.uplink.taken)
    for name in (
        "FORMAT_VERSION",
        "SERIAL0_PROTOCOL",
        "MOT_SPIN_MIN",
        "ATC_RAT_RLL_P",
        "BATT_LOW_VOLT",
        "LOG_DISARMED",
    ):
        flight.say("PARAM_SET", target_system=1, target_component=1, param_id=name, param_value=0.0, param_type=9)
    flight.command(511, 0, 10_000_000)
    flight.command(511, 33, 10_000_000)
    assert len(flight.uplink.taken) == passed and flight.forwarder.refused == {"by the rules": 8}


# ---------------------------------------------------------------- all or nothing


def names(flight: Rig) -> list[str]:
    """What the other station was sent since the last time, by name and sender."""
    return [f"{m.name} {m.fields.get('seq', m.fields.get('type', ''))}".strip() for m in messages(flight.links[0], QGC)]


def test_an_upload_is_collected_checked_and_only_then_handed_over_unchanged() -> None:
    flight = station()
    count(flight, 3)
    assert names(flight) == ["MISSION_REQUEST 0"], "in the vehicle's place, and as ArduCopter does"
    send(flight, 0, *HOME)
    send(flight, 1, 60, 60)
    assert names(flight) == ["MISSION_REQUEST 1", "MISSION_REQUEST 2"] and not flight.uplink.taken
    send(flight, 2, 60, 140)
    assert flight.uplink.whats == ["mission upload"]
    take(flight, 3)
    assert flight.uplink.whats == ["mission upload"] + ["mission upload item"] * 3
    assert names(flight) == ["MISSION_ACK 0"], "requests of the vehicle are answered here, its result is passed on"
    sent = [decode(cut_datagram(raw).frames[0]) for _, raw, _, _ in flight.uplink.taken]
    assert [m.name for m in sent if m] == ["MISSION_COUNT"] + ["MISSION_ITEM_INT"] * 3
    assert all(m is not None and m.system == 252 for m in sent)


@pytest.mark.parametrize(
    ("command", "place", "result"), [(16, (300.0, 60.0), 14), (601, (60.0, 60.0), 3), (16, (100.0, 100.0), 14)]
)
def test_a_refused_item_ends_the_upload_with_a_result_and_its_reason(
    command: int, place: tuple[float, float], result: int
) -> None:
    flight = station()
    upload(flight, ROUND_THE_POND)
    flight.uplink.taken.clear()
    names(flight)
    count(flight, 4)
    send(flight, 0, *HOME)
    send(flight, 1, 60, 60)
    assert not send(flight, 2, *place, command=command)
    assert not send(flight, 3, 60, 140), "the rest of it is not taken"
    assert not flight.uplink.taken, "nothing was truncated"
    heard = names(flight)
    assert heard[:4] == ["MISSION_REQUEST 0", "MISSION_REQUEST 1", "MISSION_REQUEST 2", f"MISSION_ACK {result}"]
    assert heard[4] == "STATUSTEXT"
    assert starts(flight), "the mission before is on board still"


def test_an_upload_that_its_station_or_the_vehicle_leaves_ends_with_a_result() -> None:
    flight = station()
    count(flight, 2)
    for _ in range(9):
        flight.clock.advance(1.01)
        flight.forwarder.tick()
    assert names(flight) == ["MISSION_REQUEST 0"] * 8 + ["MISSION_ACK 15", "STATUSTEXT"]
    count(flight, 2)
    send(flight, 0, *HOME)
    send(flight, 1, 60, 60)
    for _ in range(9):
        flight.clock.advance(1.01)
        flight.forwarder.tick()
    assert flight.uplink.whats == ["mission upload"] + ["mission upload item"] * 7, "the announcement again"
    # The station is kept waiting by requests of the last item.
    assert names(flight)[2:] == ["MISSION_REQUEST 1"] * 7 + ["MISSION_ACK 15"] + ["STATUSTEXT"] * 2
    assert not starts(flight)


def test_while_items_are_handed_over_nothing_else_changes_the_mission() -> None:
    flight = station()
    count(flight, 2)
    send(flight, 0, *HOME)
    send(flight, 1, 60, 60)
    request(flight, 0)
    passed = len(flight.uplink.taken)
    flight.say("MISSION_CLEAR_ALL", **TO)
    count(flight, 1)
    flight.say("MISSION_ACK", **TO, type=15, opaque_id=0)
    send(flight, 1, 70, 60)
    assert len(flight.uplink.taken) == passed
    request(flight, 1)
    acknowledge(flight)
    assert starts(flight)


def test_a_station_may_end_its_upload_before_it_is_complete() -> None:
    flight = station()
    count(flight, 2)
    send(flight, 0, *HOME)
    flight.say("MISSION_ACK", **TO, type=15, opaque_id=0)
    assert not send(flight, 1, 60, 60) and not flight.uplink.taken


def test_what_the_vehicle_refuses_itself_is_passed_on() -> None:
    flight = station()
    count(flight, 1)
    send(flight, 0, *HOME)
    names(flight)
    request(flight, 0)
    acknowledge(flight, result=13)
    assert names(flight) == [], "ArduPilot answers a repeated item so, and goes on"
    acknowledge(flight, result=4)
    assert names(flight) == ["MISSION_ACK 4"] and not starts(flight)
