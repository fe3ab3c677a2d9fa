"""All recordings decode completely, and to the same as an independent decode by pymavlink's own parser."""

from collections import Counter
from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path
from typing import Any

import pytest
from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import all as pymavlink_all

from tests.core.rigs.wire_newer import NEW, extra_fields
from tui_gcs.core.base.text import clean
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.dialect import MavlinkMessage
from tui_gcs.core.mavlink.frames import Frame, decode
from tui_gcs.core.records.tlog_reader import read_tlog

pytestmark = pytest.mark.long  # whole recordings

ROOT = Path(__file__).parents[3]
EXCERPTS = sorted((ROOT / "tests" / "data").glob("*-8.tlog"))
WHOLE = sorted((ROOT.parent / "shared" / "data").glob("*.tlog"))
"""The recordings that the excerpts are from, and those of services, where somebody has them."""

NOISE = {6619122, 10944360}
"""In px4-services: two pieces of log file contents that look like frames of messages nobody knows."""


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


def assert_same(ours: MavlinkMessage, theirs: Any) -> None:
    """Equal by name, sender and every field; fields that pymavlink lacks are as its own buffer holds them."""
    kind = type(theirs)
    assert (ours.name, ours.msgid) == (kind.msgname, kind.id)
    assert (ours.system, ours.component) == (theirs.get_srcSystem(), theirs.get_srcComponent())
    raw = bytes(theirs.get_msgbuf())
    more = extra_fields(kind.id, raw[10 : 10 + raw[1]], kind.unpacker.size)
    assert ours.fields.keys() == {*kind.fieldnames, *more}
    assert {name: ours.fields[name] for name in more} == more
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
                assert (decoded is None) == (frame.msgid in NOISE)
                unknown_to_pymavlink = isinstance(message, pymavlink_all.MAVLink_unknown)
                assert unknown_to_pymavlink == (frame.msgid in NEW or frame.msgid in NOISE)
                if decoded is not None and not unknown_to_pymavlink:
                    assert_same(decoded, message)
    assert (reader.skipped_bytes, reader.truncated) == (0, False)
    return ours, theirs


@pytest.mark.parametrize("path", EXCERPTS, ids=lambda path: path.stem)
def test_excerpts_decode_as_pymavlink_decodes_them(path: Path) -> None:
    ours, theirs = compare(path, every=1)
    assert ours == theirs
    assert {system for system, _ in ours} == {*range(1, 9), 255}
    assert len({msgid for _, msgid in ours}) > 30
    assert all(dialect.is_known(msgid) for _, msgid in ours)
    assert {msgid for _, msgid in ours} & NEW.keys() == ({8, 380, 410, 411} if path.stem == "px4-8" else set())


@pytest.mark.parametrize("path", [*EXCERPTS, *WHOLE], ids=lambda path: f"{path.parent.parent.name}-{path.stem}")
def test_every_frame_is_known_has_a_good_crc_and_fits_its_message(path: Path) -> None:
    unknown = set()
    for _, frame in read_tlog(path):
        found = dialect.layout(frame.msgid)
        if found is None:
            unknown.add(frame.msgid)
            continue
        crc_at = (10 if frame.version == 2 else 6) + len(frame.payload)
        crc = mcrf4xx(frame.raw[1:crc_at] + found.extra)
        assert crc == int.from_bytes(frame.raw[crc_at : crc_at + 2], "little"), found.name
        assert len(frame.payload) <= found.size, found.name
        assert decode(frame) is not None
    assert unknown == (NOISE if path.stem == "px4-services" else set())


def test_both_excerpts_are_there() -> None:
    assert [path.stem for path in EXCERPTS] == ["arducopter-8", "px4-8"]


@pytest.mark.skipif(not WHOLE, reason="the whole recordings are not beside this repository")
@pytest.mark.parametrize("path", WHOLE, ids=lambda path: path.stem)
def test_whole_recordings_decode_as_pymavlink_decodes_them(path: Path) -> None:
    ours, theirs = compare(path, every=20)
    assert ours == theirs
    assert ours.total() > (150_000 if path.stem.endswith("-8") else 70_000)
