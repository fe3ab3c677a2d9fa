"""Any keys on a terminal of any size: the console stays, and asks nothing of a vehicle that nobody named."""

import os
import random
from contextlib import suppress
from typing import Any

import pytest
from textual.worker import WorkerCancelled

from tests.screens.rigs.console import Console, console
from tests.screens.rigs.fake_station import SCENES
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.flight import Land
from tui_gcs.widgets.basics.glyphs import ASCII, UNICODE

PRINTABLE = [
    *"abcdefghijklmnoprstuvwxyzABCDEFGHIJKLMNOPRSTUVWXYZ0123456789",
    "full_stop",
    "comma",
    "colon",
    "semicolon",
]
SIGNS = ["plus", "minus", "slash", "question_mark", "exclamation_mark", "asterisk", "number_sign", "less_than_sign"]
MOVES = ["up", "down", "left", "right", "pageup", "pagedown", "home", "end", "tab", "shift+tab", "backspace", "delete"]
CHORDS = ["ctrl+a", "ctrl+e", "ctrl+f", "ctrl+g", "ctrl+l", "ctrl+n", "ctrl+o", "ctrl+r", "ctrl+u", "ctrl+y", "ctrl+z"]
FUNCTIONS = [f"f{number}" for number in range(1, 11)]
KEYS = [*PRINTABLE, *SIGNS, *MOVES * 2, *CHORDS, *FUNCTIONS * 2, *["enter"] * 12, *["escape"] * 8, *["space"] * 4]
SIZES = [(80, 24), (120, 40), (200, 60), (79, 24), (80, 23), (40, 10), (20, 5), (9, 3), (1, 1)]
TEXTS = [" " * 50, "]" * 50, "[bold]x[/]", "漢字" * 20, "é" * 40, "{0}%s\\n", "a" * 200, ""]


@pytest.mark.parametrize("seed", range(2))
async def test_no_key_at_any_size_ends_the_console(seed: int) -> None:
    await any_keys(seed, 60)


MANY_SEEDS = [
    *(pytest.param(seed, marks=pytest.mark.long) for seed in (100, 101)),
    *(
        pytest.param(seed, marks=pytest.mark.endurance)
        for seed in range(102, 100 + int(os.environ.get("ANY_KEYS", "12")))
    ),
]


@pytest.mark.parametrize("seed", MANY_SEEDS)
async def test_no_key_of_many_ends_the_console(seed: int) -> None:
    await any_keys(seed, 400)


async def any_keys(seed: int, count: int) -> None:
    """So many keys; an exception in the console comes out of its context."""
    rng, pressed = random.Random(seed), list[object]()
    try:
        size, scene, glyphs = rng.choice(SIZES[:3]), rng.choice(list(SCENES.values())), rng.choice([UNICODE, ASCII])
        kind, replay, read_only = rng.choice([RunKind.SIM, RunKind.LIVE]), rng.random() < 0.1, rng.random() < 0.1
        async with console(size, scene, kind=kind, glyphs=glyphs, replay=replay, read_only=read_only) as c:
            for _ in range(count):
                if rng.random() < 0.04:
                    pressed.append(rng.choice(SIZES))
                    await c.pilot.resize_terminal(*pressed[-1])
                if rng.random() < 0.1:
                    c.station.event(
                        rng.choice(TEXTS), source=f"vehicle {rng.randint(1, 8)}", severity=rng.randint(0, 7)
                    )
                pressed.append(rng.choice(KEYS))
                await c.pilot.press(str(pressed[-1]))
                if rng.random() < 0.5:
                    with suppress(WorkerCancelled):  # its screen was closed
                        await c.tick(rng.choice([0.1, 0.1, 1.0, 11.0]))
                assert c.app.is_running
            asked_of_somebody(c)
            assert not (replay or read_only) or not c.station.commands()
    except Exception as error:
        error.add_note(f"after {pressed[-40:]}")
        raise


def asked_of_somebody(c: Console) -> None:
    """Every order names vehicles of the fleet, each once."""
    fleet = set(range(1, c.station.count + 1))
    for asked in c.station.commands():
        named: Any = getattr(asked, "vehicles", None)
        if named is not None:
            assert set(named) <= fleet and len(set(named)) == len(named), asked
            assert named or isinstance(asked, m.Hold | m.Return | m.Resume | Land), asked  # there nobody is everybody
