"""The journal: one JSON object per line, whatever is journalled."""

import json
from pathlib import Path

from tui_gcs.core.journal import Journal


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


def test_a_disk_that_fails_is_told_not_raised(tmp_path: Path) -> None:
    (tmp_path / "disk").write_text("")
    journal = Journal(tmp_path / "disk" / "j")
    journal.write({"action": "arm"})
    assert str(journal.path) in journal.error
    (tmp_path / "disk").unlink()
    journal.write({"action": "land"})
    assert journal.error == ""
    assert [line["action"] for line in lines(journal)] == ["arm", "land"]
