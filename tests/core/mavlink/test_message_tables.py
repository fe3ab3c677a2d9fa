"""The tables agree with pymavlink and add what it lacks; their cache file can be missing or broken but not harmful."""

import os
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as pymavlink_all

from tests.core.rigs.wire_newer import LONGER, NEW
from tui_gcs.core.mavlink import message_tables as tables
from tui_gcs.core.mavlink.message_definitions import STRUCT_CODES, DialectError, FieldDefinition, MessageDefinition

PYMAVLINK = {definition.msgid: definition for definition in tables.from_pymavlink()}
WHOLE = {definition.msgid: definition for definition in tables.load_uncached()}


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache file that was just made, in a home of its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    tables.load()
    return tmp_path / "tui-gcs" / "mavlink-tables"


def test_every_message_is_as_pymavlink_generated_it() -> None:
    assert set(PYMAVLINK) == set(pymavlink_all.mavlink_map)
    for msgid, kind in pymavlink_all.mavlink_map.items():
        ours = PYMAVLINK[msgid]
        assert ours.name == kind.msgname
        assert ours.crc_extra == kind.crc_extra, ours.name
        assert struct.calcsize(ours.format) == kind.unpacker.size, ours.name
        assert [field.name for field in ours.fields] == kind.ordered_fieldnames
        assert [field.count for field in ours.fields] == kind.lengths, ours.name


def test_nothing_that_pymavlink_has_is_changed_and_some_messages_go_on_behind_it() -> None:
    assert {msgid for msgid in PYMAVLINK if WHOLE[msgid] != PYMAVLINK[msgid]} == set(LONGER)
    for msgid, (form, names) in LONGER.items():
        ours, theirs = WHOLE[msgid], PYMAVLINK[msgid]
        assert (ours.name, ours.crc_extra) == (theirs.name, theirs.crc_extra)
        assert ours.fields[: len(theirs.fields)] == theirs.fields
        more = ours.fields[len(theirs.fields) :]
        assert tuple(field.name for field in more) == names
        assert "<" + "".join(STRUCT_CODES[field.type] for field in more) == form
        assert all(field.extension and not field.length for field in more)


def test_what_pymavlink_lacks_is_there_with_the_numbers_of_mavlinks_own_generator() -> None:
    assert WHOLE.keys() - PYMAVLINK.keys() == NEW.keys()
    for msgid, numbers in NEW.items():
        ours = WHOLE[msgid]
        assert (ours.name, ours.crc_extra, struct.calcsize(ours.format)) == numbers
        assert not any(field.extension for field in ours.fields)


def test_fields_that_were_added_later_are_extensions() -> None:
    text = WHOLE[253]
    assert [(field.name, field.extension) for field in text.fields] == [
        ("severity", False),
        ("text", False),
        ("id", True),
        ("chunk_seq", True),
    ]


def test_a_field_is_found_by_its_place_in_the_payload() -> None:
    position = MessageDefinition(
        9, "X", (FieldDefinition("time", "uint32_t", 0, False), FieldDefinition("cells", "int16_t", 3, False))
    )
    assert (position.offset("time"), position.offset("cells"), position.offset("none")) == (0, 4, -1)
    command = WHOLE[76]
    assert (command.name, command.offset("target_system")) == ("COMMAND_LONG", 30)


def test_what_was_written_is_read_again(cache: Path) -> None:
    assert tables.load() == WHOLE


def test_the_file_is_for_us_alone(cache: Path) -> None:
    assert cache.stat().st_mode & 0o777 == 0o600
    assert cache.parent.stat().st_mode & 0o777 == 0o700
    assert [file.name for file in cache.parent.iterdir()] == [cache.name]


def not_from_pymavlink(monkeypatch: pytest.MonkeyPatch) -> None:
    def never() -> list[MessageDefinition]:
        raise AssertionError("the cache was not used")

    monkeypatch.setattr(tables, "from_pymavlink", never)


def test_a_good_file_is_used(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    not_from_pymavlink(monkeypatch)
    assert tables.load() == WHOLE


@pytest.mark.parametrize(
    "broken",
    [b"", b"\0" * 100_000, b"pymavlink-1.0\n" + b"x" * 500, b"not a cache"],
    ids=["empty", "zeros", "foreign", "text"],
)
def test_a_file_that_is_no_cache_is_made_anew(cache: Path, broken: bytes) -> None:
    good = cache.read_bytes()
    cache.write_bytes(broken)
    assert tables.load() == WHOLE
    assert cache.read_bytes() == good


def test_a_torn_or_changed_file_is_made_anew(cache: Path) -> None:
    good = cache.read_bytes()
    for place in (0, 20, len(good) // 2, len(good) - 1):
        cache.write_bytes(good[:place])
        assert tables.load() == WHOLE
        cache.write_bytes(good[:place] + bytes([good[place] ^ 1]) + good[place + 1 :])
        assert tables.load() == WHOLE
        assert cache.read_bytes() == good


def test_a_file_for_another_pymavlink_python_or_format_is_made_anew(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = cache.read_bytes()
    monkeypatch.setattr(tables, "FORMAT", tables.FORMAT + 1)
    assert tables.load() == WHOLE
    assert cache.read_bytes() != before
    not_from_pymavlink(monkeypatch)
    assert tables.load() == WHOLE


@pytest.fixture
def newer_xml(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of `newer.xml` that is used in its place."""
    copy = tmp_path / "newer.xml"
    copy.write_bytes(tables.NEWER_XML.read_bytes())
    monkeypatch.setattr(tables, "NEWER_XML", copy)
    return copy


def test_a_file_made_with_another_newer_xml_is_made_anew(
    cache: Path, newer_xml: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = newer_xml.stat()
    newer_xml.write_text(newer_xml.read_text().replace('name="rpm"', 'name="RPM"'))  # neither size nor time tell
    os.utime(newer_xml, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert [field.name for field in WHOLE[291].fields].count("rpm") == 1
    loaded = tables.load()
    assert [field.name for field in loaded[291].fields].count("RPM") == 1
    assert loaded == WHOLE | {291: loaded[291]}
    not_from_pymavlink(monkeypatch)
    assert tables.load() == loaded


def test_the_same_newer_xml_in_another_place_is_the_same(
    cache: Path, newer_xml: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    not_from_pymavlink(monkeypatch)
    assert tables.load() == WHOLE


@pytest.mark.parametrize(("change", "why"), [("gone", "is not there"), ("float", "TIMESYNC .* differs from the known")])
def test_a_newer_xml_that_cannot_be_used_says_so(cache: Path, newer_xml: Path, change: str, why: str) -> None:
    if change == "gone":
        newer_xml.unlink()
    else:
        newer_xml.write_text(newer_xml.read_text().replace('"int64_t"', f'"{change}"'))
    with pytest.raises(DialectError, match=f"newer.xml: .*{why}"):
        tables.load()


def test_a_file_that_others_may_write_is_not_believed(cache: Path) -> None:
    cache.chmod(0o666)
    tables.load()
    assert cache.stat().st_mode & 0o777 == 0o600


def test_a_link_or_a_pipe_in_its_place_is_replaced(cache: Path, tmp_path: Path) -> None:
    real = tmp_path / "elsewhere"
    cache.rename(real)
    before = real.read_bytes()
    cache.symlink_to(real)
    assert tables.load() == WHOLE
    assert not cache.is_symlink()
    assert real.read_bytes() == before
    cache.unlink()
    os.mkfifo(cache)
    assert tables.load() == WHOLE
    assert cache.is_file()


def test_a_directory_of_somebody_else_is_left_alone(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cache.unlink()
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    assert tables.load() == WHOLE
    assert list(cache.parent.iterdir()) == []


@pytest.mark.parametrize("place", ["/dev/null/cache", "relative/cache", ""])
def test_without_a_place_for_it_all_works_as_well(place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", place)
    monkeypatch.setenv("HOME", "/dev/null")
    assert tables.load() == WHOLE
    assert list(tmp_path.iterdir()) == []


HOSTILE = [
    [1 << 24, "X", []],
    [-1, "X", []],
    [1, "\x1b[2J", []],
    [1, "X", [["f", "99999999s", 0, False]]],
    [1, "X", [["f", "char", 1 << 40, False]]],
    [1, "X", [["f", "char", 1, False, "more"]]],
    [1, "X", [["f", "char", 1, False]] * 65],
    [1, "X"],
    {"msgid": 1},
]


@pytest.mark.parametrize("definition", HOSTILE, ids=range(len(HOSTILE)))
def test_values_that_make_no_sense_are_refused_even_with_a_good_checksum(cache: Path, definition: object) -> None:
    key = cache.read_bytes().split(b"\n", 1)[0]
    body = msgspec.msgpack.encode([definition])
    cache.write_bytes(key + b"\n" + zlib.crc32(body).to_bytes(4, "little") + body)
    assert tables.load() == WHOLE


@given(st.binary(max_size=200))
def test_any_bytes_behind_a_good_checksum_are_read_without_an_error(
    tmp_path_factory: pytest.TempPathFactory, body: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / "any-bytes"
    path.touch(mode=0o600)
    path.write_bytes(b"key\n" + zlib.crc32(body).to_bytes(4, "little") + body)
    found = tables._read(path, b"key")
    assert found is None or all(isinstance(definition, MessageDefinition) for definition in found)


START = """
import sys, time
from tui_gcs.core.mavlink import message_tables as tables
began_s = time.process_time()
tables.load()
print(1000 * (time.process_time() - began_s))
from tui_gcs.core.mavlink.frames import decode
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import cut_datagram
(frame,) = cut_datagram(Encoder(1, 1).encode("SYSTEM_TIME", time_unix_usec=5, time_boot_ms=6)).frames
assert decode(frame).fields == {"time_unix_usec": 5, "time_boot_ms": 6}
heavy = ("pymavlink", "xml.", "tui_gcs.core.mavlink.dialect_xml")
print(sorted(name for name in sys.modules if name.startswith(heavy)))
"""


def test_with_a_cache_neither_pymavlink_nor_xml_is_imported_and_loading_takes_milliseconds(cache: Path) -> None:
    taken_ms = []
    for _ in range(3):
        done = subprocess.run([sys.executable, "-c", START], capture_output=True, text=True, check=True)
        ms, modules = done.stdout.splitlines()
        assert modules == "[]"
        taken_ms.append(float(ms))
    assert min(taken_ms) < 20, "2 ms of CPU on an idle machine"


def test_two_starts_at_once_make_one_good_file(cache: Path) -> None:
    cache.unlink()
    both = [subprocess.Popen([sys.executable, "-c", START], stdout=subprocess.DEVNULL) for _ in range(2)]
    assert [process.wait() for process in both] == [0, 0]
    assert [file.name for file in cache.parent.iterdir()] == [cache.name]
    assert tables.load() == WHOLE


def test_the_key_names_the_version_that_is_installed(cache: Path) -> None:
    from importlib.metadata import version

    package = tables.pymavlink_package()
    assert package is not None
    key = tables._key(package)
    assert key is not None
    assert key.startswith(f"pymavlink-{version('pymavlink')}-".encode())
