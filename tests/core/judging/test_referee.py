"""The referee, fed by hand: what it counts and what it does not."""

import math

import msgspec
import pytest

from tests.core.rigs.rig import scenario, toml
from tui_gcs.cli.result_table import table
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.judging.referee import Referee
from tui_gcs.core.judging.result_check import ResultCheck
from tui_gcs.core.judging.team_checks import idleness_checks
from tui_gcs.core.judging.zone_measure import ZoneMeasure
from tui_gcs.core.protocol.common import (
    NOWHERE,
    EventClass,
    FleetFrame,
    Freshness,
    JournalEvent,
    Phase,
    PlannerInfo,
    RunPhase,
    StationStatus,
    TeamStatus,
    Vec3,
)
from tui_gcs.core.scenario.load import parse
from tui_gcs.core.scenario.model import Scenario

IDS = (1, 2)


def frame(
    t_s: float,
    places: list[Vec3],
    armed: bool = True,
    phase: Phase = Phase.FLYING,
    ids: tuple[int, ...] = IDS,
    slot_error_m: tuple[float, ...] = (math.nan, math.nan),
    lag_s: tuple[float, ...] = (math.nan, math.nan),
) -> FleetFrame:
    n = len(places)
    nan = (math.nan,) * n
    return FleetFrame(
        seq=int(t_s * 10),
        t_s=t_s,
        wall_s=t_s,
        kind=RunKind.SIM,
        ids=ids[:n],
        team=("defend",) * n,
        autopilot=("ArduCopter",) * n,
        vehicle_type=("quadrotor",) * n,
        mode=("GUIDED",) * n,
        armed=(armed,) * n,
        phase=(phase,) * n,
        freshness=(Freshness.OK,) * n,
        position_m=tuple(places),
        velocity_m_s=((0.0, 0.0, 0.0),) * n,
        heading_deg=nan,
        lat_deg=nan,
        lon_deg=nan,
        alt_amsl_m=nan,
        battery_pct=nan,
        battery_v=nan,
        gps_fix=(3,) * n,
        satellites=(10,) * n,
        age_s=(0.0,) * n,
        heard_age_s=(0.0,) * n,
        loss_pct=(0.0,) * n,
        slot=("",) * n,
        slot_error_m=slot_error_m[:n],
        lag_s=lag_s[:n],
        link=("memory",) * n,
        signing=("unsigned",) * n,
        problem=("",) * n,
        layer_m=nan,
        goal_m=(NOWHERE,) * n,
        goal_radius_m=(0.0,) * n,
        battery_left_s=(math.nan,) * n,
        stop_pending=(False,) * n,
        home_s=(math.nan,) * n,
        camera=(None,) * n,
        gimbal=(None,) * n,
    )


def status(
    on_slot: int, faults: dict[str, int] | None = None, vetoes: dict[str, int] | None = None, reserve: int = 0
) -> StationStatus:
    team = TeamStatus(
        name="defend",
        zone="home",
        role="defend",
        planner="patrol",
        members=IDS,
        worker="running",
        plan_age_s=0.1,
        rate_hz=5.0,
        on_slot=on_slot,
        slots=2,
        worst_idleness_s=math.nan,
        average_idleness_s=math.nan,
        coverage=0.0,
        ideal_s=2.0,
        bound_s=1.0,
        ratio=math.nan,
        metrics={"period_s": 60.0},
        reserve=reserve,
    )
    return StationStatus(
        seq=1,
        t_s=0.0,
        wall_s=0.0,
        kind=RunKind.SIM,
        scenario="x",
        revision=1,
        run=RunPhase.RUNNING,
        round_index=0,
        rounds=("round 1",),
        mission_time_s=0.0,
        heard=2,
        vehicles=2,
        armed=2,
        in_control="",
        teams=(team,),
        faults=faults or {},
        vetoes=vetoes or {},
    )


def referee_of(mission: Scenario) -> Referee:
    """In its first round, nobody on a slot yet."""
    judge = Referee(mission, {"patrol": PlannerInfo("patrol", "3", (), 5.0, judged_by="idleness")})
    judge.started = IDS
    judge.on_frame(frame(0.0, [(45.0, 170.0, 0.0), (45.0, 190.0, 0.0)], armed=False, phase=Phase.GROUND))
    judge.begin_round(mission.rounds[0], 0.0)
    judge.on_status(status(0))
    return judge


@pytest.fixture
def referee() -> Referee:
    return referee_of(scenario(2))


def check(judge: Referee, name: str) -> ResultCheck:
    return next(c for c in judge.result().checks if c.name.endswith(name))


def test_who_waits_in_reserve_does_not_count_in_the_ideal_and_the_table_says_so(referee: Referee) -> None:
    referee.on_status(status(2))
    (both,) = referee.result().rounds
    judge = referee_of(scenario(2))
    judge.on_status(status(2, reserve=1))
    result = judge.result()
    (one,) = result.rounds
    assert (both.n, both.reserve, one.n, one.reserve) == (2, 0, 1, 1)
    assert one.ideal_s == pytest.approx(2 * (both.ideal_s or 0.0), abs=0.02)
    assert "          and 1 in reserve: ideal and ratio are of the 1 that fly" in table(result).splitlines()
    assert "in reserve" not in table(referee.result())


FAR: Vec3 = (300.0, 200.0, 34.0)


def test_separation_is_horizontal_or_vertical(referee: Referee) -> None:
    referee.on_frame(frame(1.0, [(100.0, 200.0, 27.0), (108.0, 200.0, 34.0)]))
    assert check(referee, "separation, x limit").value == pytest.approx(7 / 5), "7 m of height are enough"
    referee.on_frame(frame(1.1, [(100.0, 200.0, 30.0), (108.0, 200.0, 34.0)]))
    assert check(referee, "separation, x limit") == ResultCheck("separation, x limit", False, 0.8, 1.0)


@pytest.mark.parametrize(("apart_m", "shown"), [(4.999, 0.99), (4.9, 0.98), (5.0, 1.0), (5.018, 1.0)])
def test_what_does_not_hold_is_never_rounded_to_where_it_would(referee: Referee, apart_m: float, shown: float) -> None:
    referee.on_frame(frame(1.0, [(100.0, 200.0, 30.0), (101.0, 200.0, 30.0 + apart_m)]))
    judged = check(referee, "separation, x limit")
    assert (judged.value, judged.ok) == (shown, shown >= 1.0)


def test_a_hand_outside_is_a_hundredth_at_least(referee: Referee) -> None:
    referee.on_frame(frame(1.0, [(-0.002, 200.0, 27.0), FAR]))
    assert check(referee, "outside operating area, m") == ResultCheck("outside operating area, m", False, 0.01, 0.0)


def test_nobody_has_no_ideal() -> None:
    (none,) = referee_of(scenario(2)).result().rounds
    assert (none.n, none.ideal_s, none.bound_s) == (0, None, None)
    assert table(referee_of(scenario(2)).result()).splitlines()[4].split() == [
        *("round", "1", "home", "defend", "0", "--", "0.0", "--", "--", "--", "--", "--", "--")
    ]


def test_columns_and_the_ground_do_not_count(referee: Referee) -> None:
    places: list[Vec3] = [(100.0, 200.0, 0.0), (105.0, 200.0, 0.0)]
    referee.on_frame(frame(0.0, places, armed=False, phase=Phase.GROUND))
    for phase in (Phase.TAKEOFF, Phase.LANDING):
        referee.on_frame(frame(1.0, [(x, y, 30.0) for x, y, _ in places], phase=phase))
    referee.on_frame(frame(1.1, [(x, y, 1.0) for x, y, _ in places]))
    assert check(referee, "separation, x limit").value is None


def test_landing_anywhere_else_does_count(referee: Referee) -> None:
    referee.on_frame(frame(0.0, [(100.0, 200.0, 0.0), (120.0, 200.0, 0.0)], armed=False, phase=Phase.GROUND))
    referee.on_frame(frame(1.0, [(100.0, 210.0, 30.0), (101.0, 210.0, 30.0)], phase=Phase.LANDING))
    assert not check(referee, "separation, x limit").ok


def test_outside_area_and_band(referee: Referee) -> None:
    referee.on_frame(frame(1.0, [(-3.0, 200.0, 27.0), FAR]))
    assert check(referee, "outside operating area, m") == ResultCheck("outside operating area, m", False, 3.0, 0.0)
    assert check(referee, "outside altitude band, m").ok
    referee.on_frame(frame(1.1, [(50.0, 200.0, 18.0), FAR]))
    assert check(referee, "outside altitude band, m").value == pytest.approx(2.0)


@pytest.mark.parametrize("east_north_m", [(605.0, 200.0), (300.0, 405.0), (300.0, -5.0)])
def test_every_side_of_the_area_is_one(referee: Referee, east_north_m: tuple[float, float]) -> None:
    referee.on_frame(frame(1.0, [(*east_north_m, 50.0), FAR]))
    assert check(referee, "outside operating area, m").value == 5.0


def test_who_is_lost_and_found_begins_the_measuring_of_its_team_anew(referee: Referee) -> None:
    referee.lose(1, 10.0)
    referee.lose(99, 11.0)  # in no team
    referee.find(1, 12.0)
    assert [(row.round, row.cut_short) for row in referee.result().rounds] == [
        ("round 1", True),
        ("round 1 (1 lost)", True),
        ("round 1 (1 lost) (1 back)", False),
    ]


def test_of_several_that_are_lost_at_once_there_is_one_measure(referee: Referee) -> None:
    """`--lose 3@150 --lose 11@150` gave a row 'round 1 (3 lost)' with no vehicles and no coverage between the two."""
    referee.on_status(status(2))
    referee.on_frame(frame(1.0, [(100.0, 200.0, 27.0), FAR]))
    referee.lose(1, 1.0)
    referee.lose(2, 1.0)
    assert [r.round for r in referee.result().rounds] == ["round 1", "round 1 (1 lost) (2 lost)"]


def test_landing_error_and_who_did_not_land(referee: Referee) -> None:
    referee.on_frame(frame(1.0, [(100.0, 200.0, 27.0), FAR]))
    assert check(referee, "not landed and disarmed").value == 2
    referee.on_frame(frame(2.0, [(45.0, 174.0, 0.0), (45.0, 202.0, 0.0)], armed=False, phase=Phase.GROUND))
    assert check(referee, "not landed and disarmed").ok
    assert check(referee, "landing error, m") == ResultCheck("landing error, m", False, 12.0, 10.0)
    assert check(referee, "vehicles flown").ok


@pytest.mark.parametrize("fault", ["unanswered commands", "refused on slot", "planner", "link"])
def test_every_fault_fails_a_check(referee: Referee, fault: str) -> None:
    referee.on_status(status(0, faults={fault: 1}))
    failed = [c.name for c in referee.result().checks if c.value == 1.0 and not c.ok]
    assert len(failed) == 1 and not referee.result().ok


def test_never_on_slot_is_a_failed_check_and_ends_the_measuring(referee: Referee) -> None:
    for t in range(1, 123):
        referee.on_frame(frame(float(t), [(100.0, 200.0, 27.0), FAR]))
    assert all(measure.done for measure in referee.present())
    assert check(referee, "home: all on slot, s") == ResultCheck(
        "round 1 home: all on slot, s",
        False,
        None,
        120.0,
        "no vehicle was on its slot: does a no-fly zone close its way, or its planner never say `joined`?",
    )
    assert not check(referee, "home: coverage").ok and not check(referee, "home: worst / ideal").ok


def test_on_slot_begins_the_measuring(referee: Referee) -> None:
    referee.on_frame(frame(30.0, [(100.0, 200.0, 27.0), FAR]))
    referee.on_status(status(2))
    assert check(referee, "home: all on slot, s") == ResultCheck("round 1 home: all on slot, s", True, 30.0, 120.0)
    result = referee.result().rounds[0]
    assert (result.n, result.worst_idleness_s, result.avg_idleness_s, result.measured_s) == (2, None, None, 0.0)
    assert result.ideal_s == pytest.approx(math.pi * 80**2 / (2 * 8 * 30), rel=0.01)


def sweep(
    referee: Referee,
    begin_s: int,
    slot_error_m: tuple[float, float],
    lag_s: tuple[float, float],
    velocity_m_s: Vec3 = (0.0, 0.0, 0.0),
) -> None:
    """Over the whole zone in 144 s, a place a second."""
    xy = [(x, y) for x in range(70, 240, 15) for y in range(120, 290, 15)]
    for t, (x, y) in enumerate(xy, begin_s):
        places = [(float(x), float(y), 27.0), FAR]
        at = frame(float(t), places, slot_error_m=slot_error_m, lag_s=lag_s)
        referee.on_frame(msgspec.structs.replace(at, velocity_m_s=(velocity_m_s, velocity_m_s)))


def test_slots_are_judged_after_the_warm_up(referee: Referee) -> None:
    referee.on_status(status(2))
    for t in range(30):
        places = [(100.0, 200.0, 27.0), FAR]
        referee.on_frame(frame(float(t), places, slot_error_m=(7.0, 9.0), lag_s=(3.0, 0.0)))
    assert check(referee, "home: off slot, m").value is None, "not measured yet"
    sweep(referee, 30, (0.5, 1.5), (0.1, math.nan))
    result = referee.result().rounds[0]
    assert (result.off_slot_p95_m, result.off_slot_max_m, result.lag_max_s) == (1.5, 1.5, 0.1)
    assert result.worst_idleness_s == 127.6 and result.avg_idleness_s is not None
    assert 127.6 / 3 < result.avg_idleness_s < 127.6 / 2, "cells are seen one after the other"


def test_vehicles_that_hover_are_neither_early_nor_late(referee: Referee) -> None:
    """Fourteen that watched a zone of 160 m2 from their places, all of it all the time, failed without a figure."""
    referee.on_status(status(2))
    sweep(referee, 0, (0.2, 0.3), (math.nan, math.nan))
    assert not [c.name for c in referee.result().checks if "early or late" in c.name]
    assert check(referee, "home: off slot, m").ok


def test_vehicles_that_fly_and_tell_too_seldom_where_they_are_fail(referee: Referee) -> None:
    referee.on_status(status(2))
    sweep(referee, 0, (0.2, 0.3), (math.nan, math.nan), velocity_m_s=(3.0, 4.0, 0.0))
    late = check(referee, "home: early or late, s")
    assert (late.ok, late.value) == (False, None)


def test_what_95_of_100_distances_from_a_slot_keep_is_told_beside_the_largest(referee: Referee) -> None:
    referee.on_status(status(2))
    sweep(referee, 0, (0.2, math.nan), (-0.2, math.nan))
    for t in range(144, 244):
        off_m = 3.0 if t % 25 == 0 else 0.2
        places = [(100.0, 200.0, 27.0), FAR]
        referee.on_frame(frame(float(t), places, slot_error_m=(off_m, math.nan), lag_s=(-off_m, math.nan)))
    result = referee.result().rounds[0]
    assert (result.off_slot_p95_m, result.off_slot_max_m, result.lag_max_s) == (0.2, 3.0, 3.0)


@pytest.mark.parametrize(
    ("error_m", "late_s", "ok"), [(1.9, -0.4, (True, True)), (2.1, 0.1, (False, True)), (0.3, -0.6, (True, False))]
)
def test_who_does_not_keep_its_slot_fails(
    referee: Referee, error_m: float, late_s: float, ok: tuple[bool, bool]
) -> None:
    referee.on_status(status(2))
    sweep(referee, 1, (0.3, error_m), (0.0, late_s))
    off, lag = check(referee, "home: off slot, m"), check(referee, "home: early or late, s")
    assert (off.value, lag.value) == (error_m, abs(late_s))
    assert (off.ok, lag.ok) == ok


def test_how_well_slots_are_kept_is_the_scenarios_to_say() -> None:
    lines = (("slot_error_max_m = 2.0", "slot_error_max_m = 3.5"), ("slot_lag_max_s = 0.5", "slot_lag_max_s = 0.25"))
    text = toml()
    for before, after in lines:
        assert before in text
        text = text.replace(before, after)
    judge = referee_of(msgspec.structs.replace(scenario(2), results=parse(text).results))
    judge.on_status(status(2))
    sweep(judge, 1, (0.3, 3.4), (0.0, 0.3))
    off, lag = check(judge, "home: off slot, m"), check(judge, "home: early or late, s")
    assert (off.ok, off.limit, lag.ok, lag.limit) == (True, 3.5, False, 0.25)


def test_vetoes_say_for_which_reasons_the_commonest_first(referee: Referee) -> None:
    referee.on_status(status(0, vetoes={"too close": 2, "outside": 40}))
    assert check(referee, "guard vetoes") == ResultCheck("guard vetoes", False, 42.0, 0.0, "outside: 40, too close: 2")


def planner_event(text: str, severity: int) -> JournalEvent:
    return JournalEvent(1, 0.0, 0.0, EventClass.PLANNER, severity, "planner defend", text)


def test_the_first_fault_and_the_first_veto_are_told_with_what_the_station_reported(referee: Referee) -> None:
    referee.on_event(planner_event("a note of the planner", 4))
    referee.on_event(planner_event("vehicle 1: goto without a finite position", 4))
    referee.on_status(status(0, vetoes={"kind": 2}))
    referee.on_event(planner_event("planner mine failed: KeyError: 'wind'; it is begun anew", 1))
    referee.on_status(status(0, {"planner": 1}, vetoes={"kind": 9}))
    referee.on_event(planner_event("planner mine failed: ValueError; it is stopped", 1))
    referee.on_status(status(0, {"planner": 2}, vetoes={"kind": 9}))
    assert check(referee, "guard vetoes").why == "kind: 9; vehicle 1: goto without a finite position"
    assert check(referee, "planner faults").why == "planner mine failed: KeyError: 'wind'; it is begun anew"
    shown = table(referee.result())
    assert "     -- planner mine failed: KeyError: 'wind'; it is begun anew\n" in shown
    assert max(map(len, shown.splitlines())) <= 80


def test_without_faults_and_vetoes_nothing_is_told_of_them(referee: Referee) -> None:
    referee.on_event(planner_event("planner worker has come", 4))
    referee.on_status(status(2))
    assert {check(referee, name).why for name in ("guard vetoes", "planner faults")} == {""}


# ---------------------------------------------------------------- why there is no value


NEVER_ALL = "never all on their slots: 1 of 2 at most had `joined` and were within 5 m of where their intents had them"


def told_why(judge: Referee) -> set[str]:
    return {c.why for c in judge.result().checks if c.why}


def test_what_was_not_measured_says_why() -> None:
    judge = referee_of(scenario(2))
    judge.on_status(status(0))
    assert told_why(judge) == {
        "no vehicle was on its slot: does a no-fly zone close its way, or its planner never say `joined`?"
    }
    assert check(judge, "home: all on slot, s").value is None
    assert "\n     -- no vehicle was on its slot: does" in table(judge.result())
    judge.on_status(status(1))
    assert told_why(judge) == {NEVER_ALL}
    judge.on_status(status(2))
    assert "all on slot, s" not in {c.name for c in judge.result().checks if c.why}
    assert told_why(judge) == {"the zone was never seen whole: 0.0 %"}


def test_a_planner_without_tour_or_slots_is_judged_by_what_was_seen(referee: Referee) -> None:
    """It tells no `period_s`, and gives velocities: there is no place where its vehicles should be."""
    team = msgspec.structs.replace(status(2).teams[0], metrics={})
    referee.on_status(msgspec.structs.replace(status(2), teams=(team,)))
    assert told_why(referee) == {"the zone was never seen whole: 0.0 %"}
    nowhere = (math.nan, math.nan)
    sweep(referee, 1, nowhere, nowhere)
    sweep(referee, 145, nowhere, nowhere)
    round_ = referee.result().rounds[0]
    assert round_.measured_s > 100.0
    assert round_.worst_idleness_s is not None and 100.0 < round_.worst_idleness_s <= 145.0
    names = {c.name for c in referee.result().checks}
    assert "round 1 home: worst / ideal" in names
    assert not {"round 1 home: off slot, m", "round 1 home: early or late, s"} & names


# ---------------------------------------------------------------- what it did not see


def judged(*seqs: int, armed: bool = True, gap_s: float = 0.1) -> Referee:
    referee = Referee(scenario(2))
    for number, seq in enumerate(seqs):
        shot = frame(10.0 + gap_s * number, [(0.0, 0.0, 10.0), (50.0, 0.0, 13.0)], armed=armed)
        referee.on_frame(msgspec.structs.replace(shot, seq=seq))
    return referee


def test_pictures_that_the_bus_lost_are_counted_and_told() -> None:
    result = judged(7, 8, 9, 13, 14).result()
    assert (result.frames, result.frames_lost) == (5, 3)
    assert result.incomplete == "figures are INCOMPLETE: 3 of 8 pictures of the fleet lost"
    assert result.incomplete in table(result)


def test_a_flight_that_was_seen_whole_says_nothing_of_it() -> None:
    result = judged(7, 8, 9).result()
    assert result.incomplete == "" and "INCOMPLETE" not in table(result)


def test_a_restarted_station_counts_anew_and_its_silence_is_told_while_vehicles_fly() -> None:
    assert judged(200, 1, 2, gap_s=3.0).result().frames_lost == 0
    assert "no picture of the fleet for up to 3.0 s" in judged(200, 1, 2, gap_s=3.0).result().incomplete
    assert judged(200, 1, 2, gap_s=3.0, armed=False).result().incomplete == ""


def test_a_zone_that_takes_longer_than_ten_minutes_is_measured_too() -> None:
    """Flown over a lake of 31 ha: one round trip took 1042 s, and warm-up ended after 600 s with 61 % seen."""
    mission = large_zone()
    judge = Referee(mission, {"patrol": PlannerInfo("patrol", "3", (), 5.0, judged_by="idleness")})
    judge.started = IDS
    judge.begin_round(mission.rounds[0], 0.0)
    judge.on_frame(frame(1.0, [(100.0, 200.0, 27.0), FAR]))
    judge.on_status(with_period(2000.0))
    (measure,) = judge.present()
    for t in range(2, 1202, 5):
        judge.on_frame(frame(float(t), [(100.0, 200.0, 27.0), FAR]))
    assert not measure.done, "each slot is flown once in 1000 s"
    judge.on_status(with_period(1e9))
    for t in range(1210, 60_000, 50):
        judge.on_frame(frame(float(t), [(100.0, 200.0, 27.0), FAR]))
    assert measure.done, "a period that cannot be true is not waited for"


def large_zone() -> Scenario:
    """A circle of 140 m, of which two vehicles of 1 m/s see all once in 1026 s at best."""
    whole = parse(toml().replace("radius_m = 80.0", "radius_m = 140.0").replace("speed_m_s = 8.0", "speed_m_s = 1.0"))
    team = msgspec.structs.replace(whole.teams[0], vehicles=IDS)
    return msgspec.structs.replace(whole, teams=(team,), places=whole.places[:2])


def with_period(period_s: float) -> StationStatus:
    team = msgspec.structs.replace(status(2).teams[0], metrics={"period_s": period_s})
    return msgspec.structs.replace(status(2), teams=(team,))


def test_a_round_that_was_too_short_says_from_when_on_it_is_measured(referee: Referee) -> None:
    referee.on_frame(frame(1.0, [(100.0, 200.0, 27.0), FAR]))
    referee.on_status(status(2))
    (measure,) = referee.present()
    measure._grid.full_cover_t = 1.0
    assert check(referee, "home: worst / ideal").why.endswith(": that begins 60 s after all are on their slots")


def test_another_tour_begins_the_warm_up_anew(referee: Referee) -> None:
    """Flown: a tour was led round a lost vehicle and back; what the ways to its slots left out counted as idleness."""
    places = [(100.0, 200.0, 27.0), FAR]
    referee.on_frame(frame(1.0, places))
    referee.on_status(status(2))
    (measure,) = referee.present()
    measure._grid.full_cover_t = 1.0
    for t in range(2, 200):
        if t in (50, 80):
            team = msgspec.structs.replace(status(0 if t == 50 else 2).teams[0], metrics={"period_s": 90.0})
            referee.on_status(msgspec.structs.replace(status(0), teams=(team,)))
        referee.on_frame(frame(float(t), places))
        measured_s = measure.result().measured_s
        assert measured_s == pytest.approx(max(0.0, t - 169.0), abs=1.0), "two slot periods of 45 s after the second"
    assert check(referee, "home: all on slot, s").value == 1.0, "when they were on their slots first stays so"


def test_in_a_strip_worst_idleness_is_compared_with_the_bound() -> None:
    """No plan comes near the ideal there: the gate would be out of reach of all of them."""
    strip = 'shape = "rectangle"\ncentre_m = [300.0, 200.0]\nwidth_m = 560.0\nheight_m = 18.0'
    circle = 'shape = "circle"\ncentre_m = [150.0, 200.0]\nradius_m = 80.0'
    mission = parse(toml().replace(circle, strip, 1))
    measure = ZoneMeasure(mission, mission.rounds[0], mission.rounds[0].zones[0], "defend", 0.0)
    measure._n = 4
    r = measure.result()
    assert r.bound_s is not None and r.ideal_s is not None and r.bound_s > 2.0 * r.ideal_s
    r.worst_idleness_s, r.ratio = 1.2 * r.bound_s, 1.2 * r.bound_s / r.ideal_s
    worst = next(c for c in idleness_checks("s", r, mission.results, "") if "worst" in c.name)
    assert (worst.name, worst.ok, worst.value) == ("s: worst / bound", True, 1.2)
    r.worst_idleness_s = 2.1 * r.bound_s
    assert not next(c for c in idleness_checks("s", r, mission.results, "") if "worst" in c.name).ok


def test_who_is_on_slots_too_late_is_so_when_it_is(referee: Referee) -> None:
    """The figure was the limit plus a frame, 120.1 s, however late they were."""
    for t in range(1, 200):
        referee.on_frame(frame(float(t), [(100.0, 200.0, 27.0), FAR]))
    assert all(measure.done for measure in referee.present())
    referee.on_status(status(2))
    assert check(referee, "home: all on slot, s") == ResultCheck("round 1 home: all on slot, s", False, 199.0, 120.0)
