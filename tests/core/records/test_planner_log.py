"""The planner log on disk: lines with their source, pieces in both directions, a full file."""

from pathlib import Path

import pytest

from tui_gcs.core.protocol.planner_log import PLANNER_LOG_END, PlannerLogLevel, PlannerLogPiece
from tui_gcs.core.records import planner_log
from tui_gcs.core.records.planner_log import PlannerLog, log_files

WALL_S = 1_790_000_000.25


def log_with(path: Path, count: int, first: int = 0) -> PlannerLog:
    log = PlannerLog(path, lambda: WALL_S)
    for number in range(first, first + count):
        log.write("red", "patrol", PlannerLogLevel.STDOUT, f"line {number}")
    return log


def texts(piece: PlannerLogPiece) -> list[str]:
    return [line.text for line in piece.lines]


def test_a_line_on_disk_can_be_read_by_people_and_by_cut(tmp_path: Path) -> None:
    log = PlannerLog(tmp_path / "log", lambda: WALL_S)
    log.write("red", "patrol", PlannerLogLevel.WARNING, "wind\tof 12 m/s\n\x1b]52;c;eA==\x07")
    log.flush()
    want = "2026-09-21T14:13:20.250Z\tred\tpatrol\twarning\twind␉of 12 m/s␊␛]52;c;eA==␇\n"
    assert (tmp_path / "log").read_text() == want
    assert log.before(PLANNER_LOG_END).lines[0].wall_s == WALL_S


def test_pieces_follow_each_other_in_both_directions(tmp_path: Path) -> None:
    log = log_with(tmp_path / "log", 50)
    newest = log.before(PLANNER_LOG_END, 500)
    assert texts(newest)[-1] == "line 49" and not newest.is_oldest
    found, piece = texts(newest), newest
    while not piece.is_oldest:
        piece = log.before(piece.begin, 500)
        found = texts(piece) + found
    assert found == [f"line {number}" for number in range(50)]
    assert texts(log.after(newest.end)) == []
    log.write("blue", "patrol", PlannerLogLevel.STDERR, "new")
    assert texts(log.after(newest.end)) == ["new"]
    at, forward = 0, []
    while texts(piece := log.after(at, 500)):
        forward += texts(piece)
        at = piece.end
    assert forward == [*found, "new"]


def test_a_full_file_is_kept_beside_the_next_one_and_places_stay_valid(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(planner_log, "MAX_FILE_BYTES", 1000)
    path, earlier = log_files(tmp_path / "run.tlog")
    log = log_with(path, 15)
    place = log.before(PLANNER_LOG_END).end
    for number in range(15, 100):
        log.write("red", "patrol", PlannerLogLevel.STDOUT, f"line {number}")
        if number == 30:
            assert texts(log.after(place))[0] == "line 15"
    log.flush()
    assert {file.name for file in tmp_path.iterdir()} == {path.name, earlier.name}
    assert path.stat().st_size <= 1000 and earlier.stat().st_size <= 1000
    whole = log.before(PLANNER_LOG_END)
    assert whole.is_oldest and texts(whole)[-1] == "line 99" and len(whole.lines) > 20
    assert texts(log.after(place)) == texts(whole), "what was there is gone: the oldest that is kept comes instead"


def test_a_restarted_station_goes_on_in_the_same_file(tmp_path: Path) -> None:
    log_with(tmp_path / "log", 3).close()
    log = log_with(tmp_path / "log", 2, first=3)
    assert texts(log.before(PLANNER_LOG_END)) == [f"line {number}" for number in range(5)]


@pytest.mark.parametrize("place", [-7, 3, 10**12])
def test_a_place_of_another_start_leads_to_no_error(tmp_path: Path, place: int) -> None:
    log = log_with(tmp_path / "log", 3)
    assert set(texts(log.after(place)) + texts(log.before(place))) <= {"line 0", "line 1", "line 2"}


def test_what_is_no_line_of_this_version_is_left_out_and_hostile_text_is_cleaned(tmp_path: Path) -> None:
    lines = b"words of an older version\n2026-09-21T14:13:20Z\tr\x1b[2Jed\tp\tstdout\t\xff\x9b31m\n2026-09-21T14\tcut"
    (tmp_path / "log").write_bytes(lines)
    (line,) = PlannerLog(tmp_path / "log", lambda: WALL_S).before(PLANNER_LOG_END).lines
    assert (line.team, line.text) == ("r␛[2Jed", "\ufffd\ufffd31m")


def test_a_disk_that_cannot_be_written_stops_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    log = log_with(tmp_path / "file" / "log", 3)
    assert texts(log.before(PLANNER_LOG_END)) == []
