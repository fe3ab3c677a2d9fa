"""The way of HOLD ALL from the key to the bus is short: what is on it can fail or be slow."""

import pytest

from tests.rigs.call_chain import noting_callers
from tests.screens.rigs.console import console
from tests.screens.rigs.fake_station import FakeStation
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import MemoryBus

MAX_FUNCTIONS = 5
"""From the worker that sends the order to the bus, as measured; the key calls four before."""


async def test_hold_all_leaves_through_few_functions(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[list[str]] = []
    async with console(prepare=FakeStation.fly) as c:
        await c.press("!")
        monkeypatch.setattr(MemoryBus, "begin", noting_callers(MemoryBus.begin, asked))
        await c.press("h")
        assert c.station.commands() == [m.Hold()]
    ways = [functions for functions in asked if any(name.endswith("StopRequests.send") for name in functions)]
    assert len(ways) == 1 and len(ways[0]) <= MAX_FUNCTIONS, ways
