"""Text of a vehicle, up to the terminal (B.6-75…87): every byte in every text field, on every screen."""

import asyncio
import re
from pathlib import Path

from rich.color import ColorSystem

from tests.core.rigs.rig import Rig, scenario, toml
from tests.hostile.oracle import Watched
from tests.hostile.test_framing import raw_frame
from tests.hostile.test_text import TEXTS, WICKED, field_of, is_safe
from tests.screens.rigs.meter import MeteredConsole
from tui_gcs.core.mavlink import dialect

OURS = re.compile(r"\x1b\[(?:\d+(?:;\d+)*)?[HCm]")
"""What a painter writes beside characters: move, step right, pen."""
SCREENS = ("f", "n", "v", "tab", "J", "A", "escape", "f", "question_mark", "escape", "c", "escape")
BELL = "\x07"
SECONDS_EACH = 0.2


def told(msgid: int, name: str, data: bytes) -> bytes:
    """A frame of vehicle 1 that has `data` in this field, and something in the others."""
    layout = dialect.layout(msgid)
    assert layout is not None
    values: list[object] = []
    for field in layout.fields:
        values += [data if field.name == name else b"x"] if field.is_text else [1] * field.count
    return raw_frame(msgid, layout.pack(*values))


def wicked_frames() -> list[bytes]:
    """Every control byte in every text field of every message; all bytes and the wicked ones as status texts."""
    controls = bytes((*range(1, 32), *range(127, 160)))
    frames = []
    for msgid, name in TEXTS:
        length = max(1, field_of(msgid, name).length)
        frames.append(told(msgid, name, controls[:length]))
    texts = [bytes(range(start, min(256, start + 50))) for start in range(1, 256, 50)] + list(WICKED.values())
    return [*frames, *(told(253, "text", b"#" + text[:49]) for text in texts)]


async def shown(rig: Rig, frames: list[bytes]) -> str:
    """All that the console writes while vehicle 1 says these, on each of its screens."""
    written: list[str] = []
    app = MeteredConsole(rig.bus, "console-test", clock=rig.clock)
    app.console._color_system = ColorSystem.TRUECOLOR
    async with app.run_test(size=(120, 40)) as pilot:
        assert app._driver is not None
        app._driver.write = written.append  # type: ignore[method-assign]
        app.redraw()
        for at in range(0, len(frames), 100):
            rig.link.inject(b"".join(frames[at : at + 100]), ("sim", 0))
            rig.run(SECONDS_EACH)
            await app.feed.idle()
            app.feed.deliver()
            await pilot.press(SCREENS[at // 100 % len(SCREENS)])
        for key in SCREENS:
            await pilot.press(key)
            rig.run(SECONDS_EACH)
            await app.feed.idle()
            app.feed.deliver()
            await pilot.pause()
    return "".join(written)


def test_b6_75_no_byte_of_a_vehicle_reaches_the_terminal_raw(tmp_path: Path) -> None:
    rig = Watched(scenario(2), toml(), tmp_path)
    rig.ready()
    begun_s = rig.clock.now()
    written = asyncio.run(shown(rig, wicked_frames()))
    rest = OURS.sub("", written)
    assert rest.count(BELL) <= 1 + (rig.clock.now() - begun_s) / 2, "only our own bell, and not too often"
    bad = {char for char in rest.replace(BELL, "") if not is_safe(char)}
    assert bad == set()
    assert "#" in rest and "\u241b" in rest, "it was shown: the picture of an escape"
