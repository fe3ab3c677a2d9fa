"""Camera and gimbal orders where none showed: grey and why, left out by name, asked all the same by who means it.

A vehicle that tells of no camera may have one.
"""

import pytest

from tests.screens.rigs.console import NARROW, WIDE, Console, console
from tests.screens.rigs.fake_station import FakeStation
from tui_gcs.core.protocol import setup
from tui_gcs.core.protocol.common import Freshness
from tui_gcs.widgets.basics.palette import Ink

NONE = {"camera": False, "gimbal": False}


def bare(station: FakeStation) -> None:
    station.fly()
    station.changes = {3: NONE, 4: NONE, 5: {"camera": None, "gimbal": None}}


def ink_of(c: Console, words: str) -> Ink:
    (ink,) = {ink for line in c.app.screen.body() for text, ink in line if words in text}
    return Ink(ink)


def asked(c: Console) -> list[setup.AskPayloads]:
    return [request for request in c.station.requests if isinstance(request, setup.AskPayloads)]


@pytest.mark.parametrize(
    ("key", "name", "what"), [("f", "photo", "camera"), ("y", "video", "camera"), ("x", "gimbal", "gimbal")]
)
async def test_orders_for_what_never_showed_are_grey_and_say_why(key: str, name: str, what: str) -> None:
    async with console(NARROW, bare) as c:
        await c.press("3", "enter", "c")
        assert ink_of(c, f"{key}  {name:<12}") is Ink.MUTED
        assert f"(shows no {what})" in c.text()
        await c.press(key, "enter", "y")
        assert f"{name}: shows no {what}" in c.text() and c.station.commands() == []
        await c.press("escape", ":", *name)
        assert f"shows no {what}" in c.text(), "find says so, too"


async def test_unknown_capabilities_are_requested_when_the_menu_opens() -> None:
    async with console(NARROW, bare) as c:
        await c.press("s", *"2-5", "enter", "c")
        assert asked(c) == [setup.AskPayloads((3, 4, 5))], "2 showed both"
        await c.press("escape")
        await c.press("5", "enter", "c")
        assert len(asked(c)) == 1, "not again so soon"
        assert "(no camera known)" in c.text()
        c.station.changes[5] = {}
        await c.tick()
        await c.pilot.pause(0.3)
        assert ink_of(c, "f  photo") is Ink.BOLD
        c.clock.advance(11.0)
        c.station.changes[3] = NONE | {"freshness": Freshness.LOST}
        await c.tick()
        await c.press("escape")
        await c.press("3", "enter", "c")
        assert len(asked(c)) == 1, "who is lost is not asked"


async def test_of_several_those_without_one_are_left_out_by_name() -> None:
    async with console(WIDE, bare) as c:
        await c.press("s", *"2-5", "enter", "c", "f")
        assert "left out: 3-4  shows no camera" in c.text()
        assert "left out: 5  no camera known" in c.text()
        await c.press("enter")
        assert c.station.commands() == [setup.UseCamera((2,), "photo")]
        c.station.end_task(1, "done", "the camera reported the picture")
        c.app.results.follow()
        await c.settle()
        assert "photo 2: 1 of 4 good, left out 3-5" in c.result()


async def test_a_doubtful_order_is_asked_for_by_marking_it() -> None:
    """PX4 with a trigger pin tells of no camera before its first picture."""
    async with console(NARROW, bare) as c:
        await c.press("s", *"3-4", "enter", "c", "up")
        while "photo: shows no camera" not in c.app.screen.text():
            await c.press("down")
        assert "Enter asks for it all the same: take one picture" in " ".join(c.app.screen.text().split())
        await c.press("enter")
        assert "! 3-4 shows no camera: perhaps nothing happens" in c.text()
        await c.press("y")
        assert c.station.commands() == [setup.UseCamera((3, 4), "photo")]


async def test_different_reasons_are_shown_each_with_its_vehicles() -> None:
    async with console(NARROW, bare) as c:
        c.station.changes[2] = {"freshness": Freshness.LOST, "heard_age_s": 12.4, "age_s": 12.4}
        await c.tick()
        await c.press("s", *"2-5", "enter", "c", "f")
        words = " ".join(c.app.screen.text().split())
        assert "photo: 2 LOST; 3-4 shows no camera; 5 no camera known" in words
