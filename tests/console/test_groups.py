"""Saved groups of vehicles: on disk by fleet, and a file that is damaged is never overwritten."""

from pathlib import Path

import pytest

from tui_gcs.console.groups import MAX_GROUPS, GroupFile, GroupsError


def test_groups_are_kept_by_fleet_and_seen_by_another_console(tmp_path: Path) -> None:
    mine, other = GroupFile(tmp_path / "groups.json"), GroupFile(tmp_path / "groups.json")
    assert mine.of("north") == {}
    mine.keep("north", "low", (3, 4))
    mine.keep("south", "low", (7,))
    assert other.of("north") == {"low": (3, 4)} and other.of("south") == {"low": (7,)}
    other.keep("north", "low", ())
    assert mine.of("north") == {}


@pytest.mark.parametrize("text", ["", "{", "[]", '{"north": 3}', "\x00"])
def test_a_damaged_file_is_told_and_left_alone(tmp_path: Path, text: str) -> None:
    path = tmp_path / "groups.json"
    path.write_text(text)
    with pytest.raises(GroupsError, match="is damaged"):
        GroupFile(path).of("north")
    with pytest.raises(GroupsError):
        GroupFile(path).keep("north", "low", (1,))
    assert path.read_text() == text


def test_what_is_no_vehicle_is_none(tmp_path: Path) -> None:
    path = tmp_path / "groups.json"
    path.write_text('{"north": {"low": [4, "x", 3, null], "bad": 7}}')
    assert GroupFile(path).of("north") == {"low": (3, 4)}


def test_there_is_a_limit_and_a_disk_that_refuses(tmp_path: Path) -> None:
    full = GroupFile(tmp_path / "groups.json")
    for number in range(MAX_GROUPS):
        full.keep("north", f"g{number}", (1,))
    with pytest.raises(GroupsError, match="forgets one"):
        full.keep("north", "more", (1,))
    with pytest.raises(GroupsError, match="cannot be written"):
        GroupFile(tmp_path / "no" / "groups.json").keep("north", "low", (1,))
