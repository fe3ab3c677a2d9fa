"""Messages become frames, byte for byte as in pymavlink; what cannot be sent is refused with the reason."""

import math
import random
import struct
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as pymavlink_all

from tui_gcs.core.mavlink.dialect import layout
from tui_gcs.core.mavlink.encode import EncodeError, Encoder
from tui_gcs.core.mavlink.frames import cut_datagram, decode
from tui_gcs.core.mavlink.message_definitions import STRUCT_CODES, FieldDefinition, MessageDefinition
from tui_gcs.core.mavlink.message_tables import from_pymavlink

MESSAGES = from_pymavlink()
TIME = {"time_unix_usec": 1, "time_boot_ms": 2}


def by_pymavlink(definition: MessageDefinition, fields: dict[str, Any], seq: int = 0) -> bytes:
    """The frame as pymavlink packs it, from system 7, component 9."""
    sender = SimpleNamespace(seq=seq, srcSystem=7, srcComponent=9, signing=SimpleNamespace(sign_outgoing=False))
    return bytes(pymavlink_all.mavlink_map[definition.msgid](**fields).pack(sender))


def limits(field: FieldDefinition) -> tuple[int, int]:
    bits = 8 * struct.calcsize(STRUCT_CODES[field.type])
    return (0, (1 << bits) - 1) if field.type.startswith("u") else (-(1 << bits - 1), (1 << bits - 1) - 1)


def random_value(field: FieldDefinition, chance: random.Random) -> Any:
    """Often zero, so that ends are cut off, and often the largest or smallest."""
    if field.is_text:
        size = max(1, field.length)
        return bytes(chance.choice([0, 65, 255]) for _ in range(size if not field.length else chance.randint(0, size)))
    if field.type in ("float", "double"):
        numbers = [0.0, -0.0, 1.5, -3e30, math.inf, -math.inf, math.nan, chance.uniform(-1e6, 1e6), 7]
    else:
        low, high = limits(field)
        numbers = [0, 0, low, high, chance.randint(low, high)]
    values = [chance.choice(numbers) for _ in range(field.count)]
    return values[0] if field.count == 1 else values


def random_fields(definition: MessageDefinition, chance: random.Random) -> dict[str, Any]:
    keep_extensions = chance.random()
    return {
        field.name: random_value(field, chance)
        for field in definition.fields
        if not field.extension or chance.random() < keep_extensions
    }


def test_every_message_is_made_as_pymavlink_makes_it() -> None:
    chance = random.Random(1)
    for definition in MESSAGES:
        encoder = Encoder(7, 9)
        for seq in range(8):
            fields = random_fields(definition, chance)
            assert encoder.encode(definition.name, **fields) == by_pymavlink(definition, fields, seq), fields


@given(st.sampled_from(MESSAGES), st.randoms(use_true_random=False))
def test_any_message_that_was_made_is_read_again(definition: MessageDefinition, chance: random.Random) -> None:
    fields = random_fields(definition, chance)
    (frame,) = cut_datagram(Encoder(7, 9).encode(definition.name, **fields)).frames
    message = decode(frame)
    assert message is not None
    assert (message.name, message.system, message.component) == (definition.name, 7, 9)
    for field in definition.fields:
        if field.name in fields and field.type not in ("char", "float"):
            expected = fields[field.name]
            # NaN is equal to itself here
            assert repr(message.fields[field.name]) == repr(
                tuple(float(v) if field.type == "double" else v for v in expected)
                if field.count > 1
                else float(expected)
                if field.type == "double"
                else expected
            )


def test_frames_count_up_and_are_read_by_pymavlink() -> None:
    encoder, reader = Encoder(255, 190), pymavlink_all.MAVLink(None)
    for expected in [*range(256), 0]:
        (message,) = reader.parse_buffer(encoder.encode("SYSTEM_TIME", **TIME))
        assert (message.get_srcSystem(), message.get_srcComponent(), message.get_seq()) == (255, 190, expected)
        assert message.time_boot_ms == 2


def test_every_encoder_counts_for_itself() -> None:
    one, other = Encoder(1, 1), Encoder(1, 1)
    assert [one.encode("SYSTEM_TIME", **TIME)[4] for _ in range(3)] == [0, 1, 2]
    assert other.encode("SYSTEM_TIME", **TIME)[4] == 0


def test_zeros_at_the_end_are_not_sent_but_one_byte_is() -> None:
    assert Encoder(1, 1).encode("SYSTEM_TIME", time_unix_usec=5, time_boot_ms=0)[1] == 1
    assert Encoder(1, 1).encode("SYSTEM_TIME", time_unix_usec=0, time_boot_ms=0)[1] == 1


def test_extensions_may_be_left_out_or_given() -> None:
    short = Encoder(1, 1).encode("STATUSTEXT", severity=4, text="x" * 50)
    long = Encoder(1, 1).encode("STATUSTEXT", severity=4, text="x" * 50, id=7, chunk_seq=1)
    assert (short[1], long[1]) == (51, 54)


def test_numbers_of_numpy_and_booleans_are_numbers() -> None:
    raw = Encoder(1, 1).encode("SYSTEM_TIME", time_unix_usec=np.uint64(5), time_boot_ms=True)
    assert raw == Encoder(1, 1).encode("SYSTEM_TIME", time_unix_usec=5, time_boot_ms=1)
    local = layout(32)
    assert local is not None
    fields = dict.fromkeys(local.names, 0)
    assert Encoder(1, 1).encode("LOCAL_POSITION_NED", **(fields | {"x": np.float64(1.5)})) == Encoder(1, 1).encode(
        "LOCAL_POSITION_NED", **(fields | {"x": 1.5})
    )


def battery(**changed: Any) -> dict[str, Any]:
    names = ("id", "battery_function", "type", "temperature", "current_battery", "current_consumed")
    fields = dict.fromkeys((*names, "energy_consumed", "battery_remaining"), 0)
    return fields | {"voltages": [4000] * 10} | changed


@pytest.mark.parametrize(
    ("name", "fields", "why"),
    [
        ("NO_SUCH_MESSAGE", {}, "unknown MAVLink message 'NO_SUCH_MESSAGE'"),
        ("SYSTEM_TIME", {"time_unix_usec": 1}, "SYSTEM_TIME: field time_boot_ms is missing"),
        (
            "SYSTEM_TIME",
            TIME | {"colour": 3},
            "SYSTEM_TIME: has no field colour; it has time_unix_usec, time_boot_ms",
        ),
        (
            "SYSTEM_TIME",
            TIME | {"time_boot_ms": -1},
            "SYSTEM_TIME: time_boot_ms must be a whole number 0 to 4294967295 (uint32_t)",
        ),
        (
            "SYSTEM_TIME",
            TIME | {"time_boot_ms": 1 << 32},
            "SYSTEM_TIME: time_boot_ms must be a whole number 0 to 4294967295 (uint32_t)",
        ),
        (
            "SYSTEM_TIME",
            TIME | {"time_unix_usec": 10**6000},
            "SYSTEM_TIME: time_unix_usec must be a whole number 0 to 18446744073709551615 (uint64_t)",
        ),
        (
            "SYSTEM_TIME",
            TIME | {"time_boot_ms": 1.0},
            "SYSTEM_TIME: time_boot_ms must be a whole number 0 to 4294967295 (uint32_t)",
        ),
        (
            "SYSTEM_TIME",
            TIME | {"time_boot_ms": None},
            "SYSTEM_TIME: time_boot_ms must be a whole number 0 to 4294967295 (uint32_t)",
        ),
        (
            "BATTERY_STATUS",
            battery(temperature=40000),
            "BATTERY_STATUS: temperature must be a whole number -32768 to 32767 (int16_t)",
        ),
        (
            "BATTERY_STATUS",
            battery(voltages=[4000] * 9),
            "BATTERY_STATUS: voltages has 9 values, must have 10",
        ),
        (
            "BATTERY_STATUS",
            battery(voltages=[4000] * 11),
            "BATTERY_STATUS: voltages has 11 values, must have 10",
        ),
        (
            "BATTERY_STATUS",
            battery(voltages=4000),
            "BATTERY_STATUS: voltages must be 10 values, not one",
        ),
        (
            "BATTERY_STATUS",
            battery(voltages=[4000] * 9 + [70000]),
            "BATTERY_STATUS: voltages[9] must be a whole number 0 to 65535 (uint16_t)",
        ),
        (
            "DEBUG",
            {"time_boot_ms": 0, "ind": 0, "value": 1e300},
            "DEBUG: value must be a number that fits float",
        ),
        (
            "DEBUG",
            {"time_boot_ms": 0, "ind": 0, "value": "high"},
            "DEBUG: value must be a number that fits float",
        ),
        (
            "STATUSTEXT",
            {"severity": 1, "text": "x" * 51},
            "STATUSTEXT: text is 51 bytes long, 50 fit",
        ),
        (
            "STATUSTEXT",
            {"severity": 1, "text": "ü" * 26},
            "STATUSTEXT: text is 52 bytes long, 50 fit",
        ),
        ("STATUSTEXT", {"severity": 1, "text": 5}, "STATUSTEXT: text must be text, not int"),
        (
            "STATUSTEXT",
            {"severity": 1, "text": "\ud800"},
            "STATUSTEXT: text has a character that UTF-8 cannot express",
        ),
    ],
)
def test_what_cannot_be_sent_says_why_and_uses_no_sequence_number(name: str, fields: dict[str, Any], why: str) -> None:
    encoder = Encoder(1, 1)
    with pytest.raises(EncodeError) as refused:
        encoder.encode(name, **fields)
    assert str(refused.value) == why
    assert encoder.encode("SYSTEM_TIME", **TIME)[4] == 0


def test_a_refusal_never_quotes_a_key() -> None:
    key = [*range(100, 131), 999]
    with pytest.raises(EncodeError) as refused:
        Encoder(1, 1).encode("SETUP_SIGNING", target_system=1, target_component=1, secret_key=key, initial_timestamp=0)
    assert "secret_key[31]" in str(refused.value)
    assert refused.value.__suppress_context__
    assert not any(str(number) in str(refused.value) for number in key)


@pytest.mark.parametrize(("system", "component"), [(256, 1), (1, 256), (-1, 1)])
def test_a_sender_has_ids_of_one_byte(system: int, component: int) -> None:
    with pytest.raises(ValueError, match="range"):
        Encoder(system, component)
