"""What planner workers leave behind."""

from pathlib import Path

from tui_gcs.core.workers import KEPT_LOG_BYTES, LOOK_GAP_S, MOST_LOG_BYTES, Workers


def test_a_planner_that_prints_without_end_does_not_fill_the_disk(tmp_path: Path) -> None:
    log = tmp_path / "run-planners.log"
    workers = Workers(tmp_path / "bus", log)
    workers.keep([], 0.0)
    log.write_bytes(b"first words\n")
    with log.open("ab") as worker:
        worker.write(b"x" * MOST_LOG_BYTES)
        worker.flush()
        workers.keep([], LOOK_GAP_S / 2)
        assert log.stat().st_size > MOST_LOG_BYTES, "not looked at yet"
        workers.keep([], LOOK_GAP_S)
        worker.write(b"last words\n")
    text = log.read_bytes()
    assert len(text) < KEPT_LOG_BYTES + 100
    assert text.startswith(b"first words\n") and text.endswith(
        b"--- planners print too much: what came here is not kept ---\nlast words\n"
    )
