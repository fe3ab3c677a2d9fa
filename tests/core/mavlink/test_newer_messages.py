"""Messages that pymavlink lacks make sense as PX4 sent them, and older programs understand what we send of them."""

import json
import lzma
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as pymavlink_all

from sitl.links.wire import cut
from tests.core.rigs.rig import Rig
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.dialect import MavlinkMessage
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import cut_datagram, decode
from tui_gcs.core.records.tlog_reader import read_tlog

MakeRig = Callable[..., Rig]
ROOT = Path(__file__).parents[3]
SHARED = ROOT.parent / "shared" / "data"
EXCERPT = ROOT / "tests" / "data" / "px4-8.tlog"
PX4 = [EXCERPT, *sorted(SHARED.glob("px4-*.tlog"))]
TIMES = {"tc1": 5_000_000_000, "ts1": 1_795_254_034_123_121_369}


def messages(path: Path, *names: str) -> Iterator[MavlinkMessage]:
    """Those messages of a recording, in order."""
    ids = {found.msgid for found in map(dialect.layout_named, names) if found is not None}
    assert len(ids) == len(names)
    for _, frame in read_tlog(path):
        if frame.msgid in ids:
            message = decode(frame)
            assert message is not None
            yield message


# ---------------------------------------------------------------- as PX4 sent them


def test_the_first_event_of_a_vehicle_is_as_its_bytes_read_by_eye() -> None:
    raw = next(frame.raw for _, frame in read_tlog(EXCERPT) if (frame.system, frame.msgid) == (1, 410))
    # id, time since boot, sequence, to component 0 of system 0, log levels 8 and 8, arguments without zeros at the end
    assert raw[10:-15].hex(" ") == (
        "e0 93 a8 01 78 22 00 00 05 00 00 00 88 00 00 00 10 00 80 00 00 00 b0 3a 7f 80 b0 3a 7f 80"
    )
    event = decode(cut_datagram(raw).frames[0])
    assert event == (
        "EVENT",
        410,
        1,
        1,
        {
            "id": 0x01A893E0,
            "event_time_boot_ms": 0x2278,
            "sequence": 5,
            "destination_component": 0,
            "destination_system": 0,
            "log_levels": 0x88,
            "arguments": (0, 0, 0, 16, 0, 128, 0, 0, 0, 176, 58, 127, 128, 176, 58, 127, 128, *(0,) * 23),
        },
    )


@pytest.mark.parametrize("path", PX4, ids=lambda path: f"{path.parent.parent.name}-{path.stem}")
def test_events_are_of_the_autopilot_and_on_time_and_it_tells_their_sequence(path: Path) -> None:
    boot_ms: dict[int, int] = {}
    newest: dict[int, int] = {}
    events = 0
    for message in messages(path, "EVENT", "CURRENT_EVENT_SEQUENCE", "ATTITUDE", "GLOBAL_POSITION_INT"):
        fields = message.fields
        if "time_boot_ms" in fields:
            boot_ms[message.system] = fields["time_boot_ms"]
            continue
        before = newest.get(message.system, fields["sequence"])
        ahead = (fields["sequence"] - before + 0x8000) % 0x10000 - 0x8000
        if message.name == "CURRENT_EVENT_SEQUENCE":
            assert fields["flags"] in (0, 1)
            assert ahead >= 0
        else:
            events += 1
            assert fields["id"] >> 24 == 1, "component of the id: the autopilot"
            assert fields["log_levels"] & 15 <= 8 and fields["log_levels"] >> 4 <= 8
            assert fields["destination_system"] in (0, 255)
            assert abs(fields["event_time_boot_ms"] - boot_ms.get(message.system, fields["event_time_boot_ms"])) < 3000
        newest[message.system] = fields["sequence"]
    assert events >= 35


@pytest.mark.skipif(not SHARED.exists(), reason="the metadata of that PX4 is not beside this repository")
@pytest.mark.parametrize("path", PX4, ids=lambda path: f"{path.parent.parent.name}-{path.stem}")
def test_every_event_is_one_that_this_px4_can_tell(path: Path) -> None:
    reported = json.loads(lzma.decompress((SHARED / "px4" / "all_events.json.xz").read_bytes()))
    groups = reported["components"]["1"]["event_groups"].values()
    names = {1 << 24 | int(number): event["name"] for group in groups for number, event in group["events"].items()}
    heard = {names[event.fields["id"]] for event in messages(path, "EVENT")}
    assert "commander_arming_check_summary" in heard


def test_the_opaque_id_of_an_accepted_mission_is_the_one_that_the_vehicle_then_flies() -> None:
    accepted: dict[tuple[int, int], int] = {}
    flown = 0
    for message in messages(EXCERPT, "MISSION_ACK", "MISSION_CURRENT"):
        fields = message.fields
        if message.system > 8:
            continue
        if message.name == "MISSION_ACK":
            if fields["type"] == 0:
                accepted[message.system, fields["mission_type"]] = fields["opaque_id"]
        elif fields["mission_id"] or fields["fence_id"]:
            flown += 1
            assert fields["mission_id"] == accepted.get((message.system, 0), 0)
            assert fields["fence_id"] == accepted[message.system, 1]
    assert flown > 70
    assert len(set(accepted.values())) == 6, "four missions, a fence for all, rally points"


def test_px4_answers_the_one_who_asked_for_the_time() -> None:
    answers = [m for m in messages(EXCERPT, "TIMESYNC") if m.system <= 8]
    assert len(answers) == 8
    assert {(m.fields["target_system"], m.fields["target_component"]) for m in answers} == {(255, 190)}


def test_link_statistics_and_times_to_target_grow_and_shrink_as_a_flight_does() -> None:
    links = [m.fields for m in messages(EXCERPT, "LINK_NODE_STATUS") if m.system == 1]
    assert [f["timestamp"] for f in links] == sorted(f["timestamp"] for f in links)
    assert [f["messages_sent"] for f in links] == sorted(f["messages_sent"] for f in links)
    assert all(20_000 < f["tx_rate"] < 30_000 for f in links), "bytes per second"
    returns_s = [m.fields["safe_return"] for m in messages(EXCERPT, "TIME_ESTIMATE_TO_TARGET") if m.system == 1]
    assert returns_s[0] == 0 and 100 < max(returns_s) < 200


# ---------------------------------------------------------------- as we send them


def test_a_target_of_timesync_may_be_given_or_left_out() -> None:
    plain, aimed = (
        Encoder(255, 190).encode("TIMESYNC", **TIMES),
        Encoder(255, 190).encode("TIMESYNC", **TIMES, target_system=3, target_component=1),
    )
    assert (plain[1], aimed[1]) == (16, 18)
    (one,), (other,) = cut_datagram(plain).frames, cut_datagram(aimed).frames
    fields: list[dict[str, Any]] = [found.fields for found in map(decode, (one, other)) if found is not None]
    assert fields == [
        TIMES | {"target_system": 0, "target_component": 0},
        TIMES | {"target_system": 3, "target_component": 1},
    ]


def test_who_has_not_heard_of_the_target_understands_the_rest() -> None:
    aimed = Encoder(255, 190).encode("TIMESYNC", **TIMES, target_system=3, target_component=1)
    (theirs,) = pymavlink_all.MAVLink(None).parse_buffer(aimed)
    assert {name: getattr(theirs, name) for name in theirs.fieldnames} == TIMES
    (simulated,) = cut(aimed)
    assert (simulated.name, simulated.fields) == ("TIMESYNC", TIMES)


def test_the_door_names_the_target_and_a_simulated_vehicle_answers(rig: MakeRig) -> None:
    flight = rig(2).ready()
    answers: list[tuple[int, int]] = []
    flight.station.picture.fleet.on_message(
        "TIMESYNC", lambda vehicle, fields: answers.append((vehicle.id, fields["ts1"]))
    )
    before = len(flight.sent)
    flight.station.comms.uplink.ask(2, "TIMESYNC", tc1=0, ts1=77)
    flight.run(0.2)
    (sent,) = [(to, fields) for _, to, name, fields in flight.sent[before:] if name == "TIMESYNC"]
    assert sent == (2, {"tc1": 0, "ts1": 77, "target_system": 2, "target_component": 1})
    assert (2, 77) in answers


def test_the_time_is_told_to_the_vehicle_that_asked(rig: MakeRig) -> None:
    flight = rig(2).ready()
    before = len(flight.sent)
    flight.say("TIMESYNC", 2, tc1=0, ts1=88)
    flight.tick()
    (answer,) = [fields for _, _, name, fields in flight.sent[before:] if name == "TIMESYNC"]
    assert (answer["ts1"], answer["target_system"], answer["target_component"]) == (88, 2, 1)
    assert answer["tc1"] > 0
