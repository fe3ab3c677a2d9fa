"""Frames become messages and messages become frames, the same way pymavlink understands them."""

import subprocess
import sys
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as pymavlink_all

from tui_gcs.core.wire import mavlink
from tui_gcs.core.wire.dialect import Message, decode, label, message_name
from tui_gcs.core.wire.encode import EncodeError, Encoder
from tui_gcs.core.wire.frames import Frame, cut_datagram
from tui_gcs.core.wire.mavlink import NOT_VEHICLES, type_name


def decoded(raw: bytes) -> Message:
    (frame,) = cut_datagram(raw).frames
    message = decode(frame)
    assert message is not None
    return message


def test_numbers_arrive_as_they_were_sent() -> None:
    raw = Encoder(4, 1).encode(
        "GLOBAL_POSITION_INT",
        time_boot_ms=1000,
        lat=520720000,
        lon=-6280000,
        alt=110000,
        relative_alt=-50,
        vx=120,
        vy=-30,
        vz=5,
        hdg=9000,
    )
    message = decoded(raw)
    assert (message.name, message.msgid, message.system, message.component) == ("GLOBAL_POSITION_INT", 33, 4, 1)
    assert message.fields["lat"] == 520720000
    assert message.fields["relative_alt"] == -50
    assert message.fields["hdg"] == 9000


def test_zeros_that_were_not_sent_come_back() -> None:
    message = decoded(Encoder(1, 1).encode("SYSTEM_TIME", time_unix_usec=5, time_boot_ms=0))
    assert message.fields == {"time_unix_usec": 5, "time_boot_ms": 0}


def test_bytes_of_fields_newer_than_our_dialect_are_ignored() -> None:
    frame = Frame(2, 0, 1, 1, 2, b"\x01" * 20, b"", False)  # SYSTEM_TIME has 12 bytes
    message = decode(frame)
    assert message is not None
    assert set(message.fields) == {"time_unix_usec", "time_boot_ms"}


def test_arrays_are_tuples_and_text_is_clean() -> None:
    cells = (4100, 4090, *(65535,) * 8)
    battery = decoded(
        Encoder(1, 1).encode(
            "BATTERY_STATUS",
            id=0,
            battery_function=0,
            type=1,
            temperature=2500,
            voltages=cells,
            current_battery=100,
            current_consumed=5,
            energy_consumed=6,
            battery_remaining=80,
        )
    )
    assert battery.fields["voltages"] == cells
    assert battery.fields["id"] == 0
    text = decoded(Encoder(1, 1).encode("STATUSTEXT", severity=4, text="\x1b]0;pwned\x07")).fields["text"]
    assert text == "␛]0;pwned␇"


def test_text_ends_at_the_first_zero_byte() -> None:
    message = decoded(Encoder(1, 1).encode("STATUSTEXT", severity=4, text=b"seen\0hidden"))
    assert message.fields["text"] == "seen"


def test_a_text_without_zero_byte_is_whole() -> None:
    name = "PARAM_OF_16CHARS"
    raw = Encoder(1, 1).encode(
        "PARAM_VALUE", param_id=name, param_value=1.5, param_type=9, param_count=1, param_index=0
    )
    assert decoded(raw).fields["param_id"] == name


def test_unknown_messages_have_a_number_for_a_name() -> None:
    assert decode(Frame(2, 0, 1, 1, 70001, b"", b"", False)) is None
    assert message_name(70001) is None
    assert label(70001) == "UNKNOWN_70001"
    assert label(0) == "HEARTBEAT"


def test_frames_count_up_and_are_read_by_pymavlink() -> None:
    encoder, reader = Encoder(255, 190), pymavlink_all.MAVLink(None)
    for expected in [*range(256), 0]:
        (message,) = reader.parse_buffer(encoder.encode("SYSTEM_TIME", time_unix_usec=1, time_boot_ms=2))
        assert (message.get_srcSystem(), message.get_srcComponent(), message.get_seq()) == (255, 190, expected)
        assert message.time_boot_ms == 2


@pytest.mark.parametrize(
    ("name", "fields"),
    [
        ("NO_SUCH_MESSAGE", {}),
        ("SYSTEM_TIME", {"time_unix_usec": 1}),
        ("SYSTEM_TIME", {"time_unix_usec": 1, "time_boot_ms": 2, "colour": 3}),
        ("SYSTEM_TIME", {"time_unix_usec": -1, "time_boot_ms": 2}),
        ("SYSTEM_TIME", {"time_unix_usec": "now", "time_boot_ms": 2}),
    ],
)
def test_what_cannot_be_sent_says_why_and_uses_no_sequence_number(name: str, fields: dict[str, Any]) -> None:
    encoder = Encoder(1, 1)
    with pytest.raises(EncodeError, match=name):
        encoder.encode(name, **fields)
    assert encoder.encode("SYSTEM_TIME", time_unix_usec=1, time_boot_ms=2)[4] == 0


@given(st.sampled_from(sorted(pymavlink_all.mavlink_map)), st.binary(max_size=255))
def test_any_payload_of_any_message_is_decoded_as_pymavlink_does(msgid: int, payload: bytes) -> None:
    message = decode(Frame(2, 0, 1, 1, msgid, payload, b"", False))
    assert message is not None
    kind = pymavlink_all.mavlink_map[msgid]
    assert set(message.fields) == set(kind.fieldnames)
    values = kind.unpacker.unpack(payload[: kind.unpacker.size].ljust(kind.unpacker.size, b"\0"))
    for name, order in zip(kind.fieldnames, kind.orders, strict=True):
        first, length = sum(kind.lengths[:order]), kind.lengths[order]
        expected = values[first] if length == 1 else values[first : first + length]
        if not isinstance(expected, bytes):
            assert repr(message.fields[name]) == repr(expected)  # NaN is equal to itself here


def test_our_names_of_enumerations_are_those_of_mavlink() -> None:
    enums = pymavlink_all.enums
    for number, entry in enums["MAV_TYPE"].items():
        if entry.name != "MAV_TYPE_ENUM_END":
            assert not mavlink.type_name(number).startswith("type "), entry.name
    assert enums["MAV_TYPE"][mavlink.TYPE_GCS].name == "MAV_TYPE_GCS"
    assert enums["MAV_AUTOPILOT"][mavlink.AUTOPILOT_INVALID].name == "MAV_AUTOPILOT_INVALID"
    assert enums["MAV_AUTOPILOT"][mavlink.AUTOPILOT_PX4].name == "MAV_AUTOPILOT_PX4"
    assert enums["MAV_MODE_FLAG"][mavlink.FLAG_ARMED].name == "MAV_MODE_FLAG_SAFETY_ARMED"
    for number, word in enumerate(mavlink.SEVERITIES):
        assert enums["MAV_SEVERITY"][number].name == f"MAV_SEVERITY_{word.upper()}"
    assert mavlink.severity_name(200) == "notice"
    assert mavlink.type_name(99) == "type 99"


def test_importing_the_wire_does_not_load_the_dialect() -> None:
    code = "import sys, tui_gcs.core.wire.encode, tui_gcs.core.links; print('pymavlink' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_everything_that_flies_is_a_vehicle() -> None:
    flying = {"fixed wing", "quadrotor", "helicopter", "airship", "rocket", "kite", "parafoil", "decarotor"}
    known = {type_name(number) for number in range(50) if number not in NOT_VEHICLES}
    assert flying <= known, flying - known
