"""Payloads become messages, the same way pymavlink understands them."""

import subprocess
import sys
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as pymavlink_all

from tests.core.rigs.wire_newer import NEW, extra_fields, extra_names
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink import enum_names as mavlink
from tui_gcs.core.mavlink.dialect import (
    MavlinkMessage,
    MessageLayout,
    fields_of,
    label,
    layout,
    message_name,
    payload_values,
)
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.enum_names import NOT_VEHICLES, type_name
from tui_gcs.core.mavlink.frames import Frame, cut_datagram, decode


def decoded(raw: bytes) -> MavlinkMessage:
    (frame,) = cut_datagram(raw).frames
    message = decode(frame)
    assert message is not None
    return message


def layout_of(name: str) -> MessageLayout:
    found = dialect.layout_named(name)
    assert found is not None
    return found


def version_1(kind: Any) -> bytes:
    return bytes(kind.pack(pymavlink_all.MAVLink(None, srcSystem=3, srcComponent=1), force_mavlink1=True))


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
    assert layout(70001) is None
    assert dialect.layout_named("NO_SUCH_MESSAGE") is None
    assert dialect.crc_extra(70001) is None
    assert not dialect.is_known(70001)
    assert message_name(70001) is None
    assert label(70001) == "UNKNOWN_70001"
    assert label(0) == "HEARTBEAT"


def test_a_layout_says_where_the_addressee_is() -> None:
    command = layout_of("COMMAND_LONG")
    assert (command.msgid, command.size, command.extra) == (76, 33, b"\x98")
    assert (command.target_system_at, command.target_component_at) == (30, 31)
    heartbeat = layout_of("HEARTBEAT")
    assert (heartbeat.target_system_at, heartbeat.target_component_at) == (-1, -1)
    sticks = layout_of("MANUAL_CONTROL")  # the only one whose addressee is called `target`
    assert (sticks.target_system_at, sticks.target_component_at) == (10, -1)
    assert layout_of("FOLLOW_TARGET").target_system_at == -1


def test_the_addressee_is_where_pymavlink_reads_it() -> None:
    for msgid, kind in pymavlink_all.mavlink_map.items():
        found = layout(msgid)
        assert found is not None
        for name, at in (("target_system", found.target_system_at), ("target_component", found.target_component_at)):
            if name in kind.fieldnames:
                payload = bytes(77 if place == at else 0 for place in range(kind.unpacker.size))
                values = kind.unpacker.unpack(payload)
                assert values[sum(kind.lengths[: kind.ordered_fieldnames.index(name)])] == 77, kind.msgname
            elif name not in extra_names(msgid) and (kind.msgname, name) != ("MANUAL_CONTROL", "target_system"):
                assert at == -1, kind.msgname


def test_the_addressee_of_messages_that_pymavlink_lacks_is_known() -> None:
    time = layout_of("TIMESYNC")
    assert (time.size, time.target_system_at, time.target_component_at) == (18, 16, 17)
    addressed = {number: layout(number) for number in NEW}
    assert {
        number: (found.target_system_at, found.target_component_at)
        for number, found in addressed.items()
        if found is not None and found.target_system_at >= 0
    } == {80: (2, 3), 412: (4, 5), 413: (4, 5)}  # EVENT has a destination, which is no target that routers look at


def test_the_crc_byte_of_every_message_is_known() -> None:
    for msgid, kind in pymavlink_all.mavlink_map.items():
        assert dialect.crc_extra(msgid) == dialect.CRC_EXTRA[msgid] == bytes([kind.crc_extra])
    for msgid, (_, number, _) in NEW.items():
        assert dialect.crc_extra(msgid) == dialect.CRC_EXTRA[msgid] == bytes([number])


def test_values_are_read_from_frames_of_both_versions() -> None:
    text = layout_of("STATUSTEXT")
    newer = Encoder(1, 1).encode("STATUSTEXT", severity=4, text="hello", id=7, chunk_seq=1)
    older = version_1(pymavlink_all.MAVLink_statustext_message(4, b"hello", 7, 1))
    assert fields_of(text, payload_values(text, newer)) == {"severity": 4, "text": "hello", "id": 7, "chunk_seq": 1}
    (frame,) = cut_datagram(older).frames
    assert frame.version == 1
    assert fields_of(text, payload_values(text, older))["text"] == "hello"


def test_version_1_frames_have_no_extensions() -> None:
    text = layout_of("STATUSTEXT")
    short = b"\xfe\x33" + bytes((0, 3, 1, 253, 4)) + b"x" * 50 + b"\x12\x34"  # the CRC is no extension
    assert payload_values(text, short) == (4, b"x" * 50, 0, 0)


def test_a_signature_is_no_part_of_the_values() -> None:
    time = layout_of("SYSTEM_TIME")
    raw = Encoder(1, 1).encode("SYSTEM_TIME", time_unix_usec=5, time_boot_ms=0)
    assert payload_values(time, raw + b"\xff" * 13) == (5, 0)


def test_an_unknown_id_leaves_nothing_behind() -> None:
    layout(0)
    before = len(dialect.CRC_EXTRA), len(dialect._layouts)
    for msgid in range(1_000_000, 1_001_000):
        assert layout(msgid) is None
    assert (len(dialect.CRC_EXTRA), len(dialect._layouts)) == before


@given(st.sampled_from(sorted(pymavlink_all.mavlink_map)), st.binary(max_size=255), st.sampled_from([1, 2]))
def test_any_payload_of_any_message_is_decoded_as_pymavlink_does(msgid: int, payload: bytes, version: int) -> None:
    message = decode(Frame(version, 0, 1, 1, msgid, payload, b"", False))
    assert message is not None
    kind = pymavlink_all.mavlink_map[msgid]
    assert list(message.fields) == [*kind.ordered_fieldnames, *extra_names(msgid)]
    more = extra_fields(msgid, payload, kind.unpacker.size)
    assert {name: message.fields[name] for name in more} == more
    values = kind.unpacker.unpack(payload[: kind.unpacker.size].ljust(kind.unpacker.size, b"\0"))
    for name, order in zip(kind.fieldnames, kind.orders, strict=True):
        first, length = sum(kind.lengths[:order]), kind.lengths[order]
        expected = values[first] if length == 1 else values[first : first + length]
        if not isinstance(expected, bytes):
            assert repr(message.fields[name]) == repr(expected)  # NaN is equal to itself here
    head = b"\xfd%c" % len(payload) + bytes(8) if version == 2 else b"\xfe%c" % len(payload) + bytes(4)
    found = layout(msgid)
    assert found is not None
    assert repr(fields_of(found, payload_values(found, head + payload + b"\x12\x34"))) == repr(message.fields)


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


def test_importing_the_wire_loads_no_tables() -> None:
    code = (
        "import sys, tui_gcs.core.mavlink.encode, tui_gcs.core.links; from tui_gcs.core.mavlink import dialect;"
        "print('pymavlink' in sys.modules, len(dialect._definitions))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "0"]


def test_everything_that_flies_is_a_vehicle() -> None:
    flying = {"fixed wing", "quadrotor", "helicopter", "airship", "rocket", "kite", "parafoil", "decarotor"}
    known = {type_name(number) for number in range(50) if number not in NOT_VEHICLES}
    assert flying <= known, flying - known
