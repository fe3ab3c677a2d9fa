"""The supervisor goes on where the system has no process for a station."""

import errno
import os
import subprocess
from pathlib import Path

import pytest

from tui_gcs.client import launcher


class Ended:
    """A station that has been ended by an operator."""

    def wait(self) -> int:
        return 0


def test_a_station_is_started_again_until_there_is_a_process_for_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    tries = 2 * launcher.MAX_RESTARTS
    waits_s: list[float] = []

    def popen(*_: object, **__: object) -> Ended:
        if len(waits_s) < tries:
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
        return Ended()

    monkeypatch.setattr(subprocess, "Popen", popen)
    monkeypatch.setattr(launcher, "adopt_orphans", lambda: False)
    monkeypatch.setattr("signal.signal", lambda *_: None)
    monkeypatch.setattr("time.sleep", waits_s.append)
    assert launcher._keep_station(tmp_path, 0) == 0
    assert waits_s == [launcher.NO_PROCESS_S] * tries
    assert not (tmp_path / "error").exists()
    assert caplog.text.count("the station is not started: ") == tries
