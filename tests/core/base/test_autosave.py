"""Work in progress is there after a crash, and two programs never write into the same file."""

from pathlib import Path

import pytest

from tui_gcs.core.base import autosave
from tui_gcs.core.base.autosave import Autosave
from tui_gcs.core.base.safe_files import FileRefused


def test_work_is_there_for_the_next_one_until_it_is_forgotten(tmp_path: Path) -> None:
    first = Autosave(tmp_path / "sim", "zones")
    assert first.read(100) is None
    first.write(b"work")
    first.close()  # as the kernel does for one that is killed
    second = Autosave(tmp_path / "sim", "zones")
    assert second.read(100) == b"work"
    second.forget()
    assert second.read(100) is None


def test_two_at_once_have_a_file_each_and_who_comes_later_hears_of_both(tmp_path: Path) -> None:
    one, two = Autosave(tmp_path, "zones"), Autosave(tmp_path, "zones")
    one.write(b"of one")
    two.write(b"of two")
    assert (one.read(100), two.read(100)) == (b"of one", b"of two")
    one.close()
    two.close()
    heir = Autosave(tmp_path, "zones")
    assert heir.read(100) == b"of one", "the oldest first"
    assert [path.read_bytes() for path in heir.waiting] == [b"of two"]
    assert Autosave(tmp_path, "zones").read(100) == b"of two"
    assert Autosave(tmp_path, "missions").read(100) is None, "another kind of work"


def test_work_that_makes_no_sense_is_set_aside_and_not_written_over(tmp_path: Path) -> None:
    mine = Autosave(tmp_path, "zones")
    mine.write(b"half of i")
    aside = mine.set_aside(b"half of i")
    mine.write(b"new")
    assert (aside.read_bytes(), mine.read(100)) == (b"half of i", b"new")


def test_no_file_is_left_or_none_can_be_locked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(autosave, "MAX_FILES", 1)
    held = Autosave(tmp_path, "zones")
    with pytest.raises(FileRefused, match="1 others hold"):
        Autosave(tmp_path, "zones")
    held.close()
    (tmp_path / "zones-autosave-1.json.lock").unlink()
    (tmp_path / "zones-autosave-1.json.lock").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(FileRefused):
        Autosave(tmp_path, "zones")
    assert not (tmp_path / "elsewhere").exists()
