"""Limits of what a screen costs, and a key whose cost is measured."""

import time

from textual.events import Key

from tests.screens.rigs.meter import Meter

LIMIT_KB_S, LIMIT_CPU_PCT, LIMIT_KEY_MS = 8.0, 12.0, 50.0
MEASURED_S, KEYS = 10, 40


async def press(meter: Meter, key: str) -> float:
    """Press a key; return the CPU seconds until its picture is painted."""
    character = key if len(key) == 1 else None
    began_s = time.process_time()
    meter.app.post_message(Key(key, character))
    await settled(meter)
    return time.process_time() - began_s


async def settled(meter: Meter) -> None:
    """All that was begun is answered and painted."""
    await meter.painted()
    await meter.app.workers.wait_for_complete()
    await meter.painted()
