"""What a rehearsal leaves in its folder: gates, and a scenario that a later one is compared with."""

from pathlib import Path

import msgspec
import pytest

from tui_gcs.core.records.rehearsal_files import (
    MAX_CHANGES,
    RESULT_NAME,
    SCENARIO_NAME,
    ScenarioChange,
    read_gates,
    read_scenario_text,
    scenario_changes,
)


def test_a_changed_line_an_added_one_and_a_removed_one() -> None:
    before = "name = 'a'\nsize = 4\nold = 1\n[x]\n"
    assert scenario_changes(before, "name = 'a'\nsize = 6\n[x]\nnew = 2\n") == (
        ScenarioChange("~", 2, "size = 4  ->  size = 6"),
        ScenarioChange("-", 3, "old = 1"),
        ScenarioChange("+", 4, "new = 2"),
    )
    assert scenario_changes(before, before) == ()


def test_a_long_difference_is_cut_and_hostile_text_is_cleaned() -> None:
    assert len(scenario_changes("", "x\n" * 10_000)) == MAX_CHANGES
    (change,) = scenario_changes("", "\x1b[2Jname")
    assert "\x1b" not in change.text


def test_failed_gates_come_first(tmp_path: Path) -> None:
    checks = [{"name": "a", "ok": True, "value": 1.0, "limit": None}, {"name": "b", "ok": False, "why": "it is"}]
    (tmp_path / RESULT_NAME).write_bytes(msgspec.json.encode({"ok": False, "data": {"checks": checks, "more": 1}}))
    assert [(gate.name, gate.value, gate.why) for gate in read_gates(tmp_path)] == [
        ("b", None, "it is"),
        ("a", 1.0, ""),
    ]


@pytest.mark.parametrize("data", [b"", b"{", b"[]", b'{"data": {"checks": [1]}}', b"\xff\xfe", b'{"data": null}'])
def test_files_that_are_damaged_are_as_none(tmp_path: Path, data: bytes) -> None:
    (tmp_path / RESULT_NAME).write_bytes(data)
    (tmp_path / SCENARIO_NAME).write_bytes(b"\xff")
    assert read_gates(tmp_path) == () and read_scenario_text(tmp_path) is None
    assert read_gates(tmp_path / "missing") == () and read_scenario_text(tmp_path / "missing") is None
