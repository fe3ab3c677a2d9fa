"""Both recordings decode completely, and to the same as an independent decode by pymavlink's own parser."""

from collections import Counter
from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path
from typing import Any

import pytest
from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import all as pymavlink_all

from tui_gcs.core.text import clean
from tui_gcs.core.tlog import read_tlog
from tui_gcs.core.wire import dialect
from tui_gcs.core.wire.dialect import Message, decode
from tui_gcs.core.wire.dialect_xml import read_xml
from tui_gcs.core.wire.frames import Frame

ROOT = Path(__file__).parents[2]
EXCERPTS = sorted((ROOT / "tests" / "data").glob("*-8.tlog"))
WHOLE = sorted((ROOT.parent / "shared" / "data").glob("*-8.tlog"))
"""The recordings that the excerpts are from, where somebody has them."""

MISSING = {8, 380, 410, 411}
"""What PX4 sends and pymavlink's `all` dialect lacks."""
MISSING_XML = """
<mavlink><messages>
  <message id="8" name="LINK_NODE_STATUS">
    <field type="uint64_t" name="timestamp"/>
    <field type="uint8_t" name="tx_buf"/>
    <field type="uint8_t" name="rx_buf"/>
    <field type="uint32_t" name="tx_rate"/>
    <field type="uint32_t" name="rx_rate"/>
    <field type="uint16_t" name="rx_parse_err"/>
    <field type="uint16_t" name="tx_overflows"/>
    <field type="uint16_t" name="rx_overflows"/>
    <field type="uint32_t" name="messages_sent"/>
    <field type="uint32_t" name="messages_received"/>
    <field type="uint32_t" name="messages_lost"/>
  </message>
  <message id="380" name="TIME_ESTIMATE_TO_TARGET">
    <field type="int32_t" name="safe_return"/>
    <field type="int32_t" name="land"/>
    <field type="int32_t" name="mission_next_item"/>
    <field type="int32_t" name="mission_end"/>
    <field type="int32_t" name="commanded_action"/>
  </message>
  <message id="410" name="EVENT">
    <field type="uint8_t" name="destination_component"/>
    <field type="uint8_t" name="destination_system"/>
    <field type="uint32_t" name="id"/>
    <field type="uint32_t" name="event_time_boot_ms"/>
    <field type="uint16_t" name="sequence"/>
    <field type="uint8_t" name="log_levels"/>
    <field type="uint8_t[40]" name="arguments"/>
  </message>
  <message id="411" name="CURRENT_EVENT_SEQUENCE">
    <field type="uint16_t" name="sequence"/>
    <field type="uint8_t" name="flags"/>
  </message>
</messages></mavlink>
"""


def by_pymavlink(path: Path) -> Iterator[Any]:
    """pymavlink's messages, read as its own log reader does: the parser says how many bytes it wants next."""
    parser = pymavlink_all.MAVLink(None)
    parser.robust_parsing = True
    with path.open("rb") as file:
        while file.read(8):
            message = None
            while message is None:
                wanted = file.read(parser.bytes_needed())
                if not wanted:
                    return
                message = parser.parse_char(wanted)
            yield message


def system_and_id(message: Any) -> tuple[int, int]:
    """As pymavlink says it; of a message that it does not know it keeps the name alone, and no header."""
    if isinstance(message, pymavlink_all.MAVLink_unknown):
        assert message.get_msgbuf()[0] == pymavlink_all.PROTOCOL_MARKER_V2
        return message.get_msgbuf()[5], int(message.get_type().removeprefix("UNKNOWN_"))
    return message.get_srcSystem(), message.get_msgId()


def assert_same(ours: Message, theirs: Any) -> None:
    """Equal by name, sender and every field."""
    kind = type(theirs)
    assert (ours.name, ours.msgid) == (kind.msgname, kind.id)
    assert (ours.system, ours.component) == (theirs.get_srcSystem(), theirs.get_srcComponent())
    assert ours.fields.keys() == set(kind.fieldnames)
    for name, type_name in zip(kind.fieldnames, kind.fieldtypes, strict=True):
        if type_name == "char":
            expected: Any = clean(getattr(theirs, f"_{name}_raw").split(b"\0", 1)[0])
        else:
            expected = getattr(theirs, name)
            expected = tuple(expected) if isinstance(expected, list) else expected
        assert repr(ours.fields[name]) == repr(expected), (ours.name, name)  # NaN is equal to itself here


def compare(path: Path, every: int) -> tuple[Counter[tuple[int, int]], Counter[tuple[int, int]]]:
    """Frames per (system, message id), ours and theirs, with the fields of each `every`th frame compared."""
    reader = read_tlog(path)
    ours: Counter[tuple[int, int]] = Counter()
    theirs: Counter[tuple[int, int]] = Counter()
    pairs: Iterator[tuple[tuple[float, Frame] | None, Any]] = zip_longest(reader, by_pymavlink(path))
    for ours_next, message in pairs:
        if message is not None:
            theirs[system_and_id(message)] += 1
        if ours_next is not None:
            frame = ours_next[1]
            key = (frame.system, frame.msgid)
            ours[key] += 1
            if message is None or frame.raw != bytes(message.get_msgbuf()):
                continue  # the counts will tell
            if ours[key] % every == 1 or every == 1:
                decoded = decode(frame)
                assert (decoded is None) == isinstance(message, pymavlink_all.MAVLink_unknown)
                if decoded is not None:
                    assert_same(decoded, message)
    assert (reader.skipped_bytes, reader.truncated) == (0, False)
    return ours, theirs


@pytest.mark.parametrize("path", EXCERPTS, ids=lambda path: path.stem)
def test_excerpts_decode_as_pymavlink_decodes_them(path: Path) -> None:
    ours, theirs = compare(path, every=1)
    assert ours == theirs
    assert {system for system, _ in ours} == {*range(1, 9), 255}
    assert len({msgid for _, msgid in ours}) > 30
    unknown = {msgid for _, msgid in ours if not dialect.is_known(msgid)}
    assert unknown == (MISSING if path.stem == "px4-8" else set())


def test_with_a_definition_of_what_is_missing_every_frame_of_px4_has_a_good_crc(tmp_path: Path) -> None:
    path = tmp_path / "missing.xml"
    path.write_text(MISSING_XML)
    added = {definition.msgid: bytes([definition.crc_extra]) for definition in read_xml(path, {})}
    seen = Counter[int]()
    for _, frame in read_tlog(ROOT / "tests" / "data" / "px4-8.tlog"):
        if not dialect.is_known(frame.msgid):
            crc_at = 10 + len(frame.payload)
            crc = mcrf4xx(frame.raw[1:crc_at] + added[frame.msgid])
            assert crc == int.from_bytes(frame.raw[crc_at : crc_at + 2], "little")
            seen[frame.msgid] += 1
    assert seen.keys() == added.keys() == MISSING


def test_both_excerpts_are_there() -> None:
    assert [path.stem for path in EXCERPTS] == ["arducopter-8", "px4-8"]


@pytest.mark.skipif(not WHOLE, reason="the whole recordings are not beside this repository")
@pytest.mark.parametrize("path", WHOLE, ids=lambda path: path.stem)
def test_whole_recordings_decode_as_pymavlink_decodes_them(path: Path) -> None:
    ours, theirs = compare(path, every=20)
    assert ours == theirs
    assert ours.total() > 150_000
