"""Sensed targets on the map: where, how sure, how old."""

import msgspec

from tests.widgets.map.test_map import AREA, MapApp, picture
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol.common import FleetFrame, Track
from tui_gcs.core.scenario.model import Round
from tui_gcs.widgets.basics.glyphs import ASCII, UNICODE
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_tracks import ink_of
from tui_gcs.widgets.map.map_view import MapView

TARGET = Track(3, (150.0, 200.0, 40.0), (5.0, 0.0, 0.0), (4.0, 0.0, 4.0), 10.0, 20.0, (2, 5), confirmed=True)


def frame(now_s: float, *tracks: Track) -> FleetFrame:
    return FleetFrame(1, now_s, 0.0, RunKind.SIM, tracks=tracks)


async def shown(frames: list[FleetFrame], *, ascii_only: bool = False) -> list[str]:
    """The map's text after each frame."""
    app = MapApp(MapView(glyphs=ASCII if ascii_only else UNICODE))
    pictures = []
    async with app.run_test(size=(80, 24)) as pilot:
        app.map_view.set_scenario(Round(name="r", duration_s=60.0, area=AREA, zones=()))
        for one in frames:
            app.map_view.set_fleet(one, {})
            await pilot.pause()
            pictures.append(picture(app))
    return pictures


async def test_a_target_has_its_number_and_moves_on_while_not_detected() -> None:
    first, later = await shown([frame(20.0, TARGET), frame(40.0, TARGET)])
    (row,) = (line for line in first.splitlines() if "@3" in line)
    (row_later,) = (line for line in later.splitlines() if "@3" in line)
    assert row_later.index("@3") > row.index("@3") + 5, "100 m east of it"


async def test_a_doubtful_one_is_a_question_and_gone_when_it_is_gone() -> None:
    doubtful = msgspec.structs.replace(TARGET, confirmed=False)
    first, later = await shown([frame(20.0, doubtful), frame(21.0)])
    assert "?" in first
    assert "@" not in first
    assert "?" not in later


async def test_without_braille_it_is_drawn_too() -> None:
    (text,) = await shown([frame(30.0, TARGET)], ascii_only=True)
    assert "@3" in text
    assert "o" in text.replace("operating", ""), "its circle"


def test_grey_when_it_was_not_seen_for_a_while() -> None:
    assert ink_of(TARGET, 21.0) is Ink.TARGET
    assert ink_of(TARGET, 24.0) is Ink.MUTED
