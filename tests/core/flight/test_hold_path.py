"""The way of HOLD ALL from the bus to the frame is short: what is on it can fail or be slow."""

from collections.abc import Callable

import pytest

from tests.core.rigs.rig import Rig
from tests.rigs.call_chain import noting_callers
from tui_gcs.core.protocol import common as m
from tui_gcs.core.uplink.uplink import Uplink

MAX_FUNCTIONS = 18
"""From the question on the bus to the uplink's exit, as measured."""


def test_hold_all_leaves_through_few_functions(rig: Callable[..., Rig], monkeypatch: pytest.MonkeyPatch) -> None:
    sent: list[list[str]] = []
    flight = rig(3).flying().run(5.0)
    monkeypatch.setattr(Uplink, "_put", noting_callers(Uplink._put, sent))
    assert flight.ask(m.Hold()).ok
    ways = [names[names.index("BusHandlers._on_question") :] for names in sent if "Executive.hold" in names]
    assert len(ways) == 3 and all(len(way) <= MAX_FUNCTIONS for way in ways), ways
