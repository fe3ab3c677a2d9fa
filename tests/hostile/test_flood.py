"""50,000 junk datagrams a second on the port of a real station, with a real simulated vehicle on the same port."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.bench.flood import FLOWN, PER_S, flooding, simulated
from tests.bench.station import LiveStation, live_station
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.preflight import OVERRIDABLE

pytestmark = pytest.mark.process
SECONDS = 10


@pytest.fixture
def station(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[LiveStation]:
    monkeypatch.setenv("TUI_GCS_RUNTIME_DIR", str(tmp_path / "run"))
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(tmp_path / "state"))
    with live_station() as one:
        yield one


@pytest.mark.long
def test_a_vehicle_stays_live_and_commandable_in_a_flood(station: LiveStation, tmp_path: Path) -> None:
    """It is started in the midst of it, and held."""
    with simulated(station.port, tmp_path):
        station.until(lambda status: status.heard == 1, 20, "vehicle heard")
        station.until(lambda status: FLOWN not in status.not_ready, 60, "vehicle ready to start")
        first = len(station.status)
        with flooding(station.port) as process:
            assert station.ask(m.Start(vehicles=(FLOWN,), overrides=OVERRIDABLE, operator="bench")).ok
            station.until(lambda status: status.armed == 1, 8, "armed during the flood")
            assert station.ask(m.Hold(vehicles=(FLOWN,))).ok
            sent = int(process.communicate(timeout=30)[0])
        station.until(lambda status: status.links[0].datagrams > sent * 0.5, 5, "most of it was read")
    during = station.status[first:]
    assert sent > 0.5 * PER_S * SECONDS, "the flood was one"
    assert min(status.heard for status in during) == 1, "live all the time"
    assert not [event.text for event in station.events if "LOST" in event.text]
    assert during[-1].links[0].bad > 1_000_000, "junk is counted"
    assert [event for event in station.events if "frames not taken" in event.text], "and told"
