"""Event metadata: the real file of a real PX4, and what a hostile vehicle may serve instead."""

import json
import struct
import time
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui_gcs.core.services.vehicle.component_metadata import unpack
from tui_gcs.core.services.vehicle.event_metadata import EventMetadataError, parse

REAL = Path(__file__).parents[5] / "shared" / "data" / "px4" / "all_events.json.xz"
ARMED_BY = (1 << 24) | 1
"""Id of the first event of component 1."""


def a_file(**events: dict[str, Any]) -> bytes:
    """Metadata with the given events of component 1: name=(sub id, message, argument types)."""
    group = {str(e["id"]): {"name": name} | {k: v for k, v in e.items() if k != "id"} for name, e in events.items()}
    enums = {
        "reason_t": {"type": "uint8_t", "entries": {"4": {"name": "ext", "description": "external command"}}},
        "parts_t": {
            "type": "uint16_t",
            "is_bitfield": True,
            "entries": {"1": {"name": "gps"}, "8": {"name": "baro", "description": "Barometer"}},
        },
    }
    groups = {"groups": {"4": [0x3040000], "17": [0x2040000, 77]}}
    component = {
        "namespace": "px4",
        "enums": enums,
        "event_groups": {"default": {"events": group}},
        "navigation_mode_groups": groups,
    }
    return json.dumps({"version": 2, "components": {"1": component}}).encode()


def text_of(message: str, types: list[str], arguments: bytes = b"") -> str:
    raw = a_file(one={"id": 1, "message": message, "arguments": [{"name": "a", "type": t} for t in types]})
    decoded = parse(raw).decode(ARMED_BY, arguments)
    assert decoded is not None
    return decoded.text


@pytest.mark.parametrize(
    ("message", "types", "arguments", "text"),
    [
        ("Armed by {1}", ["reason_t"], b"\x04", "Armed by external command"),
        ("Armed by {1}", ["px4::reason_t"], b"\x63", "Armed by 99"),
        ("Bad: {1}", ["parts_t"], b"\x09\x00", "Bad: gps, Barometer"),
        ("Bad: {1}", ["parts_t"], b"", "Bad: none"),
        ("Climb to {1:.1m_v} above home", ["float"], struct.pack("<f", 15), "Climb to 15.0 m above home"),
        ("{2m} at {1:.2m/s}", ["float", "int32_t"], struct.pack("<fi", 1.236, -3), "-3 m at 1.24 m/s"),
        ("{1}", ["float"], struct.pack("<f", float("nan")), "?"),
        ("max \\< 5 {1}\\{2\\}", ["uint8_t"], b"\x07", "max < 5 7{2}"),
        ("See <param>COM_X</param> <a href='http://evil'>here</a>", [], b"", "See COM_X here"),
        ('Short.<profile name="dev"> Long <param>P</param></profile>', [], b"", "Short."),
        ("{0} {3} {1.__class__} {x} %s [/]", ["uint8_t"], b"\x01", "{0} {3} {1.__class__} {x} %s [/]"),
        ("\x1b[2J{1}", ["uint8_t"], b"\x01", "␛[2J1"),
    ],
)
def test_templates_are_filled_in_by_our_own_rules(message: str, types: list[str], arguments: bytes, text: str) -> None:
    assert text_of(message, types, arguments) == text


@pytest.mark.skipif(not REAL.exists(), reason="no recordings of real autopilots here")
def test_the_real_file_of_a_real_px4() -> None:
    raw = unpack(REAL.read_bytes())
    begin = time.process_time()
    metadata = parse(raw)
    assert time.process_time() - begin < 0.2, "the station must not stall"
    assert len(metadata.definitions) > 350 and not metadata.skipped
    assert metadata.mode_groups[0x3040000] == 1 << 4 and metadata.mode_groups[0x60000] == 1 << 14
    for event_id in metadata.definitions:
        decoded = metadata.decode(event_id, bytes(range(40)))
        assert decoded is not None and decoded.name
    summary = next(i for i, d in metadata.definitions.items() if d.name == "commander_arming_check_summary")
    decoded = metadata.decode(summary, bytes.fromhex("000000100080000000b03a7f80b03a7f80"))
    assert decoded is not None and decoded.type == "summary" and decoded.group == "arming_check"
    assert decoded.values[3] == 0x807F3AB0 and decoded.values[3] & metadata.mode_groups[0x3040000]


@pytest.mark.parametrize(
    "raw",
    [
        b"",
        b"{}",
        b"[]",
        b"\xfd7zXZ\x00broken",
        b'{"version": 9, "components": {}}',
        b'{"version": 2, "components": {}}',
        b'{"version": 2, "components": {"1": {"event_groups": 3}}}',
        b"[" * 200_000,
        b'{"version": 2, "components": {"1": ' + b'{"a":' * 100_000,
        b"\xff\xfe\x00",
    ],
    ids=range(10),
)
def test_what_is_no_metadata_is_refused(raw: bytes) -> None:
    begin = time.process_time()
    with pytest.raises(EventMetadataError):
        parse(raw)
    assert time.process_time() - begin < 0.5


def test_definitions_that_cannot_be_used_are_left_out_and_counted() -> None:
    arguments = [{"name": "a", "type": "uint64_t"}] * 6
    metadata = parse(
        a_file(
            good={"id": 1, "message": "good"},
            unknown={"id": 2, "message": "x", "arguments": [{"name": "a", "type": "what_t"}]},
            long={"id": 3, "message": "x", "arguments": arguments},
        )
    )
    assert list(metadata.definitions) == [ARMED_BY] and metadata.skipped == 2


@given(message=st.text(max_size=600), arguments=st.binary(max_size=50))
def test_any_template_and_any_arguments_become_one_safe_line(message: str, arguments: bytes) -> None:
    raw = a_file(
        one={
            "id": 1,
            "message": message.encode("utf-8", "replace").decode(),
            "arguments": [{"name": "a", "type": t} for t in ("float", "parts_t", "reason_t")],
        }
    )
    decoded = parse(raw).decode(ARMED_BY, arguments)
    assert decoded is not None and decoded.text.isprintable() and len(decoded.text) <= 200


@given(st.binary(max_size=2000))
def test_any_bytes_are_metadata_or_an_error(raw: bytes) -> None:
    try:
        parse(raw)
    except EventMetadataError as error:
        assert str(error).isprintable()
