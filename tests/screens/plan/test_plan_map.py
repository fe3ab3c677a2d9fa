"""Zones changed on the plan screen's map, by keys and by pointer: the form follows, and what may not be is shown."""

import pytest
from textual.events import Key

from tests.screens.rigs.console import NARROW, WIDE
from tests.screens.rigs.pictures import same_as_snapshot
from tests.screens.rigs.plan_station import PlanConsole, plan_console
from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle

SIZES = pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
L_SHAPE = ((90.0, 130.0), (230.0, 130.0), (230.0, 190.0), (160.0, 190.0), (160.0, 280.0), (90.0, 280.0))


def corners(c: PlanConsole, name: str = "home") -> tuple[tuple[float, float], ...]:
    shape = c.map_zone(name)
    assert isinstance(shape, Polygon)
    return shape.vertices_m


async def test_a_corner_is_chosen_and_moved_and_the_form_shows_where_it_is() -> None:
    async with plan_console() as c:
        await c.press("3", "e", "n", "n", "right", "up", "up")
        assert corners(c)[1] == (235.0, 140.0)
        assert "235,140" in c.plan.zone_form.texts.vertices_m
        await c.press("N", "shift+left")
        assert corners(c)[0] == (40.0, 130.0)
        await c.press("N", "right")
        assert corners(c)[:2] == ((45.0, 130.0), (240.0, 140.0)), "behind the first one: all together"


async def test_what_is_typed_ahead_of_a_slow_console_is_for_the_corner() -> None:
    async with plan_console() as c:
        await c.press("3")
        for key in ("e", "n", "n", "right"):  # all of them before any is looked at
            c.app.post_message(Key(key, key if len(key) == 1 else None))
        await c.settle()
        assert corners(c) == (L_SHAPE[0], (235.0, 130.0), *L_SHAPE[2:])


async def test_corners_are_added_and_deleted() -> None:
    async with plan_console() as c:
        await c.press("3", "e", "n", "plus", "down")
        assert corners(c) == (L_SHAPE[0], (160.0, 125.0), *L_SHAPE[1:])
        await c.press("delete")
        assert corners(c) == L_SHAPE
        await c.press("ctrl+z")
        assert corners(c)[1] == (160.0, 125.0)
        await c.press("escape", "down", "e", "plus")
        assert len(corners(c, "field")) == 5, "a rectangle becomes a polygon"


async def test_a_circle_that_gets_corners_is_described() -> None:
    """It lost a tenth of its area, and nothing was said."""
    async with plan_console() as c:
        await c.press("e", "plus")
        assert len(corners(c)) == 33 and "the circle has 33 corners now, and is as large; u takes it back" in c.said()
        await c.press("plus")
        assert "circle" not in c.said()


async def test_arrows_size_a_rectangle_by_its_corner_and_a_circle_by_its_rim() -> None:
    async with plan_console() as c:
        await c.press("e", "n", "left")
        assert c.map_zone("home") == Circle((150.0, 200.0), 75.0)
        await c.press("escape", "down", "e", "n", "left", "down")
        assert c.map_zone("field") == Rectangle((447.5, 197.5), 165.0, 125.0)


async def test_what_may_not_be_is_shown_with_its_reason_and_can_be_moved_on_or_taken_back() -> None:
    async with plan_console() as c:
        await c.press("3", "e", "n", "n", "n", "n", "shift+down", "shift+down")
        assert corners(c)[3] == (160.0, 140.0), "where it was allowed last"
        assert "the border crosses itself near" in c.verdict()
        assert c.plan.draft.problems and "160,90" in c.plan.zone_form.texts.vertices_m
        await c.press("ctrl+g")
        assert "not applied: a value is not allowed" in c.said() and c.plan_station.applied() == []
        await c.press("shift+up", "up")
        assert corners(c)[3] == (160.0, 145.0) and "ok:" in c.verdict()
        await c.press("shift+down", "ctrl+z")
        assert corners(c)[3] == (160.0, 145.0) and not c.plan.draft.problems


async def test_a_zone_outside_the_area_is_reported_while_it_is_moved() -> None:
    async with plan_console() as c:
        await c.press("e", "shift+left", "shift+left")
        assert "reaches outside the operating area" in c.verdict()
        await c.press("shift+right")
        assert c.map_zone("home") == Circle((100.0, 200.0), 80.0)


@pytest.mark.long
async def test_snapping_draws_to_corners_edges_and_a_grid() -> None:
    async with plan_console() as c:
        await c.press("3", "down", "e", "S")
        assert "snapping" in str(c.plan.map_view.border_title)
        await c.type_into("east_m", "265")
        await c.type_into("north_m", "208.5")
        await c.press("escape", "e", "right")
        assert c.map_zone("field") == Rectangle((270.0, 210.0), 120.0, 160.0), "its corner on the edge of home"
        await c.press("up")
        assert c.map_zone("field") == Rectangle((270.0, 215.0), 120.0, 160.0), "and away again"
        await c.press("escape", "up", "e", "right_square_bracket", "n", "left")
        assert all(metres % 5.0 == 0.0 for metres in corners(c)[0]), "on the grid"
        assert any(metres % 5.0 != 0.0 for metres in corners(c)[1])


async def drag(c: PlanConsole, start_m: tuple[float, float], end_m: tuple[float, float], **modifiers: bool) -> None:
    view = c.plan.map_view
    (x0, y0), (x1, y1) = (view.view.world_to_cell(*place) for place in (start_m, end_m))
    await c.pilot.mouse_down(view, offset=(x0 + 1, y0 + 1), **modifiers)
    await c.pilot.hover(view, offset=((x0 + x1) // 2 + 1, (y0 + y1) // 2 + 1))
    await c.pilot.hover(view, offset=(x1 + 1, y1 + 1))
    await c.pilot.mouse_up(view, offset=(x1 + 1, y1 + 1))
    await c.settle()


@pytest.mark.long
async def test_a_click_chooses_a_zone_and_a_drag_moves_it_in_one_step() -> None:
    async with plan_console() as c:
        view = c.plan.map_view
        column, row = view.view.world_to_cell(450.0, 200.0) or (0, 0)
        await c.pilot.click(view, offset=(column + 1, row + 1))
        assert c.plan.draft.zone_name == "field"
        await drag(c, (450.0, 200.0), (400.0, 230.0))
        shape = c.map_zone("field")
        assert isinstance(shape, Rectangle) and (shape.width_m, shape.height_m) == (160.0, 120.0)
        assert abs(shape.centre_m[0] - 400.0) < 10.0 and abs(shape.centre_m[1] - 230.0) < 15.0
        await c.press("u")
        assert c.map_zone("field") == Rectangle((450.0, 200.0), 160.0, 120.0)


async def test_a_drag_of_a_corner_moves_it_and_with_ctrl_it_turns() -> None:
    async with plan_console() as c:
        await c.press("3")
        await drag(c, L_SHAPE[5], (60.0, 260.0))
        assert corners(c)[:5] == L_SHAPE[:5] and abs(corners(c)[5][0] - 60.0) < 10.0
        await c.press("down")
        await drag(c, (460.0, 240.0), (500.0, 200.0), control=True)
        shape = c.map_zone("field")
        assert isinstance(shape, Rectangle) and abs(shape.heading_deg - 90.0) < 20.0


async def test_a_double_click_adds_a_corner() -> None:
    async with plan_console() as c:
        await c.press("3")
        view = c.plan.map_view
        column, row = view.view.world_to_cell(160.0, 160.0) or (0, 0)
        await c.pilot.click(view, offset=(column + 1, row + 1), times=2)
        await c.settle()
        assert len(corners(c)) == 7


@pytest.mark.long
@SIZES
async def test_pictures(size: tuple[int, int]) -> None:
    async with plan_console(size) as c:
        await c.press("3", "e", "n", "n", "n", "n")
        assert same_as_snapshot(f"plan-corner-{size[0]}x{size[1]}", c.text())
        await c.press("shift+down", "shift+down")
        assert same_as_snapshot(f"plan-crossing-{size[0]}x{size[1]}", c.text())
