"""The top line says how many could be started, and how many are armed once something was."""

import msgspec

from tests.screens.rigs.fake_station import FakeStation
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.widgets.basics.glyphs import UNICODE
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.status_line import status_runs
from tui_gcs.widgets.basics.strips import Run


def runs_of(run: m.RunPhase, not_ready: dict[int, str]) -> list[Run]:
    status = msgspec.structs.replace(FakeStation(MemoryBus(), run=run).status(), not_ready=not_ready)
    return status_runs(status, 80, 0.0, "console-test", UNICODE)


def test_before_a_start_it_tells_how_many_could_be_started() -> None:
    assert ("ready 8/8", Ink.TEXT) in runs_of(m.RunPhase.IDLE, {})
    assert ("ready 6/8", Ink.CAUTION) in runs_of(m.RunPhase.IDLE, {3: "no position", 5: "EKF"})


def test_once_something_was_started_it_tells_how_many_are_armed() -> None:
    words = [text for text, _ in runs_of(m.RunPhase.RUNNING, {3: "already in the air"})]
    assert "armed 8" in words
    assert not any(word.startswith("ready") for word in words)
