"""A rehearsal from its start on the screen to its result, flown by its own process."""

import time
from pathlib import Path

import pytest

from tests.screens.rehearsals.test_rehearsals_screen import look, panel, screen
from tests.screens.rigs.console import Console, console
from tests.screens.rigs.fake_station import FakeStation
from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.scenario.load import parse
from tui_gcs.core.scenario.template import new_scenario

pytestmark = [pytest.mark.process, pytest.mark.long]
LIMIT_S = 300.0


async def looked_until(c: Console, words: str, limit_s: float) -> None:
    """The flight is in another process: its words on the screen are waited for."""
    until = time.monotonic() + limit_s
    while words not in c.text():
        assert time.monotonic() < until, f"{words!r} is not shown:\n{c.text()}"
        time.sleep(0.2)
        await look(c)


async def test_it_is_started_watched_and_its_gates_and_report_are_looked_at(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(tmp_path))
    # Other tests leave nothing to a process of lowest priority.
    monkeypatch.setattr("tui_gcs.client.rehearsal_job.LOWEST_PRIORITY", 0)
    toml = new_scenario("field", Origin(52.072, -0.628, 110.0), 2).replace("duration_s = 300.0", "duration_s = 60.0")

    def loaded(station: FakeStation) -> None:
        station.toml, station.scenario, station.count = toml, parse(toml, "field.toml"), 2

    async with console((80, 24), loaded, recordings={"SIM": tmp_path / "sim"}) as c:
        await c.press("S", "r")
        await look(c)
        await c.press("R", *"--gps-noise 0.3", "enter")
        assert "started with --gps-noise=0.3" in panel(c)
        await looked_until(c, "round 1  T+", LIMIT_S)
        assert "under way: field --gps-noise=0.3 round 1 T+" in panel(c) and "UNDER WAY" in c.text()
        await looked_until(c, "it has ended: passed", LIMIT_S)
        await c.settle()
        assert "GPS noise 0.3 m" in panel(c) and "exactly this plan would fly" in panel(c)
        report = screen(c).rehearsal_list.chosen_row.record.report
        assert report.endswith("report.html") and Path(report).stat().st_size > 10_000
        await c.press("y")
        assert report in "".join(screen(c).panel.text().split()) and "clipboard" in panel(c)
        await c.press("enter")
        assert "round 1 zone 1: coverage" in c.text() and "separation, x limit" in c.text()
