"""Who may ask what, who is in control then, and what is written down of it; without a flight."""

from collections.abc import Callable
from typing import get_args

import msgspec
import pytest

from tests.core.rigs.rig import Rig, scenario
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol.alarms import Acknowledge, Shelve, Unshelve
from tui_gcs.core.protocol.bus import REQUEST
from tui_gcs.core.protocol.common import EventClass, Phase, Reply, RunPhase, VehicleResult
from tui_gcs.core.protocol.flight import Land, Nudge
from tui_gcs.core.protocol.preflight import AcknowledgeCheck, ReadChecks, SignOff
from tui_gcs.core.requests.request_router import request_words
from tui_gcs.core.requests.station_requests import planner_changes
from tui_gcs.core.requests.stop_sequence import stop_reply
from tui_gcs.core.scenario.model import Scenario

MakeRig = Callable[..., Rig]
LOOKING = [
    m.Hello(protocol=m.PROTOCOL, who="console"),
    m.GetScenario(),
    m.GetEvents(after=0),
    m.GetTask(team="defend"),
    m.GetPlan(),
    m.GetPlanners(),
    m.GetPreviews(),
    m.GetJournal(),
    s.GetVehicles(),
    s.GetTasks(),
]
NOTING = [
    Acknowledge(raised={}),
    Shelve(raised={}, minutes=5.0),
    Unshelve(causes=()),
    m.Preview(base_revision=99, toml=""),
    AcknowledgeCheck(name="rc", text="does nothing", operator="me"),
    SignOff(operator="me", revision=1),
    ReadChecks(),
    m.Note(text="seen", severity=5),
    m.CancelPreview(),
    s.FetchParams(vehicles=(1,)),
]
COMMANDING = [
    m.Start(vehicles=(1,)),
    m.Hold(),
    m.Resume(),
    m.Return(),
    Land(),
    m.SwitchRound(index=1),
    m.ApplyScenario(base_revision=99, toml=""),
    m.SetParameters(team="defend", parameters={}),
    s.CancelTask(number=7),
    Nudge(vehicles=(1,), velocity_m_s=(0.0, 0.0, 0.0)),
    m.Shutdown(lost=(9,)),
]


def ask(rig: Rig, request: m.Request, principal: str = "console-1") -> dict[str, object]:
    """The answer, whatever kind of one it is."""
    found: dict[str, object] = msgspec.msgpack.decode(
        rig.bus.ask(REQUEST.format(principal=principal), m.encode(request))
    )
    return found


def journalled(rig: Rig) -> list[tuple[str, str]]:
    return [(event.source, event.text) for event in rig.events() if event.cls is EventClass.OPERATOR]


@pytest.mark.parametrize("request_", [*LOOKING, *NOTING], ids=request_words)
def test_looking_and_saying_that_one_has_seen_is_answered_and_takes_nobodys_control(
    rig: MakeRig, request_: m.Request
) -> None:
    ground = rig(1)
    assert ask(ground, m.SwitchRound(index=1), "console-1")["ok"]
    reported = len(journalled(ground))
    assert isinstance(ask(ground, request_, "console-2")["ok"], bool)
    assert ground.station.frontend.requests.in_control == "console-1"
    if request_ in LOOKING:
        assert len(journalled(ground)) == reported


@pytest.mark.parametrize("request_", COMMANDING, ids=request_words)
def test_who_commands_is_in_control_and_what_was_asked_is_written_down(rig: MakeRig, request_: m.Request) -> None:
    ground = rig(1)
    reply = ask(ground, request_, "console-2")
    assert ground.station.frontend.requests.in_control == "console-2"
    (line,) = (text for source, text in journalled(ground) if source == "console-2")
    assert line.startswith(f"{request_words(request_)} refused: ") is not reply["ok"]


@pytest.mark.parametrize("request_", [*NOTING, *COMMANDING], ids=request_words)
def test_a_planner_worker_may_only_look(rig: MakeRig, request_: m.Request) -> None:
    ground = rig(1)
    reply = ask(ground, request_, "planner-defend")
    assert (reply["ok"], reply["text"]) == (False, "a planner worker may not command")
    assert ground.station.frontend.requests.in_control == "" and journalled(ground) == []


@pytest.mark.parametrize("request_", LOOKING, ids=request_words)
def test_what_can_be_looked_at_is_there(rig: MakeRig, request_: m.Request) -> None:
    assert ask(rig(1), request_, "planner-defend")["ok"] is True


def test_what_is_looked_at_is_what_the_station_has(rig: MakeRig) -> None:
    ground = rig(8)
    assert set(ground.ask(m.GetPlan()).annotations) == {"defend", "attack"}
    names = [planner.name for planner in ground.ask(m.GetPlanners()).planners]
    assert names == sorted(ground.station.config.planners) == ["patrol"]
    ground.station.active.team_controllers["attack"].planner.quarantined = True
    reply = ground.ask(m.GetTask(team="attack"))
    text = "its planner is left alone until the operator changes something"
    assert (reply.ok, reply.task, reply.text) == (True, None, text)
    ground.ask(m.Note(text="written down", severity=5))
    assert "written down" in [event.text for event in ground.ask(m.GetJournal()).events]
    assert ground.ask(m.GetTask(team="nobody")) == Reply(ok=False, text="no team nobody")


@pytest.mark.parametrize(("asked", "severity"), [(-3, 4), (1, 4), (4, 4), (6, 6), (7, 7), (99, 7)])
def test_a_note_is_no_alarm_and_one_harmless_line(rig: MakeRig, asked: int, severity: int) -> None:
    ground = rig(1)
    assert ground.ask(m.Note(text="all\x1b[2Jwell" + "!" * 400, severity=asked)).ok
    (event,) = (event for event in ground.events() if event.cls is EventClass.CONSOLE)
    assert (event.severity, event.source) == (severity, "console-1")
    assert "\x1b" not in event.text and len(event.text) == 300


def test_keys_held_down_are_written_down_once_in_five_seconds(rig: MakeRig) -> None:
    ground = rig(1)
    nudge, hold = Nudge(vehicles=(1,), velocity_m_s=(0.0, 0.0, 0.0)), m.Hold()
    for _ in range(45):
        ask(ground, nudge)
        ground.clock.advance(0.1)
    assert len(journalled(ground)) == 1
    ground.clock.advance(0.6)
    ask(ground, nudge)
    assert len(journalled(ground)) == 2
    for _ in range(3):
        ask(ground, hold)
    assert len(journalled(ground)) == 5, "every other command is"


# ---------------------------------------------------------------- in words


def done(*ok: bool) -> tuple[VehicleResult, ...]:
    return tuple(VehicleResult(vehicle=k, ok=good, text="") for k, good in enumerate(ok, 1))


@pytest.mark.parametrize(
    ("asked", "results", "expected", "newer"),
    [
        (m.Hold(), (), (False, "no vehicle is in the air"), ()),
        (m.Hold(), done(True), (True, "hold: vehicle 1"), ()),
        (m.Hold(), done(True, True), (True, "hold: vehicles 1-2"), ()),
        (m.Hold(), done(True, False, True), (False, "hold: 2 of 3: vehicles 1 3"), ()),
        (m.Hold(), done(False, False), (False, "hold: 0 of 2"), ()),
        (m.Hold(vehicles=(1, 5)), done(True), (False, "hold: 1 of 2: vehicle 1"), ()),
        (m.Hold(vehicles=(5,)), (), (False, "hold: 0 of 1"), ()),
        (m.Hold(vehicles=(1, 5)), done(True), (True, "hold: vehicle 1"), (5,)),
        (m.Hold(vehicles=(5,)), (), (False, "all obey a newer stop"), (5,)),
    ],
)
def test_a_stop_says_whom_it_reached_and_leaves_nobody_out(
    asked: m.Hold, results: tuple[VehicleResult, ...], expected: tuple[bool, str], newer: tuple[int, ...]
) -> None:
    reply = stop_reply("hold", asked, results, newer)
    assert (reply.ok, reply.text) == expected
    left_out = [r.vehicle for r in reply.results if r.text == "is not known or not in the air"]
    assert left_out == [v for v in asked.vehicles if v == 5 and v not in newer]


@pytest.mark.parametrize(
    ("reply", "line"),
    [
        (Reply(ok=True), "done"),
        (Reply(ok=True, text="round 2"), "round 2"),
        (Reply(ok=False, text="no"), "switch round refused: no"),
        (Reply(ok=False, text="no", results=done(False)), "switch round refused: no (vehicle 1: )"),
        (Reply(ok=False, text="no", results=done(True, False)), "switch round refused in part: no (vehicle 2: )"),
    ],
)
def test_what_is_written_down_says_what_was_refused_to_whom(rig: MakeRig, reply: Reply, line: str) -> None:
    ground = rig(1)
    ground.station.frontend.requests._journal("console-1", m.SwitchRound(index=1), reply)
    assert journalled(ground) == [("console-1", line)]
    assert ground.events()[-1].severity == (5 if reply.ok else 4)


def team(**changes: object) -> Scenario:
    whole = scenario(2)
    return msgspec.structs.replace(whole, teams=(msgspec.structs.replace(whole.teams[0], **changes),))


def test_what_an_edit_changes_of_planners_is_said_by_team() -> None:
    before = team(planner="patrol", parameters={"reserve": 1, "search": 0})
    assert planner_changes(before, before) == []
    assert planner_changes(before, team(planner="guardian", parameters={})) == [
        "team defend: planner patrol -> guardian"
    ]
    after = team(planner="patrol", parameters={"reserve": 2, "overlap": 5})
    assert planner_changes(before, after) == [
        "team defend: overlap its default -> 5",
        "team defend: reserve 1 -> 2",
        "team defend: search 0 -> its default",
    ]
    assert planner_changes(before, team(name="others", planner="guardian", parameters={})) == []


# ---------------------------------------------------------------- refused


@pytest.mark.parametrize("vehicles", [(), (1, 1), (2, 1, 2)])
def test_a_start_names_each_vehicle_once(rig: MakeRig, vehicles: tuple[int, ...]) -> None:
    assert rig(2).ask(m.Start(vehicles=vehicles)) == Reply(ok=False, text="name each vehicle once")


def test_nothing_is_started_while_the_fleet_returns(rig: MakeRig) -> None:
    ground = rig(1)
    ground.station.flight.executive.run = RunPhase.RETURNING
    why = "the fleet is returning: wait until all have landed"
    assert ground.ask(m.Start(vehicles=(1,))) == Reply(ok=False, text=why)
    assert not ground.ask(m.SwitchRound(index=1)).ok and ground.station.active.round_index == 0


def test_a_station_ends_only_if_nothing_armed_is_heard_and_the_lost_are_named(rig: MakeRig) -> None:
    ground = rig(3).ready()
    one, two = ground.station.picture.fleet.vehicles[1], ground.station.picture.fleet.vehicles[2]
    assert ground.ask(m.Shutdown(lost=(1,))).text == "nothing armed is lost: stop without --lost"
    one.telemetry.armed = two.telemetry.armed = True
    assert ground.ask(m.Shutdown()) == Reply(
        ok=False, text="not while armed: vehicles 1-2 (tui-gcs return or tui-gcs land lands them)"
    )
    ground.loses = lambda way, index: index in (0, 1)
    ground.run(30.0)
    ids = "armed when last heard, and LOST: 1 2; if you know what became of them: tui-gcs stop --lost 1 2"
    for named in ((), (1,), (1, 2, 3)):
        assert ground.ask(m.Shutdown(lost=named)) == Reply(ok=False, text=ids)
    assert not ground.station.conditions.ending
    assert ground.ask(m.Shutdown(lost=(2, 1))).ok and ground.station.conditions.ending


def test_a_round_is_judged_by_where_vehicles_must_land_too(rig: MakeRig) -> None:
    ground = rig(2).ready()
    flight = ground.station.flight.flights.by_id[1]
    flight.home_m = (-500.0, 0.0, 0.0)
    assert ground.ask(m.SwitchRound(index=1)).ok, "on the ground it takes off from where it is"
    flight.enter(Phase.HOLDING, ground.clock.now())
    (result,) = ground.ask(m.SwitchRound(index=0)).results
    assert result.text == "the place where it must land is outside, or in a no-fly zone"


def test_every_request_has_one_handler(rig: MakeRig) -> None:
    asked = get_args(m.AnyRequest) + get_args(s.ServiceRequest)
    assert set(rig(1).station.frontend.requests.handlers) == set(asked)
