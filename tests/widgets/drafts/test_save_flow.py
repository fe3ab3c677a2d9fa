"""Saving: nobody's file is lost, and a file is either the old one or the new one."""

from pathlib import Path

import pytest

import tui_gcs
from tui_gcs.core.geometry.zones import Circle, Role, Zone
from tui_gcs.core.protocol.common import ScenarioChanged
from tui_gcs.core.scenario.load import parse, read_text
from tui_gcs.widgets.drafts.file_writer import SaveError, destination, write
from tui_gcs.widgets.drafts.save_flow import SaveFlow, SaveNext
from tui_gcs.widgets.plan.scenario_editor import ScenarioEditor
from tui_gcs.widgets.plan.scenario_edits import ZoneEdits

SHIPPED = Path(tui_gcs.__file__).parent / "scenarios" / "swarm-challenge.toml"
TEXT = read_text(SHIPPED)


def edited(path: str) -> ScenarioEditor:
    model = ScenarioEditor()
    model.station_changed(ScenarioChanged(revision=1, path=path, toml=TEXT, scenario=parse(TEXT)))
    ZoneEdits(model).set_zone("home", Zone("home", Role.DEFEND, Circle((150.0, 200.0), 60.0)))
    return model


def test_own_file_is_replaced_at_once(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(TEXT)
    path.chmod(0o640)
    model = edited(str(path))
    assert model.unsaved
    assert SaveFlow(model).save().what is SaveNext.DONE
    assert path.read_text() == model.text
    assert path.stat().st_mode & 0o777 == 0o640
    assert not model.unsaved
    assert list(tmp_path.iterdir()) == [path]


def test_own_file_that_was_changed_elsewhere_is_asked_about(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(TEXT + "# a note\n")
    flow = SaveFlow(edited(str(path)))
    step = flow.save()
    assert step.what is SaveNext.CONFIRM
    assert "changed by someone else" in step.text
    flow.forget()
    assert flow.save().what is SaveNext.CONFIRM
    assert path.read_text().endswith("# a note\n")
    assert flow.save().what is SaveNext.DONE


@pytest.mark.parametrize(
    ("path", "why"),
    [
        (str(SHIPPED), "the shipped scenario stays as it is"),
        ("", "has no file yet"),
        ("mine.toml", "no full path"),
        ("/nowhere/mine.toml", "not there any more"),
    ],
)
def test_file_that_is_not_the_operators_leads_to_a_question(path: str, why: str) -> None:
    step = SaveFlow(edited(path)).save()
    assert step.what is SaveNext.ASK_PATH
    assert why in step.text
    assert step.suggestion.endswith(".toml")
    assert read_text(SHIPPED) == TEXT


def test_link_into_the_package_is_the_package(tmp_path: Path) -> None:
    link = tmp_path / "link.toml"
    link.symlink_to(SHIPPED)
    assert SaveFlow(edited(str(link))).save().what is SaveNext.ASK_PATH
    assert SaveFlow(edited("")).save_as(str(link)).what is SaveNext.FAILED
    assert read_text(SHIPPED) == TEXT


def test_new_path_is_written_and_is_the_file_from_then_on(tmp_path: Path) -> None:
    model = edited(str(SHIPPED))
    path = tmp_path / "new.toml"
    assert SaveFlow(model).save_as(f" {path} ").what is SaveNext.DONE
    assert path.read_text() == model.text
    assert SaveFlow(model).save().what is SaveNext.DONE


def test_other_existing_file_needs_the_same_answer_twice(tmp_path: Path) -> None:
    path, another = tmp_path / "theirs.toml", tmp_path / "other.toml"
    path.write_text("theirs")
    another.write_text("other")
    flow = SaveFlow(edited(str(SHIPPED)))
    assert flow.save_as(str(path)).what is SaveNext.CONFIRM
    assert flow.save_as(str(another)).what is SaveNext.CONFIRM
    assert flow.save_as(str(path)).what is SaveNext.CONFIRM
    assert (path.read_text(), another.read_text()) == ("theirs", "other")
    assert flow.save_as(str(path)).what is SaveNext.DONE


@pytest.mark.parametrize("typed", ["", "  ", "a\0b", "/nowhere/at/all.toml", "/", "~nobody-by-this-name/x.toml"])
def test_path_that_cannot_be_is_one_line(typed: str) -> None:
    with pytest.raises(SaveError) as error:
        destination(typed)
    assert "\n" not in str(error.value)


def test_link_stays_a_link(tmp_path: Path) -> None:
    real, link = tmp_path / "real.toml", tmp_path / "link.toml"
    real.write_text("old")
    link.symlink_to(real)
    write(link, "new")
    assert link.is_symlink()
    assert real.read_text() == "new"


def test_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("old")

    def full(_file: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(SaveError, match="No space left"):
        write(path, "new")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
