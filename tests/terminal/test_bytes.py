"""Bytes to the terminal are exact in lock-step: limits of issue 6 at 120x40, five pictures a second."""

import pytest
from rich.color import ColorSystem

from tests.screens.rigs.meter import metered

FLOWN_S = 3.0


@pytest.mark.parametrize(
    ("count", "colours", "limit_kb_s"),
    [
        (8, ColorSystem.TRUECOLOR, 3.0),
        (50, ColorSystem.STANDARD, 8.0),
        (50, ColorSystem.TRUECOLOR, 14.0),
    ],
)
async def test_bytes_in_flight(count: int, colours: ColorSystem, limit_kb_s: float) -> None:
    async with metered(count, colours) as meter:
        written, _ = await meter.fly(FLOWN_S)
    assert 0.2 < written / FLOWN_S / 1000 < limit_kb_s, "a console that writes nothing would be cheap, too"


async def test_a_fleet_that_stands_still_writes_only_its_clock() -> None:
    async with metered(8, ColorSystem.TRUECOLOR) as meter:
        meter.station.publish_fleet(0.0)
        meter.app.feed.deliver()
        meter.app.screen.show_all()
        await meter.painted()
        before = len(meter.written)
        meter.app.screen.show_all()
        await meter.painted()
        assert "".join(meter.written[before:]).replace("\x1b[1;1H", "") == ""
