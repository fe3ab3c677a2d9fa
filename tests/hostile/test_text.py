"""Text from outside (B.6-75…87, as far as decoding): every string of every message is one line of plain text."""

import re
import time
import unicodedata
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from rich.cells import cell_len

import tui_gcs
from tests.core.rigs.rig import Rig
from tests.hostile.oracle import Oracle
from tests.hostile.test_framing import raw_frame
from tui_gcs.cli.flights.metric_files import events_csv
from tui_gcs.core.base.text import clean
from tui_gcs.core.judging.flight_record import RecordedEvent
from tui_gcs.core.judging.flight_result import FlightResult
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.frames import cut_datagram, decode
from tui_gcs.core.mavlink.message_definitions import FieldDefinition

dialect.is_known(0)
TEXTS = [
    (msgid, field.name)
    for msgid, definition in sorted(dialect._definitions.items())
    for field in definition.fields
    if field.is_text
]
"""Every character field of every message."""
WICKED = {
    "b6_75_osc_title": b"\x1b]0;owned\x07",
    "b6_75_osc_clipboard": b"\x1b]52;c;b3duZWQ=\x07",
    "b6_75_osc_link": b"\x1b]8;;http://x\x1b\\x",
    "b6_75_csi": b"\x1b[2J\x1b[H\x1b[6n",
    "b6_75_dcs_apc": b"\x1bPq\x1b\\\x1b_x\x1b\\",
    "b6_75_unterminated": b"\x1b]",
    "b6_76_c1_utf8": b"\xc2\x9b2J",
    "b6_76_c1_raw": b"\x9b2J",
    "b6_77_bells": b"\x07" * 20,
    "b6_78_lines": b"a\r\nb\x08\x08c\td\x0b\x0c",
    "b6_79_rlo": "\u202eevil\u2066\u200b\u200d".encode(),
    "b6_79_marks": ("a" + "\u0301" * 20).encode(),
    "b6_79_zwj_emoji": "👩\u200d🚀".encode(),
    "b6_79_sentence": "\ufdfd".encode(),
    "b6_87_separators": "a\u2028b\u2029c\x85".encode(),
}


def is_safe(text: str) -> bool:
    """One line; nothing that a terminal obeys, hides, reverses or piles up."""
    marks = 0
    for char in text:
        category = unicodedata.category(char)
        marks = marks + 1 if category in ("Mn", "Me") else 0
        if marks > 2 or category in ("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp") or (category == "Zs" and char != " "):
            return False
    return True


def field_of(msgid: int, name: str) -> FieldDefinition:
    return next(f for f in dialect._definitions[msgid].fields if f.name == name)


def decoded(msgid: int, name: str, data: bytes) -> Any:
    """What the field is after decoding a frame that carries `data` in it."""
    layout = dialect.layout(msgid)
    assert layout is not None
    values: list[Any] = []
    for f in layout.fields:
        values += [data if f.name == name else b""] if f.is_text else [0] * f.count
    (frame,) = cut_datagram(raw_frame(msgid, layout.pack(*values))).frames
    message = decode(frame)
    assert message is not None
    return message.fields[name]


def test_there_are_texts() -> None:
    assert len(TEXTS) > 50 and (253, "text") in TEXTS


@pytest.mark.parametrize(("msgid", "name"), TEXTS, ids=lambda value: str(value))
def test_every_text_field_is_cleaned_at_decode(msgid: int, name: str) -> None:
    """All 255 bytes that a text may hold, at every place in it, and the wicked ones."""
    length = max(1, field_of(msgid, name).length)
    every = bytes(range(1, 256))
    for start in range(0, 255, length):
        text = decoded(msgid, name, every[start : start + length])
        assert isinstance(text, str) and is_safe(text), repr(text)
    for wicked in WICKED.values():
        text = decoded(msgid, name, wicked[:length])
        assert is_safe(text) and cell_len(text) <= 200, repr(text)


@settings(max_examples=500)
@given(st.one_of(st.binary(max_size=300), st.text(max_size=300)), st.integers(0, 80))
@example(b"\xff" * 250, 3)
def test_whatever_is_cleaned_is_safe_and_as_narrow_as_asked(raw: str | bytes, cells: int) -> None:
    text = clean(raw, cells)
    assert is_safe(text)
    assert cell_len(text) <= cells
    assert clean(text, cells) == text, "cleaning twice changes nothing"


@settings(max_examples=300)
@given(st.binary(min_size=1, max_size=50))
def test_any_status_text_is_decoded_to_safe_text(data: bytes) -> None:
    assert is_safe(decoded(253, "text", data))


def test_wicked_status_texts(attack: Any) -> None:
    """Through the whole station: what comes out as an event is plain."""
    oracle: Oracle = attack()
    for letter, (name, wicked) in zip("abcdefghijklmnopqrs", WICKED.items(), strict=False):
        oracle.say("STATUSTEXT", 1, severity=4, text=b"x" + letter.encode() + wicked[:48])
        oracle.run(0.1)
        said = [event.text for event in oracle.new_events() if event.text.startswith(f"x{letter}")]
        assert len(said) == 1 and is_safe(said[0]), name
    lines = oracle.flight.journal.path.read_bytes().splitlines()
    assert not any(b"\x1b" in line or b"\x07" in line for line in lines)
    oracle.holds(told="^x")


def test_b6_80_81_markup_and_formats_are_literal(attack: Any) -> None:
    oracle: Oracle = attack()
    literal = ["[/]", "[@click=app.quit]x[/]", "[link=x]", "[", "\\", "%s%n{0}{x.__class__}"]
    for words in literal:
        oracle.say("STATUSTEXT", 1, severity=4, text=words.encode())
        oracle.run(0.1)
    assert [event.text for event in oracle.new_events() if event.source == "vehicle 1"] == literal
    oracle.holds()


def test_b6_82_chunks_that_never_end(attack: Any) -> None:
    """At most 10 chunks of 50 characters; what is missing is reported as missing after a second."""
    oracle: Oracle = attack()
    for chunk in (0, 1, 3, 255, 9, 10, 200):
        oracle.say("STATUSTEXT", 1, severity=4, text=b"y" * 50, id=7, chunk_seq=chunk)
    for number in range(300):
        oracle.say("STATUSTEXT", 1, severity=4, text=b"z" * 50, id=1 + number, chunk_seq=number % 256)
    oracle.run(6.0)
    said = oracle.told("^ ?(y|z|\\.\\.\\. )")
    assert said and all(len(event.text) <= 600 for event in said)
    oracle.holds(told="y")


def test_b6_83_a_flood_of_texts_hides_no_emergency(attack: Any) -> None:
    """All different, 1,000 a second: 60 and then 5 a second are reported, and all urgent ones; the rest is counted."""
    oracle: Oracle = attack()
    for number in range(3000):
        word = f"{number:04}".translate(str.maketrans("0123456789", "abcdefghij"))
        oracle.say("STATUSTEXT", 1, severity=6, text=f"chatter {word}".encode())
        if number % 50 == 0:
            oracle.run(0.05)
    oracle.say("STATUSTEXT", 1, severity=0, text=b"engine failure")
    oracle.run(0.5)
    assert oracle.told("^engine failure$")
    chatter = oracle.told("^chatter")
    assert 60 <= len(chatter) <= 60 + 5 * (oracle.now - oracle.begun_s)
    oracle.holds(counted="status texts too fast", told="chatter")


def test_b6_83_a_datagram_full_of_texts_costs_little(attack: Any) -> None:
    """Some 3,000 of them in 64 KiB: a few are read, the rest is counted, and an urgent one behind them is reported."""
    oracle: Oracle = attack()
    words = [f"ü{chr(97 + n % 26)}{chr(97 + n // 26 % 26)}\x1b" for n in range(3000)]
    frames = [oracle.frame("STATUSTEXT", severity=6, text=word.encode()) for word in words]
    took_s = []
    # The least of some: what else runs on the computer adds to it. With two more test workers one took 30 ms.
    for _ in range(5):
        oracle.inject(b"".join(frames)[:65_000], ("sim", 0))
        oracle.say("STATUSTEXT", 1, severity=0, text=b"engine failure")
        begun_s = time.process_time()
        oracle.flight.station.receive()
        took_s.append(time.process_time() - begun_s)
    assert min(took_s) < 0.025, f"{min(took_s) * 1e3:.0f} ms"
    oracle.run(0.1)
    assert oracle.dropped()["status texts too fast"] > 2500
    assert oracle.told("^engine failure$")
    oracle.holds(counted="status texts too fast", sends=lambda address, message: address == ("sim", 0))


def test_b6_84_severities_that_do_not_exist(attack: Any) -> None:
    oracle: Oracle = attack()
    for severity in (8, 100, 255):
        oracle.say("STATUSTEXT", 1, severity=severity, text=b"how bad %c" % (65 + severity % 26))
    oracle.run(0.1)
    assert {event.severity for event in oracle.told("how bad")} == {5}
    oracle.holds(told="how bad")


def test_b6_85_a_text_that_sounds_like_us(attack: Any) -> None:
    """Every event names its source, which no vehicle can choose."""
    oracle: Oracle = attack()
    oracle.say("STATUSTEXT", 1, severity=0, text=b"station: ALL LANDED")
    oracle.run(0.1)
    assert [event.source for event in oracle.told("ALL LANDED")] == ["vehicle 1"]
    oracle.holds(told="ALL LANDED")


def test_b6_86_no_table_is_written_that_a_spreadsheet_would_calculate() -> None:
    """Cells of texts that begin with = + - @ are formulas there: one module writes tables, and keeps formulas off."""
    sources = {path: path.read_text(encoding="utf-8") for path in Path(tui_gcs.__file__).parent.rglob("*.py")}
    assert len(sources) > 100
    assert [str(path) for path, text in sources.items() if re.search(r"csv\.writer|csv\.DictWriter", text)] == [
        str(Path(tui_gcs.__file__).parent / "core" / "formats" / "csv_table.py")
    ]
    evil = "=HYPERLINK(1)"
    flight = FlightResult("it", 42, [], [], records=[RecordedEvent(1.0, "one", evil, "-1+1", None, "@SUM(A1)")])
    assert events_csv(flight).splitlines()[1] == "1.0,one,'=HYPERLINK(1),'-1+1,,'@SUM(A1)"


def test_b6_87_a_text_cannot_forge_a_record_of_the_journal(attack: Any) -> None:
    import json

    oracle: Oracle = attack()
    oracle.say("STATUSTEXT", 1, severity=4, text=b'a"}\n{"action":"arm","vehicle":9}')
    oracle.run(0.1)
    rig: Rig = oracle.flight
    records = [json.loads(line) for line in rig.journal.path.read_text().splitlines()]
    assert not any(record.get("vehicle") == 9 for record in records)
    oracle.holds()
