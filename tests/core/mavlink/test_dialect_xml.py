"""Messages from a MAVLink XML file, as pymavlink's generator understands them, and never more than messages."""

import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.generator.mavparse import MAVXML

from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink import message_tables as tables
from tui_gcs.core.mavlink.dialect_xml import MAX_INCLUDE_DEPTH, read_xml
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import cut_datagram, decode
from tui_gcs.core.mavlink.message_definitions import STRUCT_CODES, DialectError, MessageDefinition, pymavlink_xml

PYMAVLINK = {definition.msgid: definition for definition in tables.from_pymavlink()}
KNOWN = {definition.msgid: definition for definition in tables.load_uncached()}
WEATHER = """<?xml version="1.0"?>
<mavlink>
  <include>common.xml</include>
  <dialect>42</dialect>
  <enums><enum name="SKY"><entry value="__import__('os').abort()" name="SKY_CLEAR"/></enum></enums>
  <messages>
    <message id="61000" name="WEATHER">
      <description>What the weather is like.</description>
      <field type="uint8_t" name="target_system">System.</field>
      <field type="uint8_t" name="target_component">Component.</field>
      <field type="char[10]" name="place">Where.</field>
      <field type="int16_t[3]" name="wind" units="cm/s">From where.</field>
      <field type="uint8_t_mavlink_version" name="version">Of the format.</field>
      <field type="double" name="pressure" units="Pa">Pressure.</field>
      <field type="float" name="temperature" units="degC">Temperature.</field>
      <extensions/>
      <field type="uint64_t" name="time_usec">When.</field>
      <field type="char" name="letter">Of the station.</field>
    </message>
    <message id="61001" name="WEATHER_OVER"/>
  </messages>
</mavlink>
"""


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Writes an XML file of messages: `write("a.xml", '<message …/>', include="b.xml")`."""

    def file(name: str, messages: str = "", include: str = "") -> Path:
        included = f"<include>{include}</include>" if include else ""
        path = tmp_path / name
        path.write_text(f"<mavlink>{included}<messages>{messages}</messages></mavlink>")
        return path

    return file


@pytest.fixture
def undone() -> Iterator[None]:
    """Whatever the test adds to the dialect is gone afterwards."""
    dialect.is_known(0)
    held = dict(dialect._definitions), dict(dialect._ids)
    yield
    for table, before in zip((dialect._definitions, dialect._ids), held, strict=True):
        table.clear()
        table.update(before)
    dialect._layouts.clear()
    dialect.CRC_EXTRA.clear()


def message(name: str, number: int, *fields: str, extensions: tuple[str, ...] = ()) -> str:
    """`fields` as "type name"."""

    def tags(described: tuple[str, ...]) -> str:
        return "".join('<field type="{}" name="{}"/>'.format(*field.split()) for field in described)

    return f'<message id="{number}" name="{name}">{tags(fields)}<extensions/>{tags(extensions)}</message>'


def assert_as_the_generator(path: Path, ours: list[MessageDefinition]) -> None:
    theirs = MAVXML(str(path), "2.0")
    assert {d.msgid: d.crc_extra for d in ours} == theirs.message_crcs
    assert {d.msgid: d.name for d in ours} == theirs.message_names
    for each in theirs.message:
        (same,) = (d for d in ours if d.msgid == each.id)
        assert [field.name for field in same.fields] == each.ordered_fieldnames
        assert [field.length for field in same.fields] == [field.array_length for field in each.ordered_fields]
        for field in each.fields:
            assert same.offset(field.name) == field.wire_offset


def test_messages_are_as_pymavlinks_generator_understands_them(tmp_path: Path) -> None:
    path = tmp_path / "weather.xml"
    path.write_text(WEATHER)
    ours = read_xml(path, KNOWN)
    assert [(d.name, d.msgid) for d in ours] == [("WEATHER", 61000), ("WEATHER_OVER", 61001)]
    harmless = tmp_path / "harmless.xml"  # the generator would run the code in it
    harmless.write_text(WEATHER.replace("__import__('os').abort()", "1"))
    assert_as_the_generator(harmless, ours)


@given(st.data())
def test_any_message_is_as_pymavlinks_generator_understands_it(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    kinds = st.sampled_from([*STRUCT_CODES, "uint8_t[3]", "char[7]", "float[2]", "int64_t[1]", "double[2]"])
    types = data.draw(st.lists(kinds, min_size=1, max_size=12))
    base = data.draw(st.integers(1, len(types)))
    fields = [f"{kind} field_{index}" for index, kind in enumerate(types)]
    path = tmp_path_factory.getbasetemp() / "any.xml"
    one = message("ANY", 61000, *fields[:base], extensions=tuple(fields[base:]))
    path.write_text(f"<mavlink><messages>{one}</messages></mavlink>")
    assert_as_the_generator(path, read_xml(path, {}))


def test_pymavlinks_own_definitions_are_read_as_the_tables_that_it_generated() -> None:
    path = pymavlink_xml("all.xml")
    assert path is not None
    assert {definition.msgid: definition for definition in read_xml(path, {})} == PYMAVLINK
    assert read_xml(path, PYMAVLINK) == []


def test_pymavlinks_older_definitions_do_not_undo_what_ours_has_more() -> None:
    for name in ("all.xml", "common.xml"):
        path = pymavlink_xml(name)
        assert path is not None
        assert read_xml(path, KNOWN) == []


def test_our_newer_definitions_are_as_pymavlinks_generator_understands_them() -> None:
    assert_as_the_generator(tables.NEWER_XML, read_xml(tables.NEWER_XML, {}))


@pytest.mark.usefixtures("undone")
def test_what_was_added_is_sent_cut_and_decoded(tmp_path: Path) -> None:
    path = tmp_path / "weather.xml"
    path.write_text(WEATHER)
    assert dialect.label(61000) == "UNKNOWN_61000"
    assert dialect.layout(61000) is None
    assert dialect.add_xml(path) == ("WEATHER", "WEATHER_OVER")
    sent = {
        "target_system": 3,
        "target_component": 1,
        "place": "Żary",
        "wind": (-100, 20, 0),
        "version": 3,
        "pressure": 101325.0,
        "temperature": 21.5,
    }
    raw = Encoder(1, 1).encode("WEATHER", **sent)
    (frame,) = cut_datagram(raw).frames
    received = decode(frame)
    assert received is not None
    assert received.fields == sent | {"time_usec": 0, "letter": ""}
    found = dialect.layout(61000)
    assert found is not None
    assert (raw[10 + found.target_system_at], raw[10 + found.target_component_at]) == (3, 1)
    (empty,) = cut_datagram(Encoder(1, 1).encode("WEATHER_OVER")).frames
    assert decode(empty) == ("WEATHER_OVER", 61001, 1, 1, {})


@pytest.mark.usefixtures("undone")
def test_a_known_message_becomes_longer_by_new_extensions(write: Callable[..., Path]) -> None:
    fields = "uint64_t time_unix_usec", "uint32_t time_boot_ms"
    known = dialect.layout(2)
    assert known is not None
    assert known.names == ("time_unix_usec", "time_boot_ms")
    newer = write(
        "newer.xml", message("SYSTEM_TIME", 2, *fields, extensions=("uint8_t target_system", "int8_t leap_s"))
    )
    assert dialect.add_xml(newer) == ("SYSTEM_TIME",)
    longer = dialect.layout(2)
    assert longer is not None
    assert (longer.size, longer.target_system_at, longer.extra) == (14, 12, known.extra)
    older = write("older.xml", message("SYSTEM_TIME", 2, *fields))
    assert dialect.add_xml(older) == ()
    assert dialect.layout(2) == longer


@pytest.mark.usefixtures("undone")
def test_a_file_may_bring_what_we_have_from_newer_xml_and_what_we_have_not(write: Callable[..., Path]) -> None:
    event = (
        "uint8_t destination_component",
        "uint8_t destination_system",
        "uint32_t id",
        "uint32_t event_time_boot_ms",
        "uint16_t sequence",
        "uint8_t log_levels",
        "uint8_t[40] arguments",
    )
    both = write("both.xml", message("EVENT", 410, *event) + message("TUNES", 61000, "uint32_t format"))
    assert dialect.add_xml(both) == ("TUNES",)
    other = write("other.xml", message("EVENT", 410, *event[:-1]))
    with pytest.raises(DialectError, match=r"EVENT \(410, CRC \d+\) differs from the known EVENT \(410, CRC 160\)"):
        dialect.add_xml(other)


@pytest.mark.parametrize(
    ("messages", "why"),
    [
        (message("ATTITUDE", 30, "float roll"), "message ATTITUDE (30, CRC 121) differs from the known ATTITUDE (30"),
        (message("MINE", 30, "float roll"), "differs from the known ATTITUDE (30, CRC 39); give it an id of its own"),
        (message("ATTITUDE", 61000, "float roll"), "message ATTITUDE (61000) is known with id 30; rename it"),
        (
            message("STATUSTEXT", 253, "uint8_t severity", "char[50] text", extensions=("int8_t mine",)),
            "message STATUSTEXT (253, CRC 83) differs",
        ),
        (message("A", 61000, "float x") + message("A", 61000, "float y"), "message A (61000"),
        (message("A", 16777216), "message A: needs an id from 0 to 16777215; give it one (line 1)"),
        (message("A", -5), "needs an id from 0"),
        ('<message name="A"/>', "needs an id from 0"),
        ('<message id="5"/>', "a message needs a name"),
        (message("A\u00dc", 61000), "a message needs a name of letters, digits and _"),
        (message("A", 61000, "string name"), "message A: field name has the unknown type 'string'; use one like"),
        (message("A", 61000, "uint8_t[0] f"), "field f has the unknown type 'uint8_t[0]'"),
        (message("A", 61000, "uint8_t[-1] f"), "field f has the unknown type 'uint8_t[-1]'"),
        (message("A", 61000, "uint8_t[256] f"), "field f has the unknown type 'uint8_t[256]'"),
        (message("A", 61000, "double[32] f"), "message A: is longer than 255 bytes; make it two messages"),
        (message("A", 61000, "float f", "float f"), "field 'f' needs a name of its own"),
        (message("A", 61000, "float f[3]"), "field 'f[3]' needs a name of its own"),
        (message("A", 61000, *(f"char f{n}" for n in range(65))), "has more than 64 fields"),
    ],
    ids=range(18),
)
@pytest.mark.usefixtures("undone")
def test_what_cannot_be_used_says_why_in_one_line_and_adds_nothing(
    write: Callable[..., Path], messages: str, why: str
) -> None:
    path = write("mine.xml", message("GOOD", 61999, "float x") + messages)
    with pytest.raises(DialectError) as refused:
        dialect.add_xml(path)
    assert str(refused.value).startswith(f"{path}: ")
    assert why in str(refused.value)
    assert "\n" not in str(refused.value)
    assert not dialect.is_known(61999)


def test_an_include_beside_the_file_is_read_once(write: Callable[..., Path]) -> None:
    write("third.xml", message("THIRD", 61003, "float x"), include="first.xml")
    write("second.xml", message("SECOND", 61002, "float x"), include="third.xml")
    first = write("first.xml", message("FIRST", 61001, "float x"), include=" second.xml\n")
    assert [d.name for d in read_xml(first, KNOWN)] == ["FIRST", "SECOND", "THIRD"]


def test_an_include_that_pymavlink_brings_need_not_be_there(write: Callable[..., Path]) -> None:
    for include in ("common.xml", "ardupilotmega.xml", "../upstream/standard.xml"):
        assert [d.name for d in read_xml(write("mine.xml", message("A", 61000), include=include), KNOWN)] == ["A"]


def test_an_include_in_another_directory_is_not_read(write: Callable[..., Path], tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    write("outside.xml", message("A", 61000))
    inside = write("deep/inside.xml", include="../outside.xml")
    with pytest.raises(DialectError, match=r"includes '\.\./outside\.xml', which is not in the same directory"):
        read_xml(inside, KNOWN)


@pytest.mark.parametrize("include", ["nowhere.xml", "..", "a" * 300, "a\n" * 5000, "\u00fc.xml", ""])
def test_an_include_that_is_nowhere_is_said(write: Callable[..., Path], include: str) -> None:
    path = write("mine.xml", include="<!-- -->" + include)
    with pytest.raises(DialectError, match=r"^\S+mine\.xml: includes '[^\n]*$"):
        read_xml(path, KNOWN)


def test_includes_are_not_followed_for_ever(write: Callable[..., Path]) -> None:
    for number in range(MAX_INCLUDE_DEPTH + 2):
        write(f"{number}.xml", include=f"{number + 1}.xml")
    with pytest.raises(DialectError, match="more than 8 files deep"):
        read_xml(write("0.xml", include="1.xml"), KNOWN)


BOMB = b'<!DOCTYPE m [<!ENTITY a "aaaaaaaaaa">' + b"".join(
    b'<!ENTITY %c "%s">' % (97 + n, b"&%c;" % (96 + n) * 10) for n in range(1, 20)
)
MOST = 1 << 20
HOSTILE = {
    "bomb": (BOMB + b"]><mavlink>&t;</mavlink>", "a DOCTYPE is not allowed here; remove it (line 1)"),
    "file": (b'<!DOCTYPE m [<!ENTITY x SYSTEM "/etc/passwd">]><mavlink><include>&x;</include></mavlink>', "DOCTYPE"),
    "subset": (b'<!DOCTYPE mavlink SYSTEM "http://127.0.0.1:1/x.dtd"><mavlink/>', "DOCTYPE"),
    "large": (b"<mavlink>" + b" " * MOST + b"</mavlink>", "larger than 1 MiB"),
    "deep": (b"<mavlink>" + b"<a>" * (MOST // 3 - 4), "no XML (no element found"),
    "text": (b"<mavlink><include>" + b"a\n" * 500_000 + b"</include></mavlink>", "which is no file name"),
    "includes": (b"<mavlink>" + b"<include>x.xml</include>" * 40_000 + b"</mavlink>", "not in the same directory"),
    "empty": (b"", "no XML (no element found, line 1); correct it"),
    "binary": (bytes(range(256)) * 4000, "no XML (not well-formed (invalid token), line 1)"),
    "torn": (WEATHER.encode()[:900], "no XML ("),
    "other": (b"<svg/>", "begins with <svg>, not <mavlink>"),
    "encoding": (b'<?xml version="1.0" encoding="zlib"?><mavlink/>', "in an unknown encoding; write it in UTF-8"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_are_refused_at_once(tmp_path: Path, name: str) -> None:
    data, why = HOSTILE[name]
    path = tmp_path / "hostile.xml"
    path.write_bytes(data)
    began_s = time.process_time()
    with pytest.raises(DialectError) as refused:
        read_xml(path, KNOWN)
    assert time.process_time() - began_s < 1
    assert why in str(refused.value)
    assert str(refused.value).count("\n") == 0


def test_what_is_no_file_is_refused_without_waiting(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.xml")
    for path in (tmp_path, tmp_path / "none.xml", tmp_path / "pipe.xml", Path(os.devnull)):
        with pytest.raises(DialectError, match="is not there, or no regular file"):
            read_xml(path, KNOWN)
    with pytest.raises(DialectError, match="cannot be read"):
        read_xml(tmp_path / ("long" * 100), KNOWN)


@given(st.lists(st.sampled_from([*WEATHER.replace(">", ">\n").split("\n"), "<", "]]>", "&#0;", "\udc80"]), max_size=30))
def test_any_pieces_of_xml_are_read_or_refused(tmp_path_factory: pytest.TempPathFactory, pieces: list[str]) -> None:
    path = tmp_path_factory.getbasetemp() / "pieces.xml"
    path.write_bytes(b"<mavlink><messages>\n" + "\n".join(pieces).encode(errors="surrogateescape"))
    try:
        read_xml(path, KNOWN)
    except DialectError as error:
        assert "\n" not in str(error)
