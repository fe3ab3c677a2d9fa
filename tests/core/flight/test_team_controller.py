"""Planners that die, dawdle and lie: vehicles hold, the operator is told, and nobody else notices."""

import json
import math
from collections.abc import Callable
from itertools import pairwise

import msgspec
import pytest

from tests.core.rigs.rig import SPOT, Rig, goto, scenario
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.firmware.ardupilot import ArduCopter
from tui_gcs.core.firmware.base import UNKNOWN_OFF_COURSE_M
from tui_gcs.core.firmware.px4 import Px4Multicopter
from tui_gcs.core.firmware.registry import off_course_m
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4
from tui_gcs.core.motion.course import PositionTarget
from tui_gcs.core.motion.tracking_error import TrackingMonitor
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import ALIVE
from tui_gcs.core.protocol.common import FleetFrame, Intent, Phase, PlannerTask, RunPhase, TeamPlan
from tui_gcs.core.protocol.plan_limits import NOTES_PER_S
from tui_gcs.core.station.fleet_frame import fleet_frame
from tui_gcs.core.station.status import station_status

MakeRig = Callable[..., Rig]


def team(flight: Rig) -> m.TeamStatus:
    return flight.station.publisher.status().teams[0]


# ---------------------------------------------------------------- what they are told


def test_nobody_is_early_or_late_before_it_is_on_its_slot(rig: MakeRig) -> None:
    """A relief that sets off from where it stood was 0.57 s late for a way that nobody waits for it on (PX4, flown)."""
    flight = rig(1).flying()
    own, station = flight.station.flight.flights.by_id[1], flight.station
    own.tracking = TrackingMonitor(lag_s=0.57)

    def lag_s() -> float:
        return fleet_frame(
            1, RunKind.SIM, station.picture.fleet, station.flight.flights, station.flight.steering, flight.clock
        ).lag_s[0]

    own.joined = False
    assert math.isnan(lag_s())
    own.joined = True
    assert lag_s() == 0.57


def test_a_planner_is_told_how_far_the_worst_of_its_autopilots_strays(rig: MakeRig) -> None:
    flight = rig(4).run(2.0)
    station, controller = flight.station, flight.station.active.team_controllers["defend"]
    assert controller.task is not None
    assert controller.task.members == (1, 2, 3, 4)
    assert controller.task.off_course_m == ArduCopter.off_course_m, "told anew when they were heard"
    station.picture.fleet.vehicles[3].autopilot = AUTOPILOT_PX4
    mixed = controller.task_for(station.active.scenario, station.active.round, controller.team, 99)
    assert mixed.off_course_m == Px4Multicopter.off_course_m > ArduCopter.off_course_m
    assert station.comms.firmware.off_course_m((1, 77)) == UNKNOWN_OFF_COURSE_M, "77 was never heard"
    assert max(off_course_m(AUTOPILOT_ARDUPILOT), off_course_m(AUTOPILOT_PX4)) <= UNKNOWN_OFF_COURSE_M


# ---------------------------------------------------------------- late and dead


def test_a_dead_planner_costs_its_vehicles_a_hold_within_three_seconds(rig: MakeRig) -> None:
    whole = scenario(2)
    quick = msgspec.structs.replace(whole.teams[0], planner="waypoints", parameters={})  # designs nothing for a second
    flight = rig(mission=msgspec.structs.replace(whole, teams=(quick,)), wants=None).flying().run(10.0)
    assert team(flight).worker == "running" and all(flight.speed(v) > 5.0 for v in flight.ids)
    flight.end_planners()
    died = flight.clock.now()
    flight.until(lambda: flight.phases() == {Phase.HOLDING}, 3.0)
    assert flight.clock.now() - died >= 2.0 - 0.3, "silent since its last plan"
    assert flight.alerts() == ["planner waypoints silent for 2.0 s: 2 vehicles hold"]
    flight.run(8.0)
    assert all(flight.speed(v) < 0.3 for v in flight.ids)
    assert flight.station.publisher.status().faults == {"planner": 1}
    assert "its vehicles hold: resume, or look why" in flight.station.publisher.status().alarm


@pytest.mark.long
def test_one_teams_planner_is_not_the_other_teams_trouble(rig: MakeRig) -> None:
    def only_attack(frame: FleetFrame, task: PlannerTask) -> list[Intent]:
        return [goto(v, 350.0 + 20 * v, 200.0, task.layers_m[v]) for v in task.members] if task.team == "attack" else []

    flight = rig(8, wants=only_attack).flying()
    controller = flight.station.active.team_controllers["defend"]
    flight.run(1.0)
    real = controller.take
    controller.take = lambda plan: []  # type: ignore[method-assign]  # from now on this team hears nothing
    flight.run(4.0)
    controller.take = real  # type: ignore[method-assign]
    phases = {f.vehicle: f.phase for f in flight.station.flight.flights}
    assert {phases[v] for v in (1, 2, 3, 4)} == {Phase.HOLDING}
    assert {phases[v] for v in (5, 6, 7, 8)} == {Phase.FLYING}


@pytest.mark.long
def test_after_a_hold_for_silence_the_operator_resumes(rig: MakeRig) -> None:
    flight = rig(1).flying()
    flight.planning = False
    flight.run(4.0)
    assert flight.phase(1) is Phase.HOLDING
    flight.planning = True
    flight.run(3.0)
    assert flight.phase(1) is Phase.HOLDING, "not by itself"
    assert flight.ask(m.Resume()).ok
    flight.run(40.0)
    assert flight.place(1)[:2] == pytest.approx((220.0, 200.0), abs=1.0)


def test_a_planner_has_twenty_seconds_for_its_first_plan(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    flight.run(19.0)
    assert flight.phase(1) is Phase.FLYING and flight.speed(1) < 0.3, "it waits on its layer"
    flight.run(3.0)
    assert flight.phase(1) is Phase.HOLDING
    assert len(flight.alerts()) == 1


def test_three_late_steps_in_a_row_are_too_many(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    flight.station.active.team_controllers["defend"].planner._check_step_time = True
    for step_ms in (250.0, 250.0, 50.0, 250.0, 250.0):
        flight.plan(goto(1, *SPOT, 27.0), step_ms=step_ms)
        flight.run(0.2)
    assert flight.phase(1) is Phase.FLYING, "two, a good one, two"
    flight.plan(goto(1, *SPOT, 27.0), step_ms=250.0)
    flight.run(0.2)
    assert flight.phase(1) is Phase.HOLDING
    took = "a step takes 250 ms, may take 200"
    assert flight.alerts() == [f"planner patrol late 3 times in a row ({took}): 1 vehicles hold"]


def test_a_worker_that_goes_in_flight_is_told_as_an_alarm(rig: MakeRig) -> None:
    flight = rig(1)
    alive = flight.bus.alive(ALIVE.format(principal="planner-defend"))
    flight.flying().run(1.0)
    assert team(flight).worker == "running"
    alive.close()
    flight.planning = False
    flight.run(4.0)
    assert flight.alerts()[0] == "planner worker is GONE"
    assert team(flight).worker == "dead"


# ---------------------------------------------------------------- nonsense


@pytest.mark.parametrize("error", ["Traceback ...\nValueError: no zone", "boom", " \n ", "\x1b[31mred\x1b[0m"])
def test_a_planner_that_fails_holds_its_vehicles_and_its_last_line_is_told(rig: MakeRig, error: str) -> None:
    flight = rig(1, planning=False).flying()
    flight.plan(goto(1, *SPOT, 27.0))
    for _ in range(20):
        flight.plan(error=error)
        flight.run(0.2)
    assert flight.phase(1) is Phase.HOLDING
    reported = flight.alerts()
    assert reported and all("\n" not in text and "\x1b" not in text for text in reported)
    if "ValueError" in error:
        assert reported[0] == "planner patrol failed: ValueError: no zone"


def test_a_planner_that_fails_once_goes_on_and_its_vehicles_do_not_hold(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    flight.plan(goto(1, *SPOT, 27.0))
    flight.plan(error="Traceback\n  line 7, in step\nValueError: no \x1b[31mzone", fate="restarts")
    flight.run(6.0)
    assert flight.phase(1) is Phase.FLYING, "it may take as long as for its first plan"
    flight.plan(goto(1, *SPOT, 27.0))
    flight.run(1.0)
    assert flight.alerts() == ["planner patrol failed: ValueError: no ␛[31mzone; it is begun anew"]
    assert team(flight).error.splitlines() == ["Traceback", "  line 7, in step", "ValueError: no ␛[31mzone"]
    assert '"planner_failed":"defend"' in flight.journal.path.read_text()


def test_a_planner_that_fails_again_is_left_alone_until_the_operator_resumes(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    flight.plan(goto(1, *SPOT, 27.0))
    for _ in range(10):
        flight.plan(error="ValueError: no zone", fate="quarantined")
        flight.run(0.1)
    assert flight.phase(1) is Phase.HOLDING
    assert team(flight).worker == "quarantined"
    reason = "planner patrol failed: ValueError: no zone; it is left alone until you change something"
    assert flight.alerts() == [reason]
    asked = flight.ask(m.GetTask(team="defend"), principal="planner-defend")
    assert asked.ok and asked.task is None, "a new worker is not given it either"
    revision = flight.station.active.team_controllers["defend"].task.revision  # type: ignore[union-attr]
    assert flight.ask(m.Resume()).ok
    task = flight.ask(m.GetTask(team="defend")).task
    assert task is not None and task.revision > revision, "the operator wants it to try again"
    flight.run(1.0)
    flight.plan(goto(1, *SPOT, 27.0))
    flight.run(1.0)
    assert flight.speed(1) > 1.0


def test_what_a_planner_keeps_is_given_to_its_next_worker(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    flight.plan(goto(1, *SPOT, 27.0), snapshot=b"first")
    flight.plan(goto(1, *SPOT, 27.0))
    assert flight.ask(m.GetTask(team="defend")).snapshot == b"first"
    flight.plan(snapshot=bytes(3_000_000))
    assert flight.ask(m.GetTask(team="defend")).snapshot == b"first", "too large"
    flight.ask(m.SwitchRound(index=1))
    assert flight.ask(m.GetTask(team="defend")).snapshot == b"", "of another task"


def test_metrics_are_journalled_every_five_seconds(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    for second in range(21):
        flight.plan(goto(1, *SPOT, 27.0), metrics={"reward": float(second), "nan": math.nan})
        flight.run(1.0)
    lines = [json.loads(line) for line in flight.journal.path.read_text().splitlines() if '"metrics"' in line]
    seconds = [line["metrics"]["reward"] for line in lines]
    assert seconds[0] == 0.0 and all(5.0 <= after - before <= 6.0 for before, after in pairwise(seconds)), seconds
    assert len(seconds) >= 4
    assert {line["team"] for line in lines} == {"defend"} and lines[0]["metrics"]["nan"] is None


def test_notes_of_a_planner_are_told_once(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    for _ in range(3):
        flight.plan(notes=("no snapshot: 3 MB \x1b[2J",))
        flight.run(0.5)
    assert flight.texts("planner defend").count("no snapshot: 3 MB ␛[2J") == 1


def test_a_planner_that_says_too_much_is_heard_now_and_then_and_that_is_said(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    controller = flight.station.active.team_controllers["defend"]
    for _ in range(100):
        flight.plan(notes=tuple(f"thought {flight.clock.now():.1f} {k}" for k in range(5)))
        flight.run(0.2)
    reported = [e.text for e in flight.events() if e.source == "planner defend"]
    thoughts = [text for text in reported if "thought" in text]
    assert 5 <= len(thoughts) <= 5 + 20 * NOTES_PER_S + 1, "five at once, then one in ten seconds"
    assert controller.dropped_notes == 500 - len(thoughts)
    status = station_status(flight.station, None, 1)
    assert status.dropped["notes of planners: too many"] == controller.dropped_notes, "an operator sees how many"
    assert [text for text in reported if "too many notes" in text] == [
        "planner patrol: sends too many notes: some are left out"
    ]


def test_a_fast_planner_gets_more_frames_and_late_goes_by_its_own_rate(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    flight.station.active.team_controllers["defend"].planner._check_step_time = True
    for _ in range(4):
        flight.plan(rate_hz=1.0, step_ms=400.0)
        flight.run(0.5)
    assert flight.phase(1) is Phase.FLYING, "400 ms are in time for one step a second"
    before = flight.frame.seq  # type: ignore[union-attr]
    for rate_hz in (20.0, math.nan, 20.0):
        flight.plan(rate_hz=rate_hz)
    flight.run(1.0)
    assert flight.frame.seq - before == pytest.approx(20, abs=1)  # type: ignore[union-attr]
    for _ in range(3):
        flight.plan(rate_hz=20.0, step_ms=60.0)
        flight.run(0.1)
    assert flight.phase(1) is Phase.HOLDING


# ---------------------------------------------------------------- workers that hang


def test_a_worker_that_is_silent_in_flight_is_to_be_killed(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    controller, alive = flight.station.active.team_controllers["defend"], ALIVE.format(principal="planner-defend")
    token = flight.bus.alive(alive)
    flight.plan(goto(1, *SPOT, 27.0))
    flight.run(1.9)
    assert not controller.planner.kill_wanted
    flight.run(0.3)
    assert controller.planner.kill_wanted and flight.phase(1) is Phase.HOLDING
    token.close()
    token = flight.bus.alive(alive)
    flight.run(19.0)
    assert not controller.planner.kill_wanted, "the next one may take its time to configure"
    flight.run(1.5)
    assert controller.planner.kill_wanted
    token.close()


def starve(flight: Rig, seconds: float, share: float) -> None:
    """The worker is silent, because it waits for a processor for that share of the time."""
    planner = flight.station.active.team_controllers["defend"].planner
    for _ in range(round(seconds / 0.1)):
        planner.on_cpu_wait(planner._waited_s + share * 0.1)
        flight.run(0.1)


def alarm(flight: Rig, cause: str) -> list[m.Alarm]:
    return [a for a in flight.station.alarms.alarms() if a.cause == cause and a.state != "over"]


def test_a_worker_without_cpu_time_is_not_killed_and_its_plan_is_flown_on(rig: MakeRig) -> None:
    """Four times in a row it was killed, and each start made the computer busier."""
    flight = rig(1).flying()
    controller = flight.station.active.team_controllers["defend"]
    flight.bus.alive(ALIVE.format(principal="planner-defend"))
    flight.run(2.0)
    flight.planning = False
    starve(flight, 8.0, 0.9)
    assert not controller.planner.kill_wanted
    assert flight.phase(1) is Phase.FLYING, "on its way to a place, where it stays"
    assert len(alarm(flight, "busy")) == 1 and not alarm(flight, "planner-late")
    starve(flight, 14.0, 0.95)
    assert flight.phase(1) is Phase.HOLDING, "but not for ever"
    assert not controller.planner.kill_wanted
    flight.planning = True
    flight.run(12.0)
    assert not alarm(flight, "busy")


def test_a_starved_worker_s_vehicles_hold_before_their_courses_end(rig: MakeRig) -> None:
    """A trajectory of three seconds is flown for as long, and not for twenty."""
    flight = rig(1).flying()
    flight.bus.alive(ALIVE.format(principal="planner-defend"))
    flight.run(30.0)
    flight.planning = False
    x, y, z = flight.place(1)
    line = tuple((x + 0.5 * k, y, z) for k in range(13))
    moving = ((2.0, 0.0, 0.0),) * 13
    now = flight.clock.now()
    flight.plan(Intent(1, "trajectory", t0_s=now, dt_s=0.25, positions_m=line, velocities_m_s=moving))
    starve(flight, 2.5, 1.0)
    assert flight.phase(1) is Phase.FLYING
    starve(flight, 0.6, 1.0)
    assert flight.phase(1) is Phase.HOLDING


def test_a_worker_that_hangs_on_a_computer_that_is_a_little_busy_is_killed(rig: MakeRig) -> None:
    flight = rig(1).flying()
    controller = flight.station.active.team_controllers["defend"]
    flight.bus.alive(ALIVE.format(principal="planner-defend"))
    flight.run(2.0)
    flight.planning = False
    starve(flight, 3.0, 0.3)
    assert controller.planner.kill_wanted and flight.phase(1) is Phase.HOLDING
    assert not alarm(flight, "busy")


def test_a_worker_that_was_begun_anew_is_not_called_ready_before_it_plans(rig: MakeRig) -> None:
    """Flown on real autopilots and a busy computer: resumed while it was ready for 7 s, held again 2 s later."""
    flight = rig(1).flying()
    alive = ALIVE.format(principal="planner-defend")
    token = flight.bus.alive(alive)
    flight.run(1.0)
    token.close()
    flight.planning = False
    flight.run(3.0)
    assert flight.phase(1) is Phase.HOLDING and team(flight).worker == "dead"
    token = flight.bus.alive(alive)
    flight.run(7.0)
    assert team(flight).worker == "late"
    flight.planning = True
    flight.run(1.0)
    assert team(flight).worker == "running"
    token.close()


def test_a_worker_that_is_silent_on_the_ground_is_to_be_killed_and_nobody_is_alarmed(rig: MakeRig) -> None:
    flight = rig(1, planning=False).run(2.0)  # its vehicle is heard, and with it the task it has
    controller = flight.station.active.team_controllers["defend"]
    flight.bus.alive(ALIVE.format(principal="planner-defend"))
    flight.plan()
    flight.run(3.0)
    assert controller.planner.kill_wanted
    assert flight.alerts() == []
    assert "planner worker does not answer: it is ended and started anew" in flight.texts("planner defend")


# ---------------------------------------------------------------- tasks and status


def test_a_new_round_is_a_new_task_and_old_courses_are_flown_until_its_first_plan(rig: MakeRig) -> None:
    flight = rig(2).flying().run(5.0)
    flight.planning = False
    before = flight.ask(m.GetTask(team="defend")).task
    assert flight.ask(m.SwitchRound(index=1)).ok
    task = flight.ask(m.GetTask(team="defend")).task
    assert before is not None and task is not None and task.revision > before.revision
    assert task.zone.shape == flight.scenario.rounds[1].zones[0].shape
    flight.run(2.0)
    assert flight.speed(1) > 2.0, "goes on with its old course"
    flight.plan(goto(1, 240.0, 210.0, 27.0), revision=before.revision)
    assert flight.station.flight.flights.by_id[1].course == PositionTarget((240.0, 210.0, 27.0), 8.0), (
        "or what the old planner wants"
    )
    flight.plan(goto(1, 250.0, 210.0, 27.0))
    flight.plan(goto(1, 260.0, 210.0, 27.0), revision=before.revision)
    assert flight.station.flight.flights.by_id[1].course == PositionTarget((250.0, 210.0, 27.0), 8.0), (
        "until there is a new plan"
    )
    assert flight.station.flight.flights.by_id[2].course is None, "whom that does not name holds"
    assert flight.phase(1) is Phase.FLYING and flight.station.flight.executive.run is RunPhase.RUNNING


def test_slots_of_the_old_task_are_not_slots_of_the_new_one(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    on_slot = Intent(
        1, "goto", position_m=flight.station.picture.fleet.vehicles[1].telemetry.position_m, joined=True, slot="1/1"
    )
    flight.plan(on_slot)
    assert team(flight).on_slot == 1
    before = flight.ask(m.GetTask(team="defend")).task
    assert flight.ask(m.SwitchRound(index=1)).ok and before is not None
    flight.plan(on_slot, revision=before.revision)
    assert team(flight).on_slot == 0, "the older planner says so of a slot of its own"
    flight.plan(on_slot)
    assert team(flight).on_slot == 1


def test_who_hops_from_place_to_place_counts_wherever_it_is_if_it_has_no_slot(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    hops = goto(1, 200.0, 200.0, 27.0)
    for joined, slot, on_slot in ((False, "", 0), (True, "2/4", 0), (True, "", 1)):
        flight.plan(msgspec.structs.replace(hops, joined=joined, slot=slot))
        assert team(flight).on_slot == on_slot
        controller, vehicle = flight.station.active.team_controllers["defend"], flight.station.picture.fleet.vehicles[1]
        error_m = controller._steering.slot_error_m(flight.station.flight.flights.by_id[1], vehicle)
        assert math.isnan(error_m) is bool(on_slot)
    flight.plan(Intent(1, "hold"))
    assert team(flight).on_slot == 0


def test_who_waits_in_reserve_is_on_no_slot_and_not_in_the_ideal(rig: MakeRig) -> None:
    flight = rig(2, planning=False).flying()
    serves = Intent(
        1, "goto", position_m=flight.station.picture.fleet.vehicles[1].telemetry.position_m, joined=True, slot="1/1"
    )
    flight.plan(serves)
    both = team(flight)
    flight.plan(serves, Intent(2, "hold", joined=True, slot="reserve"))
    one = team(flight)
    assert (both.on_slot, both.slots, both.reserve) == (1, 2, 0)
    assert (one.on_slot, one.slots, one.reserve) == (2, 2, 1)
    assert one.ideal_s == pytest.approx(2 * both.ideal_s)
    flight.plan(Intent(1, "hold", joined=True), Intent(2, "hold", joined=True))
    assert team(flight).reserve == 0, "where all are to stand they serve by standing"
    assert team(flight).ideal_s == both.ideal_s


def test_an_old_course_that_leaves_the_new_area_is_not_flown_on(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    flight.plan(goto(1, 590.0, 300.0, 27.0))
    flight.run(0.5)
    round_ = flight.station.active.scenario.rounds[0]
    shape = msgspec.structs.replace(round_.area.shape, centre_m=(200.0, 200.0), width_m=400.0)
    area = msgspec.structs.replace(round_.area, shape=shape)
    zones = tuple(z for z in round_.zones if z.name == "defend")
    changed = msgspec.structs.replace(round_, area=area, zones=zones or round_.zones)
    scenario = msgspec.structs.replace(flight.station.active.scenario, rounds=(changed,))
    flight.station.active.set_scenario(scenario, flight.toml)
    flight.run(1.0)
    assert flight.station.flight.flights.by_id[1].vetoed
    assert flight.station.flight.flights.by_id[1].course is None
    old = flight.station.active.team_controllers["defend"].task.revision - 1  # type: ignore[union-attr]
    flight.plan(goto(1, 200.0, 170.0, 27.0), revision=old)
    flight.run(5.0)
    assert flight.speed(1) < 0.3, "what was vetoed holds"
    flight.plan(goto(1, 200.0, 170.0, 27.0))
    flight.run(2.0)
    assert flight.speed(1) > 1.0


@pytest.mark.long
def test_patrol_reaches_its_slots_and_covers_its_zone(rig: MakeRig) -> None:
    flight = rig(4, wants=None).flying()
    flight.until(lambda: team(flight).on_slot == 4, 60.0, "all on slot")
    flight.run(60.0)
    status = team(flight)
    assert (status.on_slot, status.slots) == (4, 4)
    assert status.coverage == 1.0
    assert status.worst_idleness_s == pytest.approx(status.ratio * status.ideal_s)
    assert 0.0 < status.ratio < 2.0
    assert status.rate_hz == pytest.approx(5.0, abs=0.5)
    assert flight.station.flight.guard.vetoes == {}
    before_s = status.worst_idleness_s
    flight.ask(m.Hold())
    flight.run(30.0)
    status = team(flight)
    assert status.worst_idleness_s > before_s + 10.0, "places wait on while everybody holds"
    assert math.isnan(status.ratio), "nobody patrols: there is nothing to compare"
    flight.ask(m.Return())
    flight.until(lambda: flight.phases() == {m.Phase.GROUND}, 120.0, "all landed")
    assert math.isnan(team(flight).worst_idleness_s)


def test_annotations_and_numbers_are_kept_for_screens(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    drawn = (m.Annotation("polyline", ((0.0, 0.0), (10.0, 10.0))),)
    flight.plan(annotations=drawn, metrics={"period_s": 40.0})
    flight.plan(metrics={"period_s": 41.0})
    assert flight.ask(m.GetPlan()).annotations == {"defend": drawn}, "None means: as before"
    assert team(flight).metrics == {"period_s": 41.0}


def test_plan_type_is_what_travels() -> None:
    plan = TeamPlan("defend", 1, 2, 3.0, intents=(goto(1, 1.0, 2.0, 30.0),))
    assert m.decode(m.encode(plan), TeamPlan) == plan
