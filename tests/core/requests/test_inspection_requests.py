"""What the inspector is shown of received frames, and rates that operators ask for."""

import math
from pathlib import Path

import pytest

from tests.core.rigs.service_asking import ask, ended, refusal, task
from tests.core.rigs.service_rig import Fields, Peer, ServiceRig
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.protocol import inspection as p
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol.common import ReplyCode
from tui_gcs.core.services.parameters.param_values import Parameter

HEARTBEAT, ATTITUDE, POSITION, RAW_IMU, STATUSTEXT, SETUP_SIGNING = 0, 30, 33, 27, 253, 256
SET_INTERVAL = 511


def inspected(rig: ServiceRig, *vehicles: int, detail: p.MessageKey | None = None) -> p.Inspection:
    """The answer to one look."""
    found = ask(rig, p.GetMessages(vehicles, detail)).inspection
    assert found is not None
    return found


def row_of(found: p.Inspection, system: int, msgid: int) -> p.MessageRow:
    return next(row for row in found.rows if (row.key.system, row.key.msgid) == (system, msgid))


def intervals(peer: Peer) -> list[tuple[int, float]]:
    """(message, interval in µs) that a vehicle was asked for."""
    asked = [f for f in peer.got("COMMAND_LONG") if f["command"] == SET_INTERVAL]
    return [(int(f["param1"]), f["param2"]) for f in asked]


def test_every_kind_of_message_of_every_component_is_listed_with_count_age_and_size(tmp_path: Path) -> None:
    camera = Encoder(1, 100)
    rig = ServiceRig(tmp_path, Peer(1), Peer(2)).heard()
    rig.peers[1].out.append(
        camera.encode("HEARTBEAT", type=30, autopilot=8, base_mode=0, custom_mode=0, system_status=4, mavlink_version=3)
    )
    before = row_of(inspected(rig), 1, POSITION)
    rig.run(2.0)
    found = inspected(rig)
    assert {(row.vehicle, row.key.component, row.name) for row in found.rows} >= {
        (1, 1, "HEARTBEAT"),
        (1, 1, "GLOBAL_POSITION_INT"),
        (1, 100, "HEARTBEAT"),
        (2, 1, "GLOBAL_POSITION_INT"),
    }
    after = row_of(found, 1, POSITION)
    assert (after.count - before.count) / (2.0) == 4.0
    assert after.age_s < 0.3 and after.used and after.version == 2 and not after.signed
    # The payload of 28 bytes without the zeros at its end, header and CRC.
    assert 12 < after.size <= 40
    assert {row.vehicle for row in inspected(rig, 2).rows} == {2}


def test_the_newest_frame_comes_decoded_and_raw(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1, alt_rel_mm=12_500)).heard()
    key = row_of(inspected(rig), 1, POSITION).key
    detail = inspected(rig, detail=key).detail
    assert detail is not None and detail.key == key
    values = {field.name: field.value for field in detail.fields}
    assert values["relative_alt"] == 12_500
    assert [f.type for f in detail.fields][:2] == ["uint32_t", "int32_t"]
    assert detail.raw[0] == 0xFD and detail.raw[7] == POSITION


def test_text_is_clean_and_unknown_messages_are_shown_as_bytes(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    rig.peers[1].say("STATUSTEXT", severity=6, text=b"\x1b]52;c;aGk=\x07[red]hi")
    rig.run(0.5)
    detail = inspected(rig, detail=row_of(inspected(rig), 1, STATUSTEXT).key).detail
    assert detail is not None
    text = next(field.value for field in detail.fields if field.name == "text")
    assert isinstance(text, str) and "\x1b" not in text and text.endswith("[red]hi")


def test_a_key_never_leaves_the_station(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    key = b"\x11" * 32
    rig.peers[1].say("SETUP_SIGNING", target_system=255, target_component=0, secret_key=list(key), initial_timestamp=1)
    rig.run(0.5)
    detail = inspected(rig, detail=row_of(inspected(rig), 1, SETUP_SIGNING).key).detail
    assert detail is not None and detail.raw == b"" and detail.fields == ()
    assert "a key" in detail.remark


def test_what_cannot_be_used_is_counted_by_sender(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    broken = bytearray(Encoder(1, 1).encode("MISSION_CURRENT", seq=3))
    broken[-1] ^= 0xFF
    rig.peers[1].out.append(bytes(broken))
    rig.peers[1].out.append(b"\xff" * 40)
    rig.run(0.5)
    source = next(row for row in inspected(rig).sources if row.vehicles)
    assert source.bad_crc == 1 and source.bad_crc_names == ("MISSION_CURRENT 1",)
    assert source.junk_bytes >= 40
    assert source.frames > 0


def test_a_message_that_is_gone_has_no_detail(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    assert inspected(rig, detail=p.MessageKey("", "memory", "nowhere", 1, 1, 0)).detail is None


def test_a_rate_is_asked_of_the_vehicle_and_given_back(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    info, _ = ended(rig, p.SetMessageRate((1,), RAW_IMU, 20.0))
    assert (info.state, info.what) == ("done", "RAW_IMU at 20 Hz")
    assert (RAW_IMU, 50_000) in intervals(rig.peers[1])
    info, _ = ended(rig, p.SetMessageRate((1,), RAW_IMU, None))
    assert info.state == "done"
    rig.run(5.0)
    assert (RAW_IMU, -1) in intervals(rig.peers[1])


def test_a_rate_that_the_vehicle_refuses_is_not_asked_again(tmp_path: Path) -> None:
    def refuses(peer: Peer, fields: Fields) -> None:
        peer.ack(fields["command"], 2 if fields["param1"] == RAW_IMU else 0)

    rig = ServiceRig(tmp_path, Peer(1, answers={"COMMAND_LONG": refuses})).heard()
    info, _ = ended(rig, p.SetMessageRate((1,), RAW_IMU, 20.0))
    assert info.state == "failed" and "refused" in info.text
    count = len(intervals(rig.peers[1]))
    rig.run(20.0)
    assert RAW_IMU not in [message for message, _ in intervals(rig.peers[1])[count:]]


def test_what_the_station_works_with_is_taken_away_only_if_that_is_meant(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    reply = ask(rig, p.SetMessageRate((1,), ATTITUDE, 0.0))
    assert reply.results[0].code is ReplyCode.NOT_CONFIRMED
    assert "asks for 4 Hz" in reply.results[0].text
    info, _ = ended(rig, p.SetMessageRate((1,), ATTITUDE, 0.0, sure=True))
    assert info.state == "done" and (ATTITUDE, -1) in intervals(rig.peers[1])


def test_a_flying_vehicle_keeps_what_it_is_flown_by(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1, armed=True, alt_rel_mm=20_000)).heard()
    assert "in the air" in refusal(rig, p.SetMessageRate((1,), POSITION, 0.5, sure=True))
    assert ask(rig, p.SetMessageRate((1,), POSITION, 20.0)).ok


def test_a_rate_beyond_the_budget_of_the_link_is_refused_until_it_is_meant(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1), bytes_per_s=4000).heard()
    why = ask(rig, p.SetMessageRate((1,), RAW_IMU, 100.0)).results[0]
    assert why.code is ReplyCode.NOT_CONFIRMED and "B/s are left on memory" in why.text
    assert ask(rig, p.SetMessageRate((1,), RAW_IMU, 1.0)).ok


def test_heartbeats_wrong_rates_and_unknown_messages_are_refused(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    assert "HEARTBEAT" in refusal(rig, p.SetMessageRate((1,), HEARTBEAT, 5.0))
    assert "0 to 200 Hz" in refusal(rig, p.SetMessageRate((1,), RAW_IMU, float("nan")))
    assert "no dialect" in refusal(rig, p.SetMessageRate((1,), 9_999_999, 1.0))
    assert refusal(rig, p.SetMessageRate((7,), RAW_IMU, 1.0)) == "never heard"


def test_a_rate_under_way_can_be_cancelled(tmp_path: Path) -> None:
    peer = Peer(1, answers={"COMMAND_LONG": lambda peer, fields: None})
    rig = ServiceRig(tmp_path, peer).heard()
    number = ask(rig, p.SetMessageRate((1,), RAW_IMU, 20.0)).tasks[0].number
    rig.run(0.2)
    assert ask(rig, s.CancelTask(number)).ok
    rig.run(10.0)
    assert task(rig, number).state == "cancelled"


def values(rig: ServiceRig, *keys: p.ValueKey) -> list[tuple[float, float]]:
    return [(row.t_s, row.value) for row in ask(rig, p.GetValues(keys)).values]


def test_values_of_fields_and_parameters_come_with_their_times(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1, alt_rel_mm=12_500), Peer(2, alt_rel_mm=3_000)).heard()
    rig.station.parts.services.params.table(1).put(Parameter("WPNAV_SPEED", 500.0, 9))
    found = values(
        rig,
        p.ValueKey(1, "GLOBAL_POSITION_INT.relative_alt"),
        p.ValueKey(2, "GLOBAL_POSITION_INT.relative_alt"),
        p.ValueKey(1, "WPNAV_SPEED", is_parameter=True),
    )
    assert [value for _, value in found] == [12_500.0, 3_000.0, 500.0]
    assert all(0.0 <= rig.clock.now() - t_s < 0.5 for t_s, _ in found)


@pytest.mark.parametrize(
    "key",
    [
        p.ValueKey(9, "ATTITUDE.roll"),
        p.ValueKey(1, "NO_SUCH.roll"),
        p.ValueKey(1, "GLOBAL_POSITION_INT.nothing"),
        p.ValueKey(1, "GLOBAL_POSITION_INT"),
        p.ValueKey(1, "GLOBAL_POSITION_INT.lat[99999999999999999999]"),
        p.ValueKey(1, "SETUP_SIGNING.initial_timestamp"),
        p.ValueKey(1, "NO_PARAM", is_parameter=True),
    ],
)
def test_a_value_that_was_not_received_is_not_known(tmp_path: Path, key: p.ValueKey) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    assert all(map(math.isnan, values(rig, key)[0]))


def test_too_many_values_at_once_are_refused(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    reply = ask(rig, p.GetValues((p.ValueKey(1, "ATTITUDE.roll"),) * (p.MAX_VALUES + 1)))
    assert not reply.ok and "at most 128" in reply.text
