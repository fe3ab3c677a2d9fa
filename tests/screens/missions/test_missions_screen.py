"""The missions screen: plans for every vehicle by keys, what they come to, and their way to vehicles and back."""

from pathlib import Path

import pytest

from tests.screens.rigs.console import NARROW, WIDE, console
from tests.screens.rigs.mission_station import MissionStation, mission_console
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.core.firmware.plan_dialects import ARDUPILOT
from tui_gcs.core.missions import fences
from tui_gcs.core.missions import mission_builder as build
from tui_gcs.core.missions.draft import MissionDraft
from tui_gcs.core.missions.performance import Performance
from tui_gcs.core.plans.model import LAND, RETURN, TAKE_OFF, WAYPOINT, Plan, PlanKind
from tui_gcs.core.protocol.common import Resume, RunPhase
from tui_gcs.core.protocol.services import CompareMission, OnBoardRow
from tui_gcs.core.requests.plan_rows import plan_rows
from tui_gcs.feed import task_requests
from tui_gcs.screens.missions import missions_screen as missions
from tui_gcs.screens.missions.upload_dialog import UploadComparison, UploadDialog
from tui_gcs.widgets.basics.glyphs import ASCII
from tui_gcs.widgets.missions.mission_map import drawings

SIZES = pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])


@pytest.fixture(autouse=True)
def _no_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(task_requests, "LOOK_S", 0.0)


async def test_p_and_m_lead_here() -> None:
    async with console() as c:
        await c.press("p", "m")
        assert isinstance(c.app.screen, missions.MissionsScreen)


# ---------------------------------------------------------------- what it looks like


@SIZES
async def test_pictures(size: tuple[int, int]) -> None:
    states = {
        "empty": (),
        "mission": ("plus", "plus", "plus"),
        "generate": ("g",),
        "survey": ("ctrl+g",),
        "fence": ("t", "plus"),
    }
    async with mission_console(size) as c:
        for name, keys in states.items():
            await c.press(*keys)
            await c.compared()
            assert same_as_snapshot(f"missions-{name}-{size[0]}x{size[1]}", c.text()), name


async def test_ascii_picture_has_only_ascii() -> None:
    async with mission_console(NARROW, glyphs=ASCII) as c:
        await c.press("plus", "plus", "g")
        assert c.text().isascii()


# ---------------------------------------------------------------- editing


async def test_a_mission_is_drawn_by_keys_and_every_key_taken_back() -> None:
    async with mission_console() as c:
        await c.press("plus", "plus", "e", "right", "right", "escape", "delete", "plus", "left_square_bracket")
        drawn = c.missions.editor.history.draft
        assert c.commands() == [TAKE_OFF, WAYPOINT, WAYPOINT]
        for _ in range(9):
            await c.press("u")
        assert c.missions.editor.history.draft == MissionDraft()
        assert "nothing to undo" in c.said()
        for _ in range(9):
            await c.press("ctrl+y")
        assert c.missions.editor.history.draft == drawn


@pytest.mark.long
async def test_fields_say_where_how_high_and_what_and_one_field_is_one_step_to_undo() -> None:
    async with mission_console() as c:
        await c.press("plus")
        await c.type_into("east_m", "120")
        await c.type_into("north_m", "80")
        await c.type_into("height_m", "45.5")
        await c.type_into("param1", "12")
        item = c.missions.editor.item
        assert item is not None
        assert c.missions.editor.place_m(item) == pytest.approx((120, 80), abs=0.02)
        assert (item.z, item.params[0]) == (45.5, 12.0)
        await c.type_into("height_m", "4-")
        assert "height: '4-' is not a number" in c.verdict()
        assert c.missions.editor.item == item, "what was half typed is not meant"
        await c.press("escape")
        assert "put back" in c.said()

        # news of the fleet do not touch what is being typed
        await c.type_into("height_m", "51.")
        c.station.changes[1] = {"battery_pct": 40.0}
        await c.tick(1.0)
        assert next(f for f in c.missions.query("FormField") if f.field == "height_m").value == "51."
        await c.press("escape", "u")

        # typing a number is one step to undo
        await c.press("plus")
        before = c.missions.editor.history.edits
        await c.type_into("height_m", "123")
        await c.press("escape")
        assert c.missions.editor.history.edits == before + 1
        await c.press("u")
        assert c.missions.editor.item.z != 123


async def test_commands_have_their_own_parameters_by_name() -> None:
    async with mission_console() as c:
        await c.press("plus", "tab", "right")
        assert c.missions.editor.item.command == TAKE_OFF
        await c.press("right", "right")
        assert c.missions.editor.item.command == RETURN
        assert "Height" not in c.text()
        await c.press("right")
        assert "Time" in c.text()


async def test_a_new_mission_climbs_to_the_own_layer_and_grows_before_its_return() -> None:
    async with mission_console() as c:
        await c.press("plus", "plus", "tab", "right", "right", "right", "escape")
        assert c.commands() == [TAKE_OFF, WAYPOINT, RETURN]
        await c.press("plus")
        assert c.commands() == [TAKE_OFF, WAYPOINT, WAYPOINT, RETURN]

        await c.press("5", "plus")
        layers = {place.vehicle: place.layer_m for place in c.plan_station.scenario.places}
        layer = layers.get(5) or c.plan_station.scenario.places[4].layer_m
        assert {item.z for item in c.missions.editor.history.draft.of(5).mission} == {layer}
        assert c.commands(5) == [TAKE_OFF, WAYPOINT]


@pytest.mark.long
async def test_the_cursor_draws_a_way_and_the_mouse_chooses_and_moves() -> None:
    async with mission_console() as c:
        await c.press("x", "plus", *["right"] * 10, "plus", *["up"] * 5, "plus", "escape")
        places = [c.missions.editor.place_m(i) for i in c.missions.editor.items[1:]]
        assert places[1][0] - places[0][0] == pytest.approx(10 * 2 * c.missions.map_view.view.m_per_dot, abs=10)
        assert places[2][1] - places[1][1] == pytest.approx(5 * 4 * c.missions.map_view.view.m_per_dot, abs=10)

        view, editor = c.missions.map_view, c.missions.editor
        column, row = view.view.world_to_cell(*editor.place_m(editor.items[1]))
        await c.pilot.click("DraftMap", offset=(column + 1, row + 1))
        await c.settle()
        assert editor.index == 1
        await c.press("e")
        await c.pilot.click("DraftMap", offset=(30, 10))
        await c.settle()
        assert editor.place_m(editor.items[1]) == pytest.approx(view.view.cell_to_world(29, 9), abs=0.1)
        await c.pilot.click("ItemTable", offset=(5, 1))
        await c.settle()
        assert editor.index == 0
        await c.pilot.click("PlanList", offset=(5, 4))
        await c.settle()
        assert editor.vehicle == 4


async def test_four_vehicles_are_listed_on_a_low_terminal() -> None:
    """Two were: what the columns are stands in the border, and the panels share a line."""
    async with mission_console(NARROW) as c:
        rows = c.missions.plan_list.text().splitlines()
        assert [row.split()[-3] for row in rows] == ["1", "2", "3", "4"]
        assert "ID ITEMS     WAY   TIME  LEFT" in c.line(3)
        await c.pilot.click("PlanList", offset=(5, 2))
        await c.settle()
        assert c.missions.editor.vehicle == 3
        await c.pilot.resize_terminal(120, 40)
        await c.settle()
        assert "missions" in c.line(3) and "ID ITEMS" in c.missions.plan_list.text().splitlines()[0]


@pytest.mark.long
async def test_fences_and_rally_points_and_clearing() -> None:
    async with mission_console() as c:
        await c.press("t", "plus")
        await c.type_into("param1", "80")
        await c.press("escape", "i", "t", "plus")
        draft = c.missions.editor.history.draft.of(1)
        assert [(i.command, i.params[0]) for i in draft.fence] == [(5004, 80.0)]
        assert [i.command for i in draft.rally] == [5100]
        await c.press("t", "g", "right", "right", "tab", *["left"] * 1)  # over: the operating area
        await c.press("ctrl+g")
        fence = c.missions.editor.history.draft.of(1).fence
        assert [i.params[0] for i in fence[1:]] == [4.0] * 4

        await c.press("2", "plus", "C")
        assert c.commands(2)
        await c.press("C")
        assert not c.commands(2)
        await c.press("u")
        assert c.commands(2)


# ---------------------------------------------------------------- generating


@pytest.mark.long
async def test_a_survey_is_seen_before_it_is_taken_and_shared_out() -> None:
    async with mission_console() as c:
        await c.press("g")
        await c.type_into("vehicles", "1-3")
        assert c.missions.editor.history.draft.is_empty
        assert [v for v in (1, 2, 3) if c.missions.editor.draft.of(v).mission] == [1, 2, 3]
        await c.press("escape")
        assert c.missions.editor.draft.is_empty
        await c.press("g")
        await c.type_into("vehicles", "1-3")
        await c.press("ctrl+g")
        assert all(c.commands(v)[0] == TAKE_OFF and c.commands(v)[-1] == RETURN for v in (1, 2, 3))
        await c.press("u")
        assert c.missions.editor.draft.is_empty

        await c.press("g")
        await c.type_into("spacing_m", "0")
        assert "lanes are at least 0.5 m apart" in c.verdict()
        await c.press("ctrl+g")
        assert "nothing taken" in c.said()
        await c.type_into("spacing_m", "20")
        await c.type_into("vehicles", "99")
        assert "vehicle 99 is neither in the scenario nor heard" in c.verdict()


async def test_clearing_is_asked_about_and_the_question_expires() -> None:
    async with mission_console() as c:
        await c.press("plus", "C")
        assert "C again clears it" in c.said()
        c.clock.advance(10.1)
        c.missions.feedback.expire()
        assert "nothing done" in c.said()
        await c.press("C")
        assert c.commands()
        await c.press("C")
        assert not c.commands()


async def test_times_and_batteries_follow_the_assumed_performance() -> None:
    async with mission_console() as c:
        await c.press("plus", "b")
        before_s = c.missions.editor.forecast.path(1).duration_s
        await c.type_into("climb_m_s", "1")
        assert c.missions.editor.forecast.path(1).duration_s > before_s + 10
        await c.type_into("endurance_min", "0.5")
        assert "the battery" in c.verdict()
        await c.type_into("endurance_min", "0")
        assert "endurance: 0; must be from 0.1" in c.verdict()
        await c.press("escape")
        assert c.missions.editor.forecast.performance.endurance_s == 30.0


# ---------------------------------------------------------------- conflicts


async def test_paths_that_meet_are_shown_on_map_list_and_below(monkeypatch: pytest.MonkeyPatch) -> None:
    async with mission_console() as c:
        frame = c.missions.editor.frame
        homes = {v: c.missions.editor.forecast.vehicle(v).home.place_m for v in (1, 2)}
        draft = MissionDraft()
        for vehicle, other in ((1, 2), (2, 1)):
            items = build.whole(frame, homes[vehicle], (build.waypoint(frame, homes[other], 30.0),), 30.0)
            draft = draft.with_items(vehicle, PlanKind.MISSION, items)
        c.missions.editor.take("two", draft)
        c.missions.did("")
        monkeypatch.setattr(missions, "SLICE_S", 0.0)
        c.missions.compare_ways()
        assert not c.missions.editor.forecast.conflicts, "keys come between two pairs"
        await c.pilot.pause(0.05)
        assert "1 and 2 MEET at" in c.verdict()
        assert "!1-2" in [word.text for word in drawings(c.missions.editor)[1] if word.must]
        assert "▸!  1" in c.text()


# ---------------------------------------------------------------- vehicles


def planned(c) -> MissionDraft:
    """A survey for 1 and 2, and a fence for 2."""
    frame = c.missions.editor.frame
    items = build.whole(frame, (0.0, 0.0), (build.waypoint(frame, (50.0, 50.0), 30.0),), 30.0)
    high = build.whole(frame, (0.0, 0.0), (build.waypoint(frame, (50.0, 50.0), 50.0),), 50.0)
    draft = MissionDraft().with_items(1, PlanKind.MISSION, items).with_items(2, PlanKind.MISSION, high)
    return draft.with_items(2, PlanKind.FENCE, fences.circle(frame.to_geodetic(0.0, 0.0), 400.0))


async def take(c, draft: MissionDraft) -> None:
    c.missions.editor.take("planned", draft)
    c.missions.did("")
    await c.settle()


async def test_one_vehicle_gets_its_plan_after_y_and_several_after_their_number_fences_first() -> None:
    async with mission_console() as c:
        await take(c, planned(c))
        old = plan_rows(Plan(PlanKind.MISSION, (build.waypoint(c.missions.editor.frame, (9.0, 9.0), 9.0),) * 3))
        c.station.on_board[1] = OnBoardRow(1, mission=old)
        await c.press("U")
        assert "instead of mission of 3 on board" in c.text()
        await c.press("enter")
        assert c.mission_station.uploads() == []
        await c.press("y")
        assert c.mission_station.uploads() == [(1, "mission")]
        assert "upload done: vehicle 1" in c.said()
        assert "1: mission on board, read back" in c.verdict()
        sent = plan_rows(Plan(PlanKind.MISSION, planned(c).of(1).mission))
        assert repr(c.mission_station.held[1, "mission"]) == repr(sent)  # by repr: NaN is like NaN

        c.station.requests.clear()
        await c.press("U", "right", "y", "enter", "3", "enter")
        assert c.mission_station.uploads() == []
        await c.press("backspace", "2", "enter")
        uploads = c.mission_station.uploads()
        assert sorted(uploads) == [(1, "mission"), (2, "fence"), (2, "mission")]
        assert uploads.index((2, "fence")) < uploads.index((2, "mission"))


@pytest.mark.parametrize("void", ["no key", "armed", "plan"])
async def test_the_question_before_an_upload_is_void_after_ten_seconds_and_when_what_it_is_about_changes(
    void: str,
) -> None:
    async with mission_console() as c:
        await take(c, planned(c))
        await c.press("U")
        dialog = c.app.screen
        assert isinstance(dialog, UploadDialog)
        assert "Esc = cancel (10 s)" in dialog.text()
        if void == "no key":
            c.clock.advance(10.1)
        elif void == "armed":
            c.station.changes[1] = {"armed": True}
        else:
            c.missions.editor.take("downloaded", MissionDraft())
        await c.tick()
        dialog.tick()
        await c.settle()
        why = "it was not answered in time" if void == "no key" else "a vehicle or a plan changed meanwhile"
        assert f"nothing sent: {why}" in c.said()
        await c.press("y")
        assert "y NOT TAKEN, a question had just closed" in c.line(1)
        assert c.mission_station.uploads() == []


async def test_what_speaks_against_an_upload_is_read_to_its_end() -> None:
    async with mission_console(NARROW) as c:
        await take(c, planned(c))
        c.missions.editor.assume(Performance(endurance_s=60.0, reserve_pct=25.0))
        await c.press("U")
        dialog = c.app.screen
        assert isinstance(dialog, UploadDialog)
        reported = " ".join(dialog.text().split())
        assert "reserve 25 %, endurance 1 min" in reported
        assert "what is not planned here stays on board as it is" in reported


async def test_a_mission_that_meets_what_flies_is_sent_only_after_m() -> None:
    def prepare(station: MissionStation) -> None:
        station.meets[1] = "its way comes within 2 m of the tour of vehicle 5 for team attack"
        station.not_compared = "not compared with vehicle 7: mission not read"

    async with mission_console(NARROW, prepare=prepare) as c:
        await take(c, planned(c))
        await c.press("U")
        assert same_as_snapshot("missions-upload-meets-80x24", c.text())
        await c.press("y")
        assert "ways meet: m first, if you want it all the same" in c.app.screen.text()
        assert c.mission_station.uploads() == []
        await c.press("m", "y")
        assert c.mission_station.uploads() == [(1, "mission")]


async def test_of_several_missions_none_is_sent_while_one_meets_what_flies() -> None:
    def prepare(station: MissionStation) -> None:
        station.meets[2] = "it would come within 0 m of vehicle 5 after 12 s"

    async with mission_console(prepare=prepare) as c:
        await take(c, planned(c))
        await c.press("U", "right", "2", "enter")
        assert c.mission_station.uploads() == []
        asked = [request for request in c.station.requests if isinstance(request, CompareMission)]
        assert [(r.vehicles, r.replaced) for r in asked] == [((1,), (1,)), ((1,), (1, 2)), ((2,), (1, 2))]
        assert repr(asked[2].items) == repr(plan_rows(planned(c).of(2).plan(PlanKind.MISSION)))  # NaN is like NaN
        await c.press("m", "enter")
        assert sorted(c.mission_station.uploads()) == [(1, "mission"), (2, "fence"), (2, "mission")]


async def test_the_consent_that_ways_meet_is_for_one_group_only() -> None:
    def prepare(station: MissionStation) -> None:
        station.meets[1] = station.meets[2] = "it would come within 0 m of vehicle 5 after 12 s"

    async with mission_console(prepare=prepare) as c:
        await take(c, planned(c))
        await c.press("U", "m", "right", "2", "enter")
        assert c.mission_station.uploads() == []


async def test_nothing_is_sent_before_the_station_has_compared() -> None:
    async with mission_console() as c:
        await take(c, planned(c))
        await c.press("U")
        dialog = c.app.screen
        assert isinstance(dialog, UploadDialog)
        dialog._compared.clear()
        await c.press("y")
        assert "wait: the station compares it with what flies" in dialog.text()
        assert c.mission_station.uploads() == []
        dialog.show_comparison((1,), UploadComparison())
        await c.press("y")
        assert c.mission_station.uploads() == [(1, "mission")]


async def test_a_plan_that_the_autopilot_keeps_in_its_own_way_is_no_other_plan() -> None:
    """A real ArduCopter's fence and rally point, just downloaded, were told to be replaced by others."""
    async with mission_console() as c:
        await take(c, planned(c))
        ours = planned(c).of(2)
        kept = {
            kind: plan_rows(Plan(kind, tuple(ARDUPILOT.stored(kind, item) for item in ours.items(kind))))
            for kind in (PlanKind.MISSION, PlanKind.FENCE)
        }
        assert kept[PlanKind.MISSION] != plan_rows(ours.plan(PlanKind.MISSION))
        c.station.on_board[2] = OnBoardRow(2, mission=kept[PlanKind.MISSION], fence=kept[PlanKind.FENCE])
        await c.press("n", "U")
        assert "fence of 1 points, mission of" in c.text() and "instead of" not in c.text()


async def test_no_mission_follows_a_fence_that_failed_and_r_tries_again() -> None:
    def prepare(station: MissionStation) -> None:
        station.fails[2, "fence"] = "no answer"

    async with mission_console(prepare=prepare) as c:
        await take(c, planned(c))
        await c.press("2", "U", "y")
        assert c.mission_station.uploads() == [(2, "fence")]
        assert "upload FAILED for vehicle 2: ^R why, R tries again" in c.said()
        assert "!  2     3  upload FAILED: R again" in c.text()
        assert "2: fence NOT on board: no answer; mission not sent" in c.verdict()
        c.mission_station.fails.clear()
        await c.press("R", "y")
        assert c.mission_station.uploads()[1:] == [(2, "fence"), (2, "mission")]
        assert "upload done" in c.said() and "FAILED" not in c.text()


async def test_what_is_on_its_way_is_shown_and_can_be_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(task_requests, "LOOK_S", 0.05)

    def prepare(station: MissionStation) -> None:
        station.hangs = True

    async with mission_console(prepare=prepare) as c:
        await take(c, planned(c))
        await c.pilot.press("U", "y")
        for _ in range(200):
            await c.pilot.pause(0.01)
            if "mission to it waits" in c.missions.plan_list.text():
                break
        assert "mission to it waits" in c.missions.plan_list.text()
        await c.pilot.press("U")
        await c.pilot.pause()
        assert "nothing sent: others are on their way" in c.said()
        await c.press("K")
        assert c.missions.transfers.jobs.running == []
        assert "cancelled" in c.verdict()


async def test_a_download_is_an_edit_and_a_comparison_changes_nothing() -> None:
    async with mission_console() as c:
        await take(c, planned(c))
        await c.press("U", "y")
        await c.press("equals_sign")
        assert "vehicle 1, mission: as planned" in c.verdict()
        await c.press("end", "delete", "equals_sign")
        assert "vehicle 1, mission: 3 items instead of 2" in c.verdict()
        await c.press("d")
        assert c.commands() == [TAKE_OFF, WAYPOINT, RETURN]
        await c.press("u")
        assert c.commands() == [TAKE_OFF, WAYPOINT]

        c.station.requests.clear()
        c.app.feed.requests.read_only = "read-only: test"
        await c.press("U")
        assert c.mission_station.uploads() == []
        assert "nothing sent: read-only" in c.said()


async def test_enter_means_the_same_as_everywhere() -> None:
    def prepare(station: MissionStation) -> None:
        station.fly()
        station.run = RunPhase.HOLD

    async with mission_console(prepare=prepare) as c:
        await c.press("enter")
        assert [r for r in c.station.requests if isinstance(r, Resume)]


# ---------------------------------------------------------------- files and crashes


async def test_work_that_was_not_saved_is_there_after_a_crash(tmp_path: Path) -> None:
    folder = tmp_path / "sim"
    async with mission_console(folder=folder) as c:
        await c.press("plus", "plus")
        c.missions._autosave()  # as after a second without a key
        drawn = c.missions.editor.history.draft
    async with mission_console(folder=folder) as c:
        assert repr(c.missions.editor.history.draft) == repr(drawn)
        assert "recovered: plans of 1 vehicle" in c.said()
        await c.press("u")
        assert c.missions.editor.history.draft.is_empty


async def test_two_consoles_keep_a_file_each_and_neither_loses_the_others_work(tmp_path: Path) -> None:
    async with mission_console(folder=tmp_path) as one, mission_console(folder=tmp_path) as two:
        await one.press("plus")
        await two.press("plus", "plus", "plus")
        counts = {len(one.commands()), len(two.commands())}
    async with mission_console(folder=tmp_path) as heir, mission_console(folder=tmp_path) as other:
        assert {len(heir.commands()), len(other.commands())} == counts
        assert "another console, not saved:" in heir.verdict()


@pytest.mark.long
async def test_saved_missions_are_opened_again_and_files_of_one_vehicle_too(tmp_path: Path) -> None:
    folder, file = tmp_path / "sim", tmp_path / "m.json"
    one = tmp_path / "one.waypoints"
    one.write_text("QGC WPL 110\n0\t1\t3\t22\t0\t0\t0\t0\t0\t0\t20\t1\n1\t0\t2\t21\t0\t0\t0\t0\t0\t0\t0\t1\n")
    async with mission_console(folder=folder) as c:
        await c.press("plus", "plus")
        drawn = c.missions.editor.history.draft
        assert "not saved" in c.said()
        await c.press("ctrl+s")
        c.missions.query_one("SaveBar PromptField").value = str(file)
        await c.press("enter")
        assert "missions saved" in c.said()
    assert not list(folder.glob("*.json")), "nothing is in progress"
    async with mission_console(folder=folder) as c:
        await c.press("ctrl+o")
        c.missions.query_one("#open PromptField").value = str(file)
        await c.press("enter")
        assert repr(c.missions.editor.history.draft) == repr(drawn)
        await c.press("ctrl+o")
        c.missions.query_one("#open PromptField").value = str(tmp_path / "none.json")
        await c.press("enter")
        assert "No such file" in c.said()
        await c.press("3", "ctrl+o")
        c.missions.query_one("#open PromptField").value = str(one)
        await c.press("enter")
        assert c.commands(3) == [TAKE_OFF, LAND]


async def test_a_vehicles_plans_are_written_for_other_programs_and_never_over_a_file(tmp_path: Path) -> None:
    file = tmp_path / "one.plan"
    async with mission_console() as c:
        await take(c, planned(c))
        for expected in ("vehicle 2 written to", "one.plan is there already"):
            await c.press("2", "W")
            c.missions.query_one("#open PromptField").value = str(file)
            await c.press("enter")
            assert expected in c.said()
        drawn = c.missions.editor.history.draft.of(2)
        await c.press("3", "ctrl+o")
        c.missions.query_one("#open PromptField").value = str(file)
        await c.press("enter")
        assert repr(c.missions.editor.history.draft.of(3)) == repr(drawn)
        assert c.said().count("u takes it back") == 1
