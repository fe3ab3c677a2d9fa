"""The processes of previews: a worker that flies a team goes on, whatever becomes of them."""

import tempfile
from pathlib import Path

import pytest

from tui_gcs.core.protocol.common import PreviewTask
from tui_gcs.planner.runtime.kinematic_fleet import task_for
from tui_gcs.planner.runtime.preview import PreviewProcesses


def test_without_room_for_its_files_a_preview_fails_and_the_worker_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    processes = PreviewProcesses({})
    with monkeypatch.context() as full:
        full.setattr(tempfile, "tempdir", str(tmp_path / "gone"))
        processes.begin(PreviewTask(7, task_for((1, 2), "patrol"), None), 0.0)
    (result,) = processes.poll(0.0)
    assert (result.number, result.state, result.text) == (7, "failed", "cannot be begun: No such file or directory")
    assert processes.poll(1.0) == []
