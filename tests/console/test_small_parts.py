"""Small parts of the console that need no screen."""

import math

import msgspec
import pytest
from textual.events import Key

from tests.screens.rigs.fake_station import FakeStation
from tui_gcs.actions import APP_ACTIONS, FLY_ACTIONS, ActionContext, bindings, footer_actions, refusal
from tui_gcs.actions.palette.entries import found, order_entries
from tui_gcs.app import ConsoleApp
from tui_gcs.console.key_input import KeyChord
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.protocol.common import RunPhase
from tui_gcs.screens.common.text_dialog import fitted as shortened
from tui_gcs.screens.fly.fly_screen import FlyScreen
from tui_gcs.screens.fly.start_plan import start_plan
from tui_gcs.widgets.basics.glyphs import UNICODE
from tui_gcs.widgets.basics.number_text import clock, fitted, gps, ids, number, outside
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run
from tui_gcs.widgets.fleet.planner_panel import as_many, team_brief, team_lines


@pytest.mark.parametrize(("vehicles", "text"), [((), ""), ((3,), "3"), ((1, 2, 3, 7), "1-3 7"), ((9, 8), "8-9")])
def test_ids_are_ranges(vehicles: tuple[int, ...], text: str) -> None:
    assert ids(vehicles) == text


@pytest.mark.parametrize("room", range(-3, 8))
@pytest.mark.parametrize("teams", [0, 1, 2, 3])
def test_teams_without_room_are_counted(teams: int, room: int) -> None:
    lines = as_many([[[(f"team {i}", Ink.TEXT)], [("its ratio", Ink.TEXT)]] for i in range(teams)], room, "M")
    words = [line[0][0] for line in lines]
    if 2 * teams <= max(room, 0):
        assert len(words) == 2 * teams and "more teams" not in str(words)
    else:
        assert words[-1] == f"{teams - (len(words) - 1) // 2} more teams: M"
        assert len(words) <= max(room, 1)


def test_unknown_is_two_dashes() -> None:
    assert number(math.nan, 1, " m") == "--"
    assert number(math.inf) == "--"
    assert number(-0.01, 1) == "0.0"
    assert clock(math.nan) == "T+--:--"
    assert clock(3725.0) == "T+1:02:05"
    assert gps(3, -1) == "3D"
    assert fitted(120.04, 4) == "120"


def test_who_waits_in_reserve_is_told_beside_the_slots() -> None:
    four = msgspec.structs.replace(FakeStation(MemoryBus(), count=8).status().teams[0], on_slot=4, slots=4)
    three = msgspec.structs.replace(four, reserve=1)

    def words(lines: list[list[Run]]) -> str:
        return "".join(text for line in lines for text, _ in line)

    assert "slots 4/4" in words(team_lines(four, UNICODE)) and "reserve" not in words(team_lines(four, UNICODE))
    assert "slots 3/3 +1 in reserve" in words(team_lines(three, UNICODE))
    assert words([team_brief(three, UNICODE)]).find(" 3/3+1 ") > 0


def test_how_far_somebody_was_outside_is_zero_only_for_nobody() -> None:
    reported = [outside(metres, " m") for metres in (0.0, 0.02, 0.4, 3.0, 12.3, math.nan)]
    assert reported == ["0 m", "0.1 m", "0.4 m", "3.0 m", "12 m", "--"]


def test_a_zone_is_told_to_be_covered_only_when_it_was_seen_whole() -> None:
    team = FakeStation(MemoryBus(), count=8).status().teams[0]
    almost, whole = (msgspec.structs.replace(team, coverage=share) for share in (0.998, 1.0))
    assert "cov99 " in team_brief(almost, UNICODE)[1][0] and "cov100 " in team_brief(whole, UNICODE)[1][0]
    assert "cover 99%" in team_lines(almost, UNICODE)[1][1][0]


def test_a_text_too_long_for_its_box_loses_empty_lines_first() -> None:
    line, empty, keys = [("what sinks", Ink.TEXT)], [("", Ink.TEXT)], [("Esc = close", Ink.TEXT)]
    text = [line, empty, line, empty, line, empty, keys]
    assert shortened(text, 7) == text
    assert shortened(text, 6) == [line, empty, line, empty, line, keys]
    assert shortened(text, 4) == [line, line, line, keys]
    (cut,) = shortened([line] * 20 + [keys], 10)[6]
    assert cut[0] == "  12 more lines: a taller terminal shows them"


def key(name: str, character: str | None) -> Key:
    return Key(name, character)


def test_chord_of_last_resort_needs_both_keys_in_time() -> None:
    chord = KeyChord()
    bang, h, r = key("exclamation_mark", "!"), key("h", "h"), key("r", "r")
    assert chord.press(bang, 0.0) == ("", [])
    assert chord.press(h, 1.0) == ("hold_all", [])
    assert chord.press(h, 1.1) == ("", [h])
    assert chord.press(bang, 2.0) == ("", [])
    assert chord.press(h, 9.0) == ("", [bang, h])
    chord.press(bang, 10.0)
    assert chord.press(r, 10.1) == ("return_all", [])


def test_text_with_a_bang_is_not_lost() -> None:
    chord = KeyChord()
    bang, a = key("exclamation_mark", "!"), key("a", "a")
    chord.press(bang, 0.0)
    assert chord.press(a, 0.1) == ("", [bang, a])
    chord.press(bang, 1.0)
    assert chord.press(bang, 1.1) == ("", [bang])
    assert chord.is_waiting(1.2)
    assert not chord.is_waiting(9.0), "no longer than it would be taken"


def test_every_action_has_its_method() -> None:
    for owner, actions in ((ConsoleApp, APP_ACTIONS), (FlyScreen, FLY_ACTIONS)):
        for action in actions:
            assert action.id == "digit" or hasattr(owner, f"action_{action.call.partition('(')[0]}"), action.id


def test_no_key_is_bound_twice() -> None:
    keys = [key for binding in bindings((*APP_ACTIONS, *FLY_ACTIONS)) for key in binding.key.split(",")]
    assert len(keys) == len(set(keys))


def test_footer_keeps_hold_all_and_help_when_narrow() -> None:
    kept = {action.id for action in footer_actions((*APP_ACTIONS, *FLY_ACTIONS), 40)}
    assert {"hold_all", "start_stop"} <= kept
    for width in range(20, 200):
        shown = footer_actions((*APP_ACTIONS, *FLY_ACTIONS), width)
        assert sum(len(a.shown) + 1 + len(a.label) + 2 for a in shown) + 1 - 2 <= width


def test_what_cannot_be_done_now_says_why() -> None:
    station = FakeStation(MemoryBus())
    actions = {action.id: action for action in APP_ACTIONS}

    def why(action: str, **seen: object) -> str:
        return refusal(actions[action], ActionContext(station.status(), station.frame(), **seen))

    assert why("resume") == "nothing holds"
    assert why("start_stop") == ""
    assert why("start_stop", station_lost=True) == "the station is silent"
    station.fly()
    assert why("start_stop", station_lost=True) == "", "HOLD is asked all the same, as !h does"
    assert why("start_stop", read_only="a replay") == why("hold_all", read_only="a replay") == "a replay"
    assert why("show_plan", read_only="a replay") == ""
    station.run = RunPhase.HOLD
    assert why("resume") == ""
    assert "Enter goes on" in why("start_stop")
    assert why("start_stop", station_lost=True) == "", "who held before it fell silent may not now"


def test_counted_teams_take_the_lowest_free_ids() -> None:
    station = FakeStation(MemoryBus())
    defend, attack = station.scenario.teams
    teams = (
        type(defend)(name="a", zone="home", planner="patrol", count=3),
        type(defend)(name="b", zone="field", planner="patrol", vehicles=(2, 4)),
        type(defend)(name="c", zone="field", planner="patrol", count=5),
    )
    scenario = type(station.scenario)(
        **{name: getattr(station.scenario, name) for name in station.scenario.__struct_fields__ if name != "teams"},
        teams=teams,
    )
    status = type(station.status())(
        **{name: getattr(station.status(), name) for name in station.status().__struct_fields__ if name != "teams"},
        teams=(),
    )
    plan = start_plan(scenario, status, station.frame())
    assert [team.vehicles for team in plan.teams] == [(1, 3, 5), (2, 4), (6, 7, 8)]
    assert [len(team.missing) for team in plan.teams] == [0, 0, 2]
    assert plan.vehicles == tuple(range(1, 9))
    assert attack.name


def test_no_color_leaves_bold_and_reverse(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")
    app = ConsoleApp(MemoryBus())
    assert app.native_ansi_color
    assert app.no_color


def test_an_empty_no_color_leaves_the_colours(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "")
    app = ConsoleApp(MemoryBus())
    assert not app.native_ansi_color
    assert not app.no_color


def test_who_is_not_ready_is_left_out_of_the_start_and_named_with_the_reason() -> None:
    station = FakeStation(MemoryBus())
    status = msgspec.structs.replace(station.status(), not_ready={3: "no 3-D position fix (fix type 1)"})
    plan = start_plan(station.scenario, status, station.frame())
    assert plan.vehicles == (1, 2, 4, 5, 6, 7, 8)
    assert [team.not_ready for team in plan.teams] == [((3, "no 3-D position fix (fix type 1)"),), ()]


@pytest.mark.parametrize(
    "word, order",
    [("pause", "hold"), ("continue", "continue"), ("rtl", "return"), ("kill", "KILL MOTORS"), ("photo", "photo")],
)
def test_words_of_the_trade_find_their_order(word: str, order: str) -> None:
    station = FakeStation(MemoryBus(), run=RunPhase.RUNNING)
    entries = order_entries(ActionContext(station.status(), station.frame(), (1, 2)))
    assert order in [entry.name for entry in found(entries, word)]
