"""Rounds, copies and previews, on the plan screen."""

import pytest
from msgspec.structs import replace

from tests.screens.rigs.console import NARROW
from tests.screens.rigs.plan_station import PlanConsole, PlanStation, plan_console
from tui_gcs.core.geometry.zones import Circle, Rectangle
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Annotation, FlownWays, PreviewResult
from tui_gcs.screens.plan.plan_preview import PAUSE_S


def zones(c: PlanConsole, index: int) -> dict[str, object]:
    assert c.plan.model.scenario is not None
    return {zone.name: zone.shape for zone in c.plan.model.scenario.rounds[index].zones}


@pytest.mark.long
async def test_a_zone_is_duplicated_here_and_copied_into_other_rounds() -> None:
    async with plan_console() as c:
        await c.press("c")
        assert "copy home: 1 here, another number into that round, 0 into all others" in c.said()
        await c.press("1")
        assert zones(c, 0)["home 2"] == Circle((170.0, 180.0), 80.0)
        assert c.plan.draft.zone_name == "home 2"
        await c.press("c", "0")
        assert "home 2 copied to round 2, 3" in c.said()
        assert zones(c, 1)["home 2"] == zones(c, 2)["home 2"] == Circle((170.0, 180.0), 80.0)
        await c.press("u")
        assert "home 2" not in zones(c, 1)
        await c.press("c", "9")
        assert "not copied: there is no round 9" in c.said()
        await c.press("up", "up", "up", "c")
        assert "choose a zone" in c.said()
        await c.press("2")
        assert c.plan.model.round_index == 1, "the digit chooses the round again"


async def test_rounds_are_added_and_deleted() -> None:
    async with plan_console(NARROW) as c:
        await c.press("2", "R")
        assert c.plan.model.round_index == 3 and isinstance(zones(c, 3)["home"], Rectangle)
        assert "4 round 4" in c.plan.round_chooser.text()
        await c.press("X")
        assert "delete round 4? X again" in c.said()
        await c.press("X")
        assert "round 4" not in c.plan.round_chooser.text()
        await c.press("u")
        assert "4 round 4" in c.plan.round_chooser.text()
        await c.press("ctrl+y")
        assert "done again: delete round 4" in c.said() and "round 4" not in c.plan.round_chooser.text()


@pytest.mark.long
async def test_teams_are_added_named_and_deleted_with_their_places() -> None:
    async with plan_console() as c:
        await c.field("team")
        await c.press("plus")
        assert "team-3 added with a vehicle, its place and layer" in c.said()
        await c.type_into("team_name", "scouts")
        assert c.plan.model.team("scouts") is not None and c.plan.draft.team_name == "scouts"
        await c.press("escape")
        await c.type_into("team_name", "attack")
        assert "a second team 'attack'" in c.verdict() and c.plan.model.team("scouts") is not None
        await c.press("ctrl+z")
        await c.type_into("vehicles", "9-10")
        assert "10: new take-off place and layer" in c.said()
        await c.field("team")
        await c.press("delete", "delete")
        assert "scouts deleted" in c.said() and c.plan.model.scenario is not None
        assert [team.name for team in c.plan.model.scenario.teams] == ["defend", "attack"]
        assert len(c.plan.model.scenario.places) == 8


# ---------------------------------------------------------------- what planners would make of it

TOUR = Annotation("polyline", ((100.0, 150.0), (200.0, 150.0), (150.0, 250.0)), "tour")


class Planners:
    """Stands for the station's workers: answers previews when it is told to."""

    def __init__(self, station: PlanStation) -> None:
        self.asked: list[m.Request] = []
        self.previews: dict[str, PreviewResult] = {}
        station.answers = self.answer

    def answer(self, request: m.AnyRequest) -> m.Reply | None:
        if isinstance(request, m.Preview | m.CancelPreview | m.GetPreviews):
            self.asked.append(request)
            if isinstance(request, m.Preview):
                teams = [request.team] if request.team else ["defend", "attack"]
                self.previews = {team: PreviewResult(team, len(self.asked), "running") for team in teams}
            return m.Reply(ok=True, previews=dict(self.previews))
        return None

    def find_out(self, **values: object) -> None:
        for team, found in self.previews.items():
            done = PreviewResult(team, found.number, "done", annotations=(TOUR,), vehicles=4)
            self.previews[team] = replace(done, **values)

    def questions(self) -> list[m.Preview]:
        return [request for request in self.asked if isinstance(request, m.Preview)]


async def sees(c: PlanConsole, words: str) -> None:
    """They are told once the operator pauses, or once the console looks again for an answer."""
    c.clock.advance(PAUSE_S + 0.01)
    c.plan.preview.send_if_due()
    await c.settle()
    assert words in c.verdict()


async def test_the_preview_of_an_edit_is_shown_and_drawn_until_the_next_edit() -> None:
    there: list[Planners] = []
    async with plan_console(prepare=lambda station: there.append(Planners(station))) as c:
        (planners,) = there
        await sees(c, "defend: planning")
        planners.find_out(worst_s=26.8, ratio=1.28, separation=1.4)
        await sees(c, "defend: 4 planned: 26.8 s worst, 1.28 x ideal, separation 1.40 x")
        assert c.plan.map_view.content.annotations["defend"] == (TOUR,)
        await c.type_into("radius_m", "60")
        assert "planned" not in c.verdict() and not c.plan.map_view.content.annotations
        await sees(c, "defend: planning")
        first, *_, second = planners.questions()
        assert "radius_m = 60.0" in second.toml and "radius_m = 60.0" not in first.toml
        planners.find_out(separation=0.9)
        await sees(c, "not all is seen")
        assert "two would come too near" in c.verdict()


@pytest.mark.long
async def test_where_two_teams_meet_is_shown_under_each_of_them() -> None:
    """Both over one place after 10 s, on layers 7 m apart; then 3 m."""
    there: list[Planners] = []
    async with plan_console(prepare=lambda station: there.append(Planners(station))) as c:
        (planners,) = there
        await sees(c, "defend: planning")
        ways = {
            "defend": FlownWays((1,), 1.0, (tuple((10.0 * t, 100.0, 30.0) for t in range(20)),)),
            "attack": FlownWays((5,), 1.0, (tuple((100.0, 10.0 * t, 37.0) for t in range(20)),)),
        }
        planners.find_out(worst_s=26.8, ratio=1.28, separation=1.4)
        planners.previews = {team: replace(found, ways=ways[team]) for team, found in planners.previews.items()}
        await sees(c, "defend and attack: separation 1.40 x after 10 s at [100 100] (1 and 5)")
        assert "0.0 m beside and 7.0 m above each other" in c.verdict()
        await c.press("down")
        assert "defend and attack: separation 1.40 x" in c.verdict()
        await c.type_into("width_m", "60")
        assert "defend and attack" not in c.verdict(), "of an edit that is old"


async def test_a_planner_that_takes_long_is_seen_to_work() -> None:
    there: list[Planners] = []
    async with plan_console(prepare=lambda station: there.append(Planners(station))) as c:
        await sees(c, "defend: planning ...")
        c.clock.advance(4.0)
        await sees(c, "defend: planning ... 4 s")
        c.clock.advance(20.0)
        await sees(c, "defend: planning ... 25 s")
        there[0].find_out(worst_s=26.8, ratio=1.28, separation=1.4)
        await sees(c, "defend: 4 planned: 26.8 s worst")
        await c.type_into("radius_m", "60")
        await sees(c, "defend: planning ...")
        assert "planning ... 2" not in c.verdict(), "another question"


async def test_nothing_is_planned_while_the_screen_is_not_shown() -> None:
    there: list[Planners] = []
    async with plan_console(prepare=lambda station: there.append(Planners(station))) as c:
        await sees(c, "defend: planning")
        await c.press("f")
        assert isinstance(there[0].asked[-1], m.CancelPreview)


@pytest.mark.long
async def test_how_many_vehicles_a_team_needs() -> None:
    there: list[Planners] = []
    async with plan_console(prepare=lambda station: there.append(Planners(station))) as c:
        (planners,) = there
        await c.press("i", "x", "enter")
        assert "idleness: 'x' is not a number" in c.said()
        await c.press("i", "ctrl+u", "1", "5", "enter")
        question = planners.questions()[-1]
        assert (question.team, question.idleness_s, question.round_index) == ("defend", 15.0, 0)
        assert "defend: how many for 15 s?" in c.verdict()
        planners.find_out(worst_s=14.2, ratio=1.3, separation=1.4, vehicles=6)
        await sees(c, "defend: 6 vehicles for 15 s, 2 more than it has")


async def test_a_planner_that_fails_shows_its_error() -> None:
    there: list[Planners] = []
    async with plan_console(prepare=lambda station: there.append(Planners(station))) as c:
        await sees(c, "defend: planning")
        there[0].find_out(state="failed", text="zone 'home': no tour")
        await sees(c, "defend: no plan: zone 'home': no tour")
