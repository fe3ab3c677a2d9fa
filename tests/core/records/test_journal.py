"""The journal: one JSON object per line, whatever is journalled."""

import json
from pathlib import Path

import msgspec

from tui_gcs.core.protocol.journal import JOURNAL_END
from tui_gcs.core.records.journal import Journal
from tui_gcs.core.records.journal_reader import events_before

EVENT = {"seq": 1, "t_s": 1.0, "wall_s": 2.0, "cls": "mission", "severity": 6, "source": "you", "text": "told"}


def lines(journal: Journal) -> list[dict[str, object]]:
    return [json.loads(line) for line in journal.path.read_text().splitlines()]


def test_a_record_is_on_disk_when_write_returns(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "state" / "journal.jsonl")
    journal.write({"action": "arm", "vehicle": 3})
    journal.write({"action": "land", "vehicle": 3, "reason": None})
    assert lines(journal) == [{"action": "arm", "vehicle": 3}, {"action": "land", "vehicle": 3, "reason": None}]
    journal.close()


def test_a_text_cannot_forge_a_second_record(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "j")
    journal.write({"text": 'x"}\n{"action": "arm"}\r\x00'})
    assert len(lines(journal)) == 1


def test_odd_values_are_journalled_somehow(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "j")
    journal.write({"number": float("nan"), "path": Path("x"), "set": {1}, "nested": {5: "five"}})
    journal.write({"broken": "\ud800"})
    nested: list[object] = []
    nested.append(nested)
    journal.write({"endless": nested})
    written = lines(journal)
    assert written[0] == {"number": None, "path": "x", "set": [1], "nested": {"5": "five"}}
    assert len(written) == 3


def test_half_a_line_of_a_crash_is_ended_first(tmp_path: Path) -> None:
    path = tmp_path / "j"
    path.write_text('{"action": "arm"}\n{"act')
    journal = Journal(path)
    journal.write({"action": "land"})
    assert path.read_text() == '{"action": "arm"}\n{"act\n{"action":"land"}\n'


def test_a_journal_that_ended_well_is_just_continued(tmp_path: Path) -> None:
    for number in range(3):
        journal = Journal(tmp_path / "j")
        journal.write({"start": number})
        journal.close()
    assert (tmp_path / "j").read_text() == '{"start":0}\n{"start":1}\n{"start":2}\n'


def test_while_a_disk_fails_the_newest_4_mib_wait_and_the_oldest_are_counted(tmp_path: Path) -> None:
    (tmp_path / "disk").write_text("")
    journal = Journal(tmp_path / "disk" / "j")
    for number in range(5):
        journal.write({"number": number, "text": "x" * 1_000_000})
    assert journal.dropped == 1
    (tmp_path / "disk").unlink()
    journal.write({"number": 5})
    assert [line["number"] for line in lines(journal)] == [1, 2, 3, 4, 5]


def test_a_disk_that_fails_is_told_not_raised(tmp_path: Path) -> None:
    (tmp_path / "disk").write_text("")
    journal = Journal(tmp_path / "disk" / "j")
    journal.write({"action": "arm"})
    assert str(journal.path) in journal.error
    (tmp_path / "disk").unlink()
    journal.write({"action": "land"})
    assert journal.error == ""
    assert [line["action"] for line in lines(journal)] == ["arm", "land"]


def test_events_are_paged_from_the_end_and_none_is_missing_or_doubled(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "journal.jsonl")
    for seq in range(200):
        if seq % 3 == 0:
            journal.write({"action": "hold", "vehicle": seq})
        journal.write({**EVENT, "seq": seq, "text": "x" * (seq % 40)})
    journal.write({"planner_failed": "y" * 5000})  # longer than a piece
    at, found = JOURNAL_END, []
    for _ in range(100):
        events, at = events_before(journal.path, at, piece_bytes=1000)
        found = [event.seq for event in events] + found
        if not at:
            break
    assert found == list(range(200))


def test_a_journal_that_is_gone_or_damaged_has_what_can_be_read(tmp_path: Path) -> None:
    assert events_before(tmp_path / "none", JOURNAL_END) == ((), 0)
    path = tmp_path / "journal.jsonl"
    path.write_bytes(b'\xff\xfe{"seq": 1\n' + msgspec.json.encode(EVENT) + b"\nhalf a li")
    events, at = events_before(path, 10**12)
    assert ([event.text for event in events], at) == (["told"], 0)
