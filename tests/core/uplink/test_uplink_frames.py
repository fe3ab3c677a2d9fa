"""The uplink by itself: which bytes go to which address, what is refused, what is journalled and recorded."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.core.rigs.heard import ARMED, BEAT
from tests.core.rigs.uplink_rig import UplinkRig
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.fleet.identity.path import PathState
from tui_gcs.core.guard.permission import PASS, Order, OrderClass, StopReason, Verdict
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.signing import SigningKey
from tui_gcs.core.services.files.ftp_codec import Op
from tui_gcs.core.uplink.questions import MESSAGES, question

COMMAND = {"confirmation": 0, "param1": 1, "param2": 0, "param3": 0, "param4": 0, "param5": 0, "param6": 0, "param7": 0}
ARM_COMMAND = COMMAND | {"command": 400}
ASK = COMMAND | {"command": 512}
ARM, MODE = Order("arm", OrderClass.START), Order("mode")
HOLD, LAND = Order("hold", OrderClass.STOP), Order("land", OrderClass.STOP)
PLACE = {
    "time_boot_ms": 0,
    "coordinate_frame": 6,
    "type_mask": 0,
    "lat_int": 1,
    "lon_int": 2,
    "alt": 3,
    "vx": 0,
    "vy": 0,
}
PLACE |= {"vz": 0, "afx": 0, "afy": 0, "afz": 0, "yaw": 0, "yaw_rate": 0}
SECRET = bytes(range(32))


def test_an_action_leaves_for_one_vehicle_and_is_journalled_and_recorded(tmp_path: Path) -> None:
    way = UplinkRig(tmp_path)
    assert way.uplink.action(1, ARM, "COMMAND_LONG", **ARM_COMMAND) == ""
    ((name, fields, address),) = way.sent()
    assert (name, address, fields["command"], fields["param1"]) == ("COMMAND_LONG", "there", 400, 1.0)
    assert (fields["target_system"], fields["target_component"]) == (1, 1)
    (line,) = way.journalled()
    assert line.pop("wall_s") > 0
    order = {"action": "arm", "class": "start", "by": "station", "vehicle": 1}
    assert line == order | {"message": "COMMAND_LONG", "command": 400, "param1": 1}
    assert way.recorded() == [76] and way.uplink.sent == 1


def test_whatever_a_caller_writes_it_is_addressed_to_the_vehicle(tmp_path: Path) -> None:
    """Another component of it may be meant (a gimbal), another system never."""
    way = UplinkRig(tmp_path)
    way.uplink.ask(1, "COMMAND_LONG", **ASK, target_system=9, target_component=154)
    ((_, fields, _),) = way.sent()
    assert (fields["target_system"], fields["target_component"]) == (1, 154)
    way.uplink.ask(1, "PARAM_REQUEST_LIST")
    ((_, fields, _),) = way.sent()
    assert (fields["target_system"], fields["target_component"]) == (1, 1), "all that it has"


def test_who_is_not_known_is_sent_nothing(tmp_path: Path) -> None:
    way = UplinkRig(tmp_path)
    assert way.uplink.action(2, ARM, "COMMAND_LONG", **ARM_COMMAND) == "unknown vehicle"
    assert way.uplink.ask(2, "COMMAND_LONG", **ASK) == "unknown vehicle"
    assert not way.uplink.transfer(2, "upload", "MISSION_COUNT", count=1, mission_type=0, opaque_id=0)
    way.uplink.setpoint(2, PASS, **PLACE)
    assert way.sent() == [] and way.uplink.refused == {"unknown vehicle": 4}
    way.heard.clock.advance(1.0)
    way.uplink.tick()
    assert way.journalled() == [], "nothing was done"
    (reported, *_) = (event for event in way.heard.events.since(0) if "NOT SENT" in event.text)
    assert (reported.source, reported.text) == ("vehicle 2", "COMMAND_LONG NOT SENT: unknown vehicle")


def test_system_0_is_everybody_and_never_addressed(tmp_path: Path) -> None:
    way = UplinkRig(tmp_path)
    way.heard.vehicle.system = 0
    assert way.uplink.action(1, HOLD, "COMMAND_LONG", **ARM_COMMAND) == "unknown vehicle"
    assert way.sent() == []


def test_who_must_not_be_commanded_is_stopped_and_nothing_else(tmp_path: Path) -> None:
    way = UplinkRig(tmp_path)
    way.heard.vehicle.identity.blocked = "several vehicles use id 1"
    assert way.uplink.action(1, ARM, "COMMAND_LONG", **ARM_COMMAND) == "several vehicles use id 1"
    assert not way.uplink.transfer(1, "upload", "MISSION_COUNT", count=1, mission_type=0, opaque_id=0)
    assert way.uplink.foreign(1, b"raw", replace(ARM, by="QGC")) == "several vehicles use id 1"
    assert way.uplink.give_key(way.heard.vehicle, SigningKey("alpha", SECRET)) == "several vehicles use id 1"
    way.uplink.setpoint(1, PASS, **PLACE)
    assert way.sent() == [] and way.uplink.refused == {"several vehicles use id 1": 4}
    assert [text for text in way.heard.told() if "NOT SENT" in text] == [
        "COMMAND_LONG NOT SENT: several vehicles use id 1",
        "MISSION_COUNT NOT SENT: several vehicles use id 1",
        "set-point NOT SENT: several vehicles use id 1",
    ]
    assert [line for line in way.journalled() if "action" in line] == []
    for stop in ("hold", "land", "disarm", "return"):
        assert way.uplink.action(1, Order(stop, OrderClass.STOP), "COMMAND_LONG", **COMMAND, command=21) == ""
    assert len(way.sent()) == 4


def test_who_is_lost_is_stopped_and_nothing_else(tmp_path: Path) -> None:
    way = UplinkRig(tmp_path)
    way.heard.clock.advance(4.0)
    assert way.uplink.action(1, ARM, "COMMAND_LONG", **ARM_COMMAND) == "arm: nothing has been heard of it"
    assert way.uplink.action(1, LAND, "COMMAND_LONG", **COMMAND, command=21) == ""
    assert [fields["command"] for _, fields, _ in way.sent()] == [21]


def test_what_is_being_set_up_is_not_started_on_the_ground(tmp_path: Path) -> None:
    way = UplinkRig(tmp_path, **ARMED)
    way.heard.vehicle.set_up.add("compass calibration")
    for start in ("arm", "take-off", "mission start"):
        order = Order(start, OrderClass.START)
        assert way.uplink.action(1, order, "COMMAND_LONG", **ARM_COMMAND) == "compass calibration is under way"
    assert way.uplink.action(1, MODE, "COMMAND_LONG", **ARM_COMMAND) == ""
    way.heard.is_at(relative_alt=20_000)
    assert way.uplink.action(1, ARM, "COMMAND_LONG", **ARM_COMMAND) == "", "it flies"


def test_a_sim_station_commands_its_own_vehicles_only_and_asks_the_others_who_they_are(tmp_path: Path) -> None:
    way = UplinkRig(tmp_path, RunKind.SIM, token="0123")
    not_ours = "not one of our simulated vehicles"
    assert way.uplink.action(1, HOLD, "COMMAND_LONG", **ARM_COMMAND) == not_ours
    assert way.uplink.foreign(1, b"raw", replace(HOLD, by="QGC")) == not_ours
    assert way.uplink.give_key(way.heard.vehicle, SigningKey("alpha", SECRET)) == not_ours
    way.uplink.setpoint(1, PASS, **PLACE)
    assert not way.uplink.transfer(1, "upload", "MISSION_COUNT", count=1, mission_type=0, opaque_id=0)
    assert way.sent() == []
    way.heard.clock.advance(1.0)
    way.uplink.tick()
    assert [line for line in way.journalled() if "refused" not in line] == [], "nothing was done"
    way.heard.say("HEARTBEAT", **BEAT)
    assert way.uplink.ask(1, "COMMAND_LONG", **COMMAND, command=512) == "" and len(way.sent()) == 1
    way.heard.vehicle.identity.firmware_token = "0123"
    assert way.uplink.action(1, HOLD, "COMMAND_LONG", **ARM_COMMAND) == not_ours, (
        "who has not said its version proves nothing"
    )
    way.heard.vehicle.identity.identified = True
    assert way.uplink.action(1, HOLD, "COMMAND_LONG", **ARM_COMMAND) == ""


def test_live_and_with_a_simulator_of_ones_own_every_vehicle_is_ours(tmp_path: Path) -> None:
    """`--kind sim` has no token to prove anything with; LIVE nobody is asked for one."""
    for folder, kind, token in (("a", RunKind.SIM, ""), ("b", RunKind.LIVE, "0123")):
        (tmp_path / folder).mkdir()
        way = UplinkRig(tmp_path / folder, kind, token)
        assert way.uplink.is_ours(way.heard.vehicle)


def test_a_message_without_a_target_goes_as_it_is(tmp_path: Path) -> None:
    way = UplinkRig(tmp_path)
    beat = {"custom_mode": 0, "type": 6, "autopilot": 8, "base_mode": 0, "system_status": 4, "mavlink_version": 3}
    assert way.uplink.ask(1, "HEARTBEAT", **beat) == ""
    assert way.sent() == [("HEARTBEAT", beat, "there")]


def test_a_stop_goes_over_every_way_everything_else_over_the_one_in_use(tmp_path: Path) -> None:
    way = UplinkRig(tmp_path)
    fleet, vehicle = way.heard.fleet, way.heard.vehicle
    second = fleet.paths.first_path(fleet.intakes[""].source("other radio", "elsewhere"))
    vehicle.paths.append(second)
    way.uplink.action(1, MODE, "COMMAND_LONG", **ARM_COMMAND)
    assert (len(way.sent()), way.sent("other radio")) == (1, [])
    way.uplink.action(1, HOLD, "COMMAND_LONG", **ARM_COMMAND)
    assert [address for _, _, address in way.sent() + way.sent("other radio")] == ["there", "elsewhere"]


def test_a_stop_by_set_point_goes_over_every_path_and_is_journalled_with_who_ordered_it(tmp_path: Path) -> None:
    """The same place again is counted only; another place, or another reason, is a line of its own."""
    way = UplinkRig(tmp_path)
    fleet, vehicle = way.heard.fleet, way.heard.vehicle
    vehicle.paths.append(fleet.paths.first_path(fleet.intakes[""].source("other radio", "elsewhere")))
    hold = StopReason("hold", "console-1")
    other = PLACE | {"lat_int": 5}
    for permission, fields in ((hold, PLACE), (hold, PLACE), (hold, other), (PASS, PLACE), (hold, PLACE)):
        way.uplink.setpoint(1, permission, **fields)
    assert (len(way.sent()), len(way.sent("other radio"))) == (5, 4)
    lines = way.journalled()
    assert [line["lat_int"] for line in lines] == [1, 5, 1]
    stop = {"action": "hold", "class": "stop", "by": "console-1", "vehicle": 1}
    assert all(line | stop == line and line["message"] == "SET_POSITION_TARGET_GLOBAL_INT" for line in lines)
    way.heard.clock.advance(1.0)
    way.uplink.tick()
    assert way.journalled()[-1]["setpoints"] == {"1": 5}


def test_a_set_point_that_was_vetoed_does_not_leave(tmp_path: Path) -> None:
    way = UplinkRig(tmp_path)
    way.uplink.setpoint(1, Verdict("area", "outside"), **PLACE)
    assert way.sent() == [] and way.uplink.refused == {"vetoed: outside": 1}


def test_an_order_that_is_called_a_stop_is_none(tmp_path: Path) -> None:
    """Its class decides: "hold" of the class of settings goes over one path, and not to a vehicle that is lost."""
    way = UplinkRig(tmp_path)
    fleet, vehicle = way.heard.fleet, way.heard.vehicle
    vehicle.paths.append(fleet.paths.first_path(fleet.intakes[""].source("other radio", "elsewhere")))
    assert way.uplink.action(1, Order("hold"), "COMMAND_LONG", **ARM_COMMAND) == ""
    assert (len(way.sent()), way.sent("other radio")) == (1, [])
    way.heard.clock.advance(4.0)
    assert way.uplink.action(1, Order("hold"), "COMMAND_LONG", **ARM_COMMAND) == "hold: nothing has been heard of it"
    assert way.uplink.action(1, Order("anything", OrderClass.STOP), "COMMAND_LONG", **ARM_COMMAND) == ""


def test_no_message_that_changes_a_vehicle_leaves_as_a_question() -> None:
    """Of all messages that are addressed to a system only those of the list may leave without the guard's verdict."""
    names = {name for msgid in range(400) if (name := dialect.message_name(msgid)) is not None}
    changing = names - MESSAGES - {"COMMAND_LONG", "FILE_TRANSFER_PROTOCOL"}
    assert {"COMMAND_INT", "SET_MODE", "MISSION_ITEM_INT", "MANUAL_CONTROL", "PARAM_SET", "MISSION_COUNT"} <= changing
    assert [name for name in sorted(changing) if question(name, {}) is not None] == []


@pytest.mark.parametrize("command", [16, 20, 21, 22, 176, 178, 192, 193, 246, 300, 400])
def test_no_command_that_changes_a_vehicle_leaves_as_a_question(tmp_path: Path, command: int) -> None:
    way = UplinkRig(tmp_path)
    why = "no question: it would change the vehicle"
    assert way.uplink.ask(1, "COMMAND_LONG", **COMMAND, command=command) == why
    assert way.sent() == [] and way.uplink.refused == {why: 1}


def test_files_are_read_by_questions_and_never_changed_by_one() -> None:
    asks = {op: question("FILE_TRANSFER_PROTOCOL", {"payload": [0, 0, 0, op]}) is not None for op in Op}
    changing = {Op.CREATE, Op.WRITE, Op.REMOVE}
    assert not any(asks[op] for op in changing)
    assert all(asks[op] for op in (Op.TERMINATE, Op.RESET, Op.LIST, Op.OPEN_READ, Op.READ, Op.BURST, Op.CRC32))


def test_a_stop_goes_to_where_good_signatures_came_from_just_now_too(tmp_path: Path) -> None:
    """The address in use may be a relay's that swallows it."""
    way = UplinkRig(tmp_path)
    fleet, vehicle, clock = way.heard.fleet, way.heard.vehicle, way.heard.clock
    second = fleet.paths.first_path(fleet.intakes[""].source("other radio", "elsewhere"))
    second.state, second.proven_s = PathState.CANDIDATE, clock.now()
    vehicle.paths.append(second)
    clock.advance(2.9)
    way.uplink.action(1, HOLD, "COMMAND_LONG", **ARM_COMMAND)
    assert (len(way.sent()), len(way.sent("other radio"))) == (1, 1)
    clock.advance(0.2)
    way.uplink.action(1, HOLD, "COMMAND_LONG", **ARM_COMMAND)
    assert (len(way.sent()), len(way.sent("other radio"))) == (1, 0)


def test_another_stations_frame_passes_as_it_is_and_is_journalled_with_its_source(tmp_path: Path) -> None:
    way = UplinkRig(tmp_path)
    raw = Encoder(250, 190).encode("COMMAND_LONG", target_system=1, target_component=1, **ARM_COMMAND)
    assert way.uplink.foreign(1, raw, replace(ARM, by="QGC")) == ""
    assert way.links["radio"].sent.popleft() == (raw, "there")
    assert way.uplink.foreign(2, raw, replace(ARM, by="QGC")) == "unknown vehicle"
    way.heard.vehicle.identity.keyed = True
    why = "the vehicle takes signed frames only, and another station's are not signed for it"
    assert way.uplink.foreign(1, raw, replace(ARM, by="QGC")) == why and way.uplink.refused[why] == 1
    passed, refused = way.journalled()
    assert {key: passed[key] for key in passed if key != "wall_s"} == {"foreign": "arm", "source": "QGC", "vehicle": 1}
    assert (refused["refused"], refused["source"]) == (why, "QGC")
    assert way.recorded() == [76]


def test_a_key_goes_to_one_vehicle_and_is_neither_recorded_nor_journalled(tmp_path: Path) -> None:
    way = UplinkRig(tmp_path)
    key = SigningKey("alpha", SECRET)
    assert way.uplink.give_key(way.heard.vehicle, key) == ""
    ((name, fields, address),) = way.sent()
    assert (name, address, fields["target_system"]) == ("SETUP_SIGNING", "there", 1)
    assert bytes(fields["secret_key"]) == SECRET
    (line,) = way.journalled()
    assert line == {"action": "provision key", "vehicle": 1, "key": "alpha", "fingerprint": key.fingerprint}
    way.uplink.ask(1, "COMMAND_LONG", **ASK)
    assert way.recorded() == [76]


def test_set_points_and_parts_of_transfers_are_one_line_a_second(tmp_path: Path) -> None:
    way = UplinkRig(tmp_path)
    for _ in range(5):
        way.uplink.setpoint(1, PASS, **PLACE)
        assert way.uplink.transfer(1, "upload", "MISSION_COUNT", count=1, mission_type=0, opaque_id=0)
    way.uplink.tick()
    way.heard.clock.advance(1.0)
    way.uplink.tick()
    points, parts = way.journalled()
    assert points["setpoints"] == {"1": 5} and (parts["action"], parts["vehicle"], parts["parts"]) == ("upload", 1, 5)
    way.uplink.setpoint(1, PASS, **PLACE)
    way.heard.clock.advance(0.9)
    way.uplink.tick()
    assert len(way.journalled()) == 2
    way.heard.clock.advance(0.1)
    way.uplink.tick()
    assert way.journalled()[2]["setpoints"] == {"1": 1}


def test_our_heartbeat_goes_once_to_each_address_and_never_over_a_satellite(tmp_path: Path) -> None:
    way = UplinkRig(tmp_path)
    way.links["radio"].partners = ["there", "partner"]
    way.links["satellite"].partners = ["modem"]
    list(way.uplink.heartbeat())
    beats = way.sent()
    assert [(name, address) for name, _, address in beats] == [("HEARTBEAT", "partner"), ("HEARTBEAT", "there")]
    said = beats[0][1]
    assert (said["type"], said["autopilot"], said["mavlink_version"], said["system_status"]) == (6, 8, 3, 4)
    assert said["base_mode"] == said["custom_mode"] == 0, "never armed"
    assert way.sent("satellite") == [] and way.sent("other radio") == []
    assert way.recorded() == [0]


def test_a_big_fleets_heartbeats_leave_in_parts_and_nobody_is_left_out(tmp_path: Path) -> None:
    way = UplinkRig(tmp_path)
    way.links["radio"].partners = [f"partner {number}" for number in range(100)]
    so_far = []
    for _ in way.uplink.heartbeat():
        so_far.append(len(way.links["radio"].sent))
    assert so_far == [40, 80, 101]
    assert len({address for _, _, address in way.sent()}) == 101


def test_commands_go_over_a_satellite_questions_of_who_is_there_do_not(tmp_path: Path) -> None:
    way = UplinkRig(tmp_path)
    fleet, vehicle = way.heard.fleet, way.heard.vehicle
    vehicle.path = fleet.paths.first_path(fleet.intakes[""].source("satellite", "modem"))
    vehicle.paths = [vehicle.path]
    way.uplink.ask_path(vehicle, vehicle.path, 148)
    list(way.uplink.heartbeat())
    assert way.sent("satellite") == []
    assert way.uplink.action(1, LAND, "COMMAND_LONG", **COMMAND, command=21) == ""
    assert [(fields["command"], address) for _, fields, address in way.sent("satellite")] == [(21, "modem")]


def test_who_is_on_a_path_is_asked_there_for_one_message(tmp_path: Path) -> None:
    way = UplinkRig(tmp_path)
    vehicle = way.heard.vehicle
    way.uplink.ask_path(vehicle, vehicle.path, 148)
    ((name, fields, address),) = way.sent()
    assert (name, address, fields["command"], fields["param1"]) == ("COMMAND_LONG", "there", 512, 148.0)
    assert all(fields[f"param{number}"] == 0.0 for number in range(2, 8))
    assert vehicle.identity.version_requested_s == way.heard.clock.now() and way.recorded() == [76]
