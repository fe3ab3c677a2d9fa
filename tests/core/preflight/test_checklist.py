"""The list of checks before a start: what is on it, who refuses a LIVE start, and how an operator goes on."""

from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from tests.core.rigs.rig import Rig, scenario
from tests.core.rigs.service_asking import ask
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.firmware.failsafes import explain
from tui_gcs.core.missions.fences import circle
from tui_gcs.core.plans.model import WAYPOINT, Plan, PlanItem, PlanKind
from tui_gcs.core.process.state_store import StateStore
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.alarms import id_ranges
from tui_gcs.core.protocol.common import Phase, RunPhase
from tui_gcs.core.protocol.flight import Arm
from tui_gcs.core.protocol.preflight import (
    CHECKLIST,
    FAILSAFES,
    OVERRIDABLE,
    TITLES,
    AcknowledgeCheck,
    Check,
    CheckState,
    ReadChecks,
    SignOff,
    TickItem,
    refusing,
)
from tui_gcs.core.records.rehearsal_store import RehearsalRecord, plan_digest, remember
from tui_gcs.core.services.plans.plan_table import HeldPlan

MakeRig = Callable[..., Rig]
MISSION = Plan(PlanKind.MISSION, (PlanItem(WAYPOINT, 3, x=520_000_000, y=-6_000_000, z=30.0),))
SAFE = {"FS_GCS_ENABLE": 1.0, "BATT_FS_LOW_ACT": 2.0, "BATT_FS_CRT_ACT": 1.0, "BATT_CRT_VOLT": 9.0, "FENCE_ENABLE": 1.0}
"""An ArduCopter that does something whatever is lost."""


def live(rig: MakeRig, tmp_path: Path, vehicles: int = 2) -> Rig:
    """A LIVE station whose vehicles are ready to start."""
    flight = rig(vehicles)
    config = flight.station.config
    config.kind, config.token, config.rehearsals = RunKind.LIVE, "", tmp_path / "rehearsals.jsonl"
    flight.restart_station(StateStore(tmp_path / "none.json"))
    flight.ready()
    flight.until(
        lambda: not any(map(flight.station.frontend.readiness.why_not_start, flight.ids)), 60.0, "ready to start"
    )
    return flight


def rehearsed(flight: Rig, *, passed: bool = True, wall_s: float = 1_800_000_000.0) -> None:
    """As `tui-gcs rehearse` leaves it."""
    station = flight.station
    plan = plan_digest(station.active.scenario, station.config.planners)
    assert station.config.rehearsals is not None
    good = 41 if passed else 39
    remember(station.config.rehearsals, RehearsalRecord(plan, passed, wall_s, "it", good, 41, "ardupilot"))


def lines(flight: Rig) -> dict[str, Check]:
    """The list as it is now, one line per check: the worst."""
    found: dict[str, Check] = {}
    for check in flight.station.frontend.checklist.look(flight.ids):
        found.setdefault(check.name, check)
    return found


def read(flight: Rig) -> None:
    """What is not known of the vehicles is read from them."""
    assert flight.ask(ReadChecks()).ok
    flight.until(lambda: lines(flight)["station-loss"].state is not CheckState.UNKNOWN, 10.0, "failsafes read")
    flight.until(lambda: lines(flight)["fence"].state is not CheckState.UNKNOWN, 10.0, "fence read")


def acknowledged(flight: Rig, operator: str = "Ada") -> None:
    """Every failsafe that does nothing is accepted as it is."""
    for check in flight.station.frontend.checklist.look(flight.ids):
        if check.name in FAILSAFES and check.state is CheckState.FAIL:
            assert flight.ask(AcknowledgeCheck(check.name, check.text, operator)).ok


# ---------------------------------------------------------------- the list


def test_every_check_is_told_worst_first(rig: MakeRig, tmp_path: Path) -> None:
    flight = live(rig, tmp_path)
    checks = flight.station.publisher.status().preflight
    assert {check.name for check in checks} == set(TITLES) - {CHECKLIST}, "the scenario has no checklist"
    order = list(CheckState)
    assert [order.index(c.state) for c in checks] == sorted(order.index(c.state) for c in checks)
    assert {c.name for c in checks if c.state is CheckState.FAIL} == {"rehearsal", "sign-off"}
    assert {c.name for c in checks if c.state is CheckState.UNKNOWN} == {*FAILSAFES, "fence"}


def test_simulated_vehicles_start_without_any_of_it(rig: MakeRig) -> None:
    flight = rig(2).ready()
    flight.until(
        lambda: not any(map(flight.station.frontend.readiness.why_not_start, flight.ids)), 60.0, "ready to start"
    )
    not_needed = {
        c.name for c in flight.station.frontend.checklist.look(flight.ids) if c.state is CheckState.NOT_NEEDED
    }
    assert not_needed == set(OVERRIDABLE) - {CHECKLIST}
    assert flight.ask(m.Start(vehicles=flight.ids)).ok


def test_the_list_and_the_refusal_of_a_vehicle_say_the_same(rig: MakeRig) -> None:
    flight = rig(2).ready()
    flight.station.picture.fleet.vehicles[2].telemetry.battery_pct = 12.0
    check = lines(flight)["battery"]
    assert (check.state, check.vehicles, check.hard) == (CheckState.FAIL, (2,), True)
    assert check.text in flight.station.frontend.readiness.why_not_start(2)


def test_vehicles_of_which_the_same_is_true_are_one_line(rig: MakeRig, tmp_path: Path) -> None:
    flight = live(rig, tmp_path, 3)
    read(flight)
    found = [c for c in flight.station.frontend.checklist.look(flight.ids) if c.name == "station-loss"]
    assert [c.vehicles for c in found] == [(1, 2, 3)]
    assert "NOTHING (FS_GCS_ENABLE 0)" in found[0].text


def test_vehicles_that_are_missing_are_told_and_stop_nobody(rig: MakeRig, tmp_path: Path) -> None:
    flight = live(rig, tmp_path)
    team = msgspec.structs.replace(flight.station.active.scenario.teams[0], vehicles=(1, 2, 3))
    flight.station.active.scenario = msgspec.structs.replace(flight.station.active.scenario, teams=(team,))
    check = lines(flight)["heard"]
    assert (check.state, check.vehicles, check.text) == (CheckState.WARN, (3,), "2 of the scenario's 3 are heard")


def without_gps(flight: Rig) -> None:
    flight.station.picture.fleet.vehicles[1].telemetry.gps_fix = 1


def out_of_the_area(flight: Rig) -> None:
    flight.station.picture.fleet.vehicles[1].telemetry.position_m = (5000.0, 0.0, 0.0)


def lossy(flight: Rig) -> None:
    flight.station.picture.fleet.vehicles[1].loss_pct = 30.0


def with_a_link_down(flight: Rig) -> None:
    flight.link.error = "no such device"


def with_a_full_disk(flight: Rig) -> None:
    flight.station.records.recorder.error = "no space left"


def without_a_planner(flight: Rig) -> None:
    next(iter(flight.station.active.team_controllers.values())).planner.error = "it crashed"


def armed_already(flight: Rig) -> None:
    flight.station.picture.fleet.vehicles[1].telemetry.armed = True


def with_a_double(flight: Rig) -> None:
    flight.station.picture.fleet.vehicles[1].identity.blocked = "several vehicles use id 1"


def silent(flight: Rig) -> None:
    flight.clock.advance(60.0)


WRONG: tuple[tuple[str, CheckState, Callable[[Rig], None]], ...] = (
    ("gps", CheckState.FAIL, without_gps),
    ("place", CheckState.FAIL, out_of_the_area),
    ("links", CheckState.WARN, lossy),
    ("links", CheckState.WARN, with_a_link_down),
    ("recording", CheckState.WARN, with_a_full_disk),
    ("planner", CheckState.FAIL, without_a_planner),
    ("arming", CheckState.FAIL, armed_already),
    ("ids", CheckState.FAIL, with_a_double),
    ("heard", CheckState.FAIL, silent),
)


@pytest.mark.parametrize(("name", "state", "spoil"), WRONG, ids=[spoil.__name__ for _, _, spoil in WRONG])
def test_a_check_is_good_until_what_it_is_about_goes_wrong(
    rig: MakeRig, name: str, state: CheckState, spoil: Callable[[Rig], None]
) -> None:
    flight = rig(1).ready()
    assert lines(flight)[name].state not in (state, CheckState.FAIL)
    spoil(flight)
    assert lines(flight)[name].state is state


def test_what_is_on_board_is_ours_or_not(rig: MakeRig, tmp_path: Path) -> None:
    flight = live(rig, tmp_path, 1)
    fence = Plan(PlanKind.FENCE, circle((52.0, 0.0), 300.0))
    said = {
        "fence": (
            (HeldPlan(fence, ours=True), CheckState.OK, "1 shape, as uploaded and read back"),
            (HeldPlan(fence), CheckState.FAIL, "that this station did not put there"),
            (HeldPlan(fence, ours=True, partial=True), CheckState.FAIL, "only its beginning is there"),
            (
                HeldPlan(fence, ours=True, stale="station 252 changed it"),
                CheckState.FAIL,
                "changed: station 252 changed it",
            ),
            (HeldPlan(Plan(PlanKind.FENCE)), CheckState.WARN, "no fence on board"),
            (HeldPlan(), CheckState.UNKNOWN, "not read yet"),
        ),
        "mission": (
            (HeldPlan(MISSION, ours=True), CheckState.OK, "as uploaded and read back"),
            (HeldPlan(MISSION), CheckState.WARN, "that this station did not put there"),
            (
                HeldPlan(MISSION, ours=True, stale="it has 7 items instead of 1"),
                CheckState.FAIL,
                "7 items instead of 1",
            ),
            (HeldPlan(), CheckState.NOT_NEEDED, "none was put on board"),
        ),
    }
    for name, cases in said.items():
        for held, state, text in cases:
            flight.station.services.missions.state(1).held[PlanKind[name.upper()]] = held
            check = lines(flight)[name]
            assert (check.state, text in check.text) == (state, True), check


def test_nothing_is_told_of_vehicles_in_the_air(rig: MakeRig) -> None:
    flight = rig(2).flying().run(2.0)
    assert flight.station.publisher.status().preflight == ()


def test_whatever_a_failsafe_is_about_has_a_check() -> None:
    from tests.core.rigs.vehicles import a_vehicle

    vehicle = a_vehicle()
    assert {line.check for line in explain(vehicle, {}, 255)} == set(FAILSAFES)
    vehicle.autopilot = 12
    assert {line.check for line in explain(vehicle, {}, 255)} == set(FAILSAFES)


# ---------------------------------------------------------------- a start


def test_a_live_start_is_refused_by_name_and_reads_what_it_does_not_know(rig: MakeRig, tmp_path: Path) -> None:
    flight = live(rig, tmp_path)
    reply = flight.ask(m.Start(vehicles=flight.ids))
    assert not reply.ok
    assert {check.name for check in reply.refused_by} == {*FAILSAFES, "fence", "rehearsal", "sign-off"}
    assert "rehearsal: this plan was not rehearsed" in reply.text
    flight.until(lambda: lines(flight)["station-loss"].state is CheckState.FAIL, 10.0, "it was read meanwhile")
    assert flight.phases() == {Phase.GROUND} and not flight.sim.armed.any()


def test_acknowledged_rehearsed_and_signed_it_starts(rig: MakeRig, tmp_path: Path) -> None:
    flight = live(rig, tmp_path)
    read(flight)
    acknowledged(flight)
    rehearsed(flight)
    assert flight.ask(SignOff("Ada", flight.station.active.revision)).ok
    assert refusing(flight.station.frontend.checklist.look(flight.ids), flight.ids) == ()
    assert flight.ask(m.Start(vehicles=flight.ids)).ok
    flight.until(lambda: flight.station.flight.executive.run is RunPhase.RUNNING, 90.0, "running")
    assert any(text.startswith("start signed by Ada") for text in flight.texts("console-1"))
    assert not any("OVERRIDDEN" in text for text in flight.texts())


def test_an_override_names_the_check_and_the_operator_and_is_journalled(rig: MakeRig, tmp_path: Path) -> None:
    flight = live(rig, tmp_path)
    read(flight)
    acknowledged(flight)
    assert not flight.ask(m.Start(vehicles=flight.ids, overrides=("rehearsal",))).ok, "nobody says so"
    assert not flight.ask(m.Start(vehicles=flight.ids, operator="Ada")).ok, "not rehearsed"
    assert flight.ask(m.Start(vehicles=flight.ids, overrides=("rehearsal",), operator="Ada")).ok
    reported = flight.texts("console-1")
    assert any(text.startswith("OVERRIDDEN by Ada for this start: rehearsal: this plan was not") for text in reported)
    assert any(text.startswith("start signed by Ada") and text.endswith("overridden: rehearsal") for text in reported)


def test_an_override_holds_for_one_start(rig: MakeRig, tmp_path: Path) -> None:
    flight = live(rig, tmp_path)
    read(flight)
    acknowledged(flight)
    assert flight.ask(m.Start(vehicles=(1,), overrides=("rehearsal",), operator="Ada")).ok
    reply = flight.ask(m.Start(vehicles=(2,), operator="Ada"))
    assert [check.name for check in reply.refused_by] == ["rehearsal"]


@pytest.mark.parametrize("name", ["battery", "ids", "gps", "heard", "everything", ""])
def test_what_keeps_a_vehicle_on_the_ground_cannot_be_overridden(rig: MakeRig, tmp_path: Path, name: str) -> None:
    flight = live(rig, tmp_path)
    reply = flight.ask(m.Start(vehicles=(1,), overrides=(*OVERRIDABLE, name), operator="Ada"))
    assert not reply.ok and "cannot be overridden" in reply.text


def test_overriding_all_does_not_start_one_without_a_battery(rig: MakeRig, tmp_path: Path) -> None:
    flight = live(rig, tmp_path)
    flight.station.picture.fleet.vehicles[1].telemetry.battery_pct = 12.0
    reply = flight.ask(m.Start(vehicles=(1,), overrides=OVERRIDABLE, operator="Ada"))
    assert not reply.ok and "battery 12 %" in reply.results[0].text


# ---------------------------------------------------------------- the scenario's own checklist

ITEMS = ("props tight", "area clear")


def with_items(flight: Rig) -> None:
    active = flight.station.active
    active.scenario = msgspec.structs.replace(active.scenario, checklist=ITEMS)


def items(flight: Rig) -> list[Check]:
    return [check for check in flight.station.frontend.checklist.look(flight.ids) if check.name == CHECKLIST]


def ready_but_for_items(rig: MakeRig, tmp_path: Path) -> Rig:
    flight = live(rig, tmp_path)
    read(flight)
    acknowledged(flight)
    rehearsed(flight)
    with_items(flight)
    return flight


def test_a_live_start_is_refused_until_every_item_is_ticked(rig: MakeRig, tmp_path: Path) -> None:
    flight = ready_but_for_items(rig, tmp_path)
    reply = flight.ask(m.Start(vehicles=flight.ids, operator="Ada"))
    assert [check.text for check in reply.refused_by] == list(ITEMS)
    assert flight.ask(TickItem("area clear", "Bob")).ok
    assert not flight.ask(SignOff("Ada", flight.station.active.revision)).ok, "an item is open"
    assert [c.text for c in flight.ask(m.Start(vehicles=flight.ids, operator="Ada")).refused_by] == ["props tight"]
    assert flight.ask(TickItem("props tight", "Ada")).ok
    assert flight.ask(m.Start(vehicles=flight.ids, operator="Ada")).ok
    told = flight.texts("console-1")
    assert "checklist: area clear: ticked by Bob" in told and "checklist: props tight: ticked by Ada" in told
    assert any("2 ticked" in text for text in told if text.startswith("start signed by Ada"))


def test_an_item_says_who_ticked_it_and_when(rig: MakeRig, tmp_path: Path) -> None:
    flight = ready_but_for_items(rig, tmp_path)
    flight.ask(TickItem("area clear", "Bob\x1b[2J"))
    (open_one, ticked) = items(flight)
    assert (open_one.text, open_one.state) == ("props tight", CheckState.FAIL)
    assert (ticked.text, ticked.state) == ("area clear", CheckState.TICKED)
    assert ticked.todo.startswith("ticked by Bob") and ticked.todo.endswith("Z") and ticked.todo.isprintable()


def test_a_tick_is_taken_back_and_needs_a_name_and_an_item(rig: MakeRig, tmp_path: Path) -> None:
    flight = ready_but_for_items(rig, tmp_path)
    assert "needs the operator's name" in flight.ask(TickItem("area clear", " ")).text
    assert "the scenario has no such item now" in flight.ask(TickItem("area\nclear", "Ada")).text
    assert flight.ask(TickItem("area clear", "Ada")).ok
    assert flight.ask(TickItem("area clear", "Bob", ticked=False)).ok
    assert flight.ask(TickItem("area clear", "Bob", ticked=False)).ok, "nothing is left to do"
    assert {check.state for check in items(flight)} == {CheckState.FAIL}
    assert [t for t in flight.texts() if "taken back by Bob" in t] == [
        "checklist: area clear: NOT ticked any more, taken back by Bob"
    ]


def test_a_new_start_asks_again(rig: MakeRig, tmp_path: Path) -> None:
    flight = ready_but_for_items(rig, tmp_path)
    for text in ITEMS:
        flight.ask(TickItem(text, "Ada"))
    assert flight.ask(m.Start(vehicles=(1,), operator="Ada")).ok
    assert [c.text for c in flight.ask(m.Start(vehicles=(2,), operator="Ada")).refused_by] == list(ITEMS)


def test_a_restarted_station_asks_again(rig: MakeRig, tmp_path: Path) -> None:
    flight = ready_but_for_items(rig, tmp_path)
    flight.ask(TickItem("area clear", "Ada"))
    flight.restart_station(StateStore(tmp_path / "none.json"))
    flight.ready()
    with_items(flight)
    assert {check.state for check in items(flight)} == {CheckState.FAIL}


def test_open_items_are_overridden_by_name_like_other_checks(rig: MakeRig, tmp_path: Path) -> None:
    flight = ready_but_for_items(rig, tmp_path)
    assert flight.ask(m.Start(vehicles=flight.ids, overrides=(CHECKLIST,), operator="Ada")).ok
    told = flight.texts("console-1")
    assert [t for t in told if t.startswith("OVERRIDDEN")] == [
        f"OVERRIDDEN by Ada for this start: checklist: {text}" for text in ITEMS
    ]


def test_open_items_warn_before_a_simulated_start_and_are_asked_again_after_it(rig: MakeRig) -> None:
    flight = rig(2).ready()
    with_items(flight)
    flight.until(
        lambda: not any(map(flight.station.frontend.readiness.why_not_start, flight.ids)), 60.0, "ready to start"
    )
    assert {check.state for check in items(flight)} == {CheckState.WARN}
    assert flight.ask(TickItem("area clear", "Ada")).ok
    assert flight.ask(m.Start(vehicles=flight.ids)).ok
    assert {check.state for check in items(flight)} == {CheckState.WARN}


def test_another_checklist_needs_no_new_rehearsal(rig: MakeRig, tmp_path: Path) -> None:
    station = live(rig, tmp_path).station
    changed = msgspec.structs.replace(station.active.scenario, checklist=ITEMS)
    assert plan_digest(changed, {}) == plan_digest(station.active.scenario, {})


# ---------------------------------------------------------------- what lapses


def test_a_signature_is_worth_nothing_after_the_scenario_changed_and_after_a_start(
    rig: MakeRig, tmp_path: Path
) -> None:
    flight = live(rig, tmp_path)
    read(flight)
    acknowledged(flight)
    rehearsed(flight)
    station = flight.station
    assert flight.ask(SignOff("Ada", station.active.revision)).ok
    station.active.revision += 1
    assert "the scenario was changed since" in lines(flight)["sign-off"].text
    assert not flight.ask(SignOff("Ada", station.active.revision - 1)).ok, "she has not seen the new one"
    assert flight.ask(SignOff("Ada", station.active.revision)).ok
    assert flight.ask(m.Start(vehicles=(1,))).ok
    assert lines(flight)["sign-off"].state is CheckState.FAIL


def test_nobody_signs_while_something_is_open(rig: MakeRig, tmp_path: Path) -> None:
    flight = live(rig, tmp_path)
    reply = flight.ask(SignOff("Ada", flight.station.active.revision))
    assert not reply.ok and "open are" in reply.text and "rehearsal" in reply.text
    assert not flight.ask(SignOff(" \n", flight.station.active.revision)).ok


def test_an_acknowledgement_is_of_what_was_read_and_ends_when_that_changes(rig: MakeRig, tmp_path: Path) -> None:
    flight = live(rig, tmp_path)
    read(flight)
    acknowledged(flight)
    assert lines(flight)["station-loss"].state is CheckState.ACKNOWLEDGED
    flight.say("PARAM_VALUE", 1, param_id="FS_GCS_ENABLE", param_value=99.0, param_type=2, param_count=1, param_index=0)
    flight.run(1.0)
    worst = lines(flight)["station-loss"]
    assert (worst.state, worst.vehicles) == (CheckState.FAIL, (1,))
    assert "FS_GCS_ENABLE is 99" in worst.text


def fence_put(flight: Rig) -> None:
    """A circle about the first vehicle, on board and read back."""
    here = flight.station.picture.fleet.frame.to_geodetic(0.0, 0.0)
    plan = Plan(PlanKind.FENCE, circle((float(here[0]), float(here[1])), 300.0))
    job = flight.station.services.missions.upload(1, plan)
    flight.until(lambda: job.over, 20.0, "fence is on board")
    assert job.error == ""


def test_what_was_acknowledged_and_uploaded_is_known_after_a_restart_of_the_station(
    rig: MakeRig, tmp_path: Path
) -> None:
    flight = live(rig, tmp_path, 1)
    fence_put(flight)
    job = flight.station.services.missions.upload(1, MISSION)
    flight.until(lambda: job.over, 20.0, "mission is on board")
    read(flight)
    acknowledged(flight)
    assert "as uploaded and read back" in lines(flight)["fence"].text
    StateStore(tmp_path / "memory.json").remember(flight.station.parts, flight.station.frontend)
    flight.restart_station(StateStore(tmp_path / "memory.json"))
    flight.ready()
    found = lines(flight)
    assert (found["station-loss"].state, found["mission"].state) == (CheckState.UNKNOWN,) * 2, "they are read anew"
    read(flight)
    flight.until(lambda: lines(flight)["mission"].state is not CheckState.UNKNOWN, 10.0, "mission read")
    found = lines(flight)
    assert (found["station-loss"].state, found["station-loss"].todo) == (CheckState.ACKNOWLEDGED, "acknowledged by Ada")
    assert (found["fence"].state, found["fence"].text) == (CheckState.OK, "1 shape, as uploaded and read back")
    assert (found["mission"].state, lines(flight)["mission"].state) == (CheckState.OK,) * 2
    flight.station.picture.fleet.vehicles[1].identity.uid = "another airframe"
    assert lines(flight)["station-loss"].state is CheckState.FAIL


def test_who_is_armed_by_hand_is_told_with_what_speaks_against_it(rig: MakeRig, tmp_path: Path) -> None:
    flight = live(rig, tmp_path)
    read(flight)
    assert ask(flight, Arm((1,)), "console-1").ok
    flight.until(lambda: bool(flight.sim.armed[0]), 10.0, "armed")
    reported = [text for text in flight.texts("console-1") if "armed by hand" in text]
    assert any("vehicle 1 is armed by hand although station-loss: " in text for text in reported)
    assert not any("sign-off" in text or "rehearsal" in text for text in reported), "these are about the scenario"


def test_what_is_not_so_cannot_be_acknowledged(rig: MakeRig, tmp_path: Path) -> None:
    flight = live(rig, tmp_path)
    read(flight)
    assert not flight.ask(AcknowledgeCheck("station-loss", "it will be fine", "Ada")).ok
    assert not flight.ask(AcknowledgeCheck("rehearsal", lines(flight)["rehearsal"].text, "Ada")).ok
    assert not flight.ask(AcknowledgeCheck("station-loss", lines(flight)["station-loss"].text, "")).ok


def test_what_is_so_of_more_vehicles_than_the_operator_saw_is_not_acknowledged(rig: MakeRig, tmp_path: Path) -> None:
    flight = live(rig, tmp_path)
    read(flight)
    check = lines(flight)["station-loss"]
    seen, others = check.vehicles[:1], check.vehicles[1:]
    reply = flight.ask(AcknowledgeCheck(check.name, check.text, "Ada", seen))
    assert not reply.ok
    assert reply.text == f"station-loss: found of {id_ranges(others)}, too: look again"
    assert lines(flight)["station-loss"].state is CheckState.FAIL
    assert flight.ask(AcknowledgeCheck(check.name, check.text, "Ada", check.vehicles)).ok


def test_a_failsafe_that_is_set_meanwhile_is_good(rig: MakeRig, tmp_path: Path) -> None:
    flight = live(rig, tmp_path)
    read(flight)
    for vehicle in flight.ids:
        for name, value in SAFE.items():
            flight.station.services.params.set(vehicle, name, value)
    flight.until(lambda: lines(flight)["station-loss"].state is CheckState.OK, 10.0, "set")
    flight.until(lambda: lines(flight)["battery-loss"].state is CheckState.OK, 10.0, "set")


# ---------------------------------------------------------------- rehearsals


def test_exactly_this_plan_was_rehearsed_or_not(rig: MakeRig, tmp_path: Path) -> None:
    flight = live(rig, tmp_path)
    rehearsed(flight, passed=False)
    assert "NOT passed: 39 of 41" in lines(flight)["rehearsal"].text
    rehearsed(flight)
    check = lines(flight)["rehearsal"]
    assert check.state is CheckState.OK and "41 of 41" in check.text
    rehearsed(flight, passed=False, wall_s=1_900_000_000.0)
    assert lines(flight)["rehearsal"].state is CheckState.OK, "harder conditions later take nothing back"
    station = flight.station
    station.active.scenario = msgspec.structs.replace(station.active.scenario, seed=station.active.scenario.seed + 1)
    station.active.revision += 1
    assert lines(flight)["rehearsal"].state is CheckState.FAIL


def test_a_plan_is_the_same_without_its_comments_and_another_with_another_planner() -> None:
    plan = scenario()
    assert plan_digest(plan, {}) == plan_digest(msgspec.structs.replace(plan), {})
    mine = m.PlannerInfo("patrol", "1", (), 5.0, file="mine.py", sha256="ab")
    theirs = msgspec.structs.replace(mine, sha256="cd")
    assert len({plan_digest(plan, {}), plan_digest(plan, {"patrol": mine}), plan_digest(plan, {"patrol": theirs})}) == 3
    moved = msgspec.structs.replace(mine, file="other.py")
    assert plan_digest(plan, {"patrol": moved}) == plan_digest(plan, {"patrol": mine})


def test_a_file_of_rehearsals_that_is_junk_says_nothing(rig: MakeRig, tmp_path: Path) -> None:
    flight = live(rig, tmp_path)
    (tmp_path / "rehearsals.jsonl").write_bytes(b'{"plan": 1}\n\xff\xfe\n[]\n' + b"x" * 5000)
    assert lines(flight)["rehearsal"].state is CheckState.FAIL
    rehearsed(flight)
    assert lines(flight)["rehearsal"].state is CheckState.OK


def test_a_vehicle_whose_own_limit_is_below_the_scenarios_speed_is_named(rig: MakeRig, tmp_path: Path) -> None:
    flight = live(rig, tmp_path)
    read(flight)
    assert lines(flight)["planner"].state is CheckState.OK
    flight.station.services.params.set(flight.ids[0], "WPNAV_SPEED", 500.0)
    flight.until(lambda: lines(flight)["planner"].state is CheckState.WARN, 10.0, "set")
    check = lines(flight)["planner"]
    assert check.text == "flies 5 m/s at most (WPNAV_SPEED), the scenario asks for 8"
    assert check.vehicles == flight.ids[:1] and not check.hard
    assert flight.station.flight.steering.own_limits(flight.ids[0]).speed_m_s == 5.0
