"""One vehicle's plans are given to others by `V`; numbers take no letters on the missions screen."""

from tests.screens.rigs.mission_station import MissionConsole, mission_console
from tui_gcs.core.plans.model import PlanKind


def planned(c: MissionConsole, vehicle: int) -> tuple[int, ...]:
    """How many items of each kind."""
    draft = c.missions.editor.history.draft.of(vehicle)
    return tuple(len(draft.items(kind)) for kind in PlanKind)


async def test_v_copies_mission_fence_and_rally_points_and_u_takes_it_back() -> None:
    async with mission_console() as c:
        await c.press("V")
        assert "nothing is planned for vehicle 1" in c.said()
        await c.press("plus", "t", "plus", "t", "plus", "V")
        assert "Copy mission, fence, rally of 1 to" in c.text()
        await c.press("2", "minus", "3", "enter")
        assert "mission, fence, rally of 1 copied to 2-3, each on its layer" in c.said()
        assert planned(c, 1) == planned(c, 2) == planned(c, 3) == (2, 1, 1) and planned(c, 4) == (0, 0, 0)
        draft = c.missions.editor.history.draft
        heights = [(draft.of(v).mission[1].z, draft.of(v).rally[0].z) for v in (1, 2, 3)]
        assert heights == [(27.0, 27.0), (34.0, 34.0), (41.0, 41.0)], "each on its layer"
        await c.press("u")
        assert planned(c, 2) == (0, 0, 0)


async def test_v_copies_one_kind_to_all_and_refuses_an_empty_list() -> None:
    async with mission_console((80, 24)) as c:
        await c.press("plus", "t", "plus", "V", *"all", "space", *"fence", "enter")
        assert [planned(c, v) for v in range(2, 9)] == [(0, 1, 0)] * 7
        for typed, why in (("9", "vehicle 9 is neither"), ("x", "'x' is no system id"), ("1", "which other")):
            await c.press("V", typed, "enter")
            assert "nothing copied" in c.said() and why in c.said()
        await c.press("V", "2", "escape")
        assert "nothing copied" in c.said() and c.app.focused is c.missions.item_table


async def test_a_letter_in_a_number_is_refused_and_reported() -> None:
    async with mission_console() as c:
        await c.press("plus")
        await c.type_into("height_m", "3o5")
        assert "numbers only" in c.said()
        item = c.missions.editor.item
        assert item is not None and item.z == 35.0
        await c.press("escape", "b")
        await c.type_into("speed_m_s", "q")
        assert "numbers only" in c.said() and c.app.is_running
