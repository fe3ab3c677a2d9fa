"""Hold, return and land: who is told what, who is left alone and why, and what becomes of the run. No simulator."""

from collections.abc import Callable
from operator import attrgetter

import pytest

from tests.core.rigs.flight_rig import AUTO, BRAKE, GUIDED, LAND, RTL, Watch
from tui_gcs.core.flight.flights import HoldStep, Lost, ReturnStep, Step, TakenOut
from tui_gcs.core.protocol.common import Phase, RunPhase, VehicleResult

Stop = Callable[[Watch, tuple[int, ...]], tuple[VehicleResult, ...]]
STOPS: dict[str, Stop] = {
    "hold": lambda watch, who: watch.executive.hold(who),
    "return": lambda watch, who: watch.executive.go_home(who),
    "land": lambda watch, who: watch.executive.land(who),
}
LOITER = 5
BECOMES = {"hold": Phase.HOLDING, "return": Phase.RETURNING, "land": Phase.LANDING}
OVER = {"hold": RunPhase.HOLD, "return": RunPhase.RETURNING, "land": RunPhase.RETURNING}


def in_flight(count: int = 3) -> Watch:
    """Vehicles 100 m north of their homes, on their layers, for their planner."""
    watch = Watch(count)
    for i in range(1, count + 1):
        watch.flies(i, (50.0 * (i - 1), 100.0, 20.0 + 10.0 * i))
    watch.executive.run = RunPhase.RUNNING
    return watch


def texts(results: tuple[VehicleResult, ...]) -> dict[int, str]:
    return {result.vehicle: f"{'' if result.ok else 'not: '}{result.text}" for result in results}


# ---------------------------------------------------------------- whom it reaches


@pytest.mark.parametrize(
    ("stop", "orders", "text"),
    [
        ("hold", ["to (50, 100, 40)"], "holds"),
        ("return", ["to (50, 0, 40)"], "returns"),
        ("land", ["LAND"], "lands where it is"),
    ],
)
def test_one_that_is_named_is_told_and_nobody_else(stop: str, orders: list[str], text: str) -> None:
    watch = in_flight()
    assert texts(STOPS[stop](watch, (2,))) == {2: text}
    watch.run(0.3)
    assert watch.orders(2)[:1] == orders
    assert watch.orders(1) == watch.orders(3) == []
    assert watch.phases() == [Phase.FLYING, BECOMES[stop], Phase.FLYING]
    assert watch.executive.run is RunPhase.RUNNING


@pytest.mark.parametrize("stop", STOPS)
def test_all_are_those_in_the_air_but_those_that_are_left_out(stop: str) -> None:
    watch = in_flight(4)
    watch.place(4, (150.0, 0.0, 0.0), armed=False, landed_state=1)
    watch.flight(4).enter(Phase.GROUND, 0.0)
    act = {"hold": watch.executive.hold, "return": watch.executive.go_home, "land": watch.executive.land}[stop]
    assert list(texts(act((), (2,)))) == [1, 3]
    assert watch.phases() == [BECOMES[stop], Phase.FLYING, BECOMES[stop], Phase.GROUND]
    assert watch.executive.run is OVER[stop]
    assert act((2,), (2,)) == ()


@pytest.mark.parametrize("stop", STOPS)
def test_a_stop_with_nobody_in_the_air_changes_nothing(stop: str) -> None:
    watch = Watch(2)
    assert STOPS[stop](watch, ()) == () and watch.executive.run is RunPhase.IDLE
    watch.run(1.0)
    assert watch.sent == [] and list(watch.told()) == []


def test_a_hold_that_nobody_asked_for_leaves_a_vehicle_to_its_own_failsafe() -> None:
    watch = in_flight(2)
    watch.vehicle(2).telemetry.custom_mode, watch.vehicle(2).telemetry.system_status = RTL, 5
    assert list(texts(watch.executive.hold((), ordered=False))) == [1]
    assert watch.phases() == [Phase.HOLDING, Phase.FLYING] and watch.flight(1).held_by_station
    watch.run(0.5)
    assert watch.orders(2) == []
    assert list(texts(watch.executive.hold((2,)))) == [2] and watch.run(0.5).orders(2) == ["BRAKE"]


@pytest.mark.parametrize("stop", STOPS)
def test_vehicles_that_nobody_here_can_fly_are_named_and_told_nothing(stop: str) -> None:
    watch = in_flight()
    watch.vehicle(2).type = 1
    why = "not: only ArduCopter and PX4 multicopters can be flown so far"
    assert texts(STOPS[stop](watch, (2,))) == {2: why}
    assert texts(STOPS[stop](watch, ()))[2] == why
    assert watch.orders(2) == [] and watch.flight(2).phase is Phase.FLYING


@pytest.mark.parametrize(("stop", "ok"), [("hold", True), ("return", False), ("land", False)])
def test_where_nobody_knows_who_would_hear_it_only_hold_is_sent(stop: str, ok: bool) -> None:
    watch = in_flight()
    watch.vehicle(2).identity.blocked, watch.vehicle(2).identity.blocked_in_flight = "several vehicles use id 2", True
    waits = f"not: several vehicles use id 2: only hold is sent; the {stop} is kept until it can be done"
    assert texts(STOPS[stop](watch, (2,))) == {2: "holds" if ok else waits}
    watch.run(0.5)
    assert watch.orders(2) == (["BRAKE"] if ok else [])


# ---------------------------------------------------------------- until it shows


def test_land_is_said_until_it_shows_and_then_no_more() -> None:
    watch = in_flight(1)
    watch.executive.land((1,))
    watch.run(20.0)
    said = [words for _, words in watch.sent]
    assert set(said) == {"LAND"} and 25 <= len(said) <= 32, "every 0.4 s for 10 s, then every 2 s"
    assert "land not confirmed after 10 s: still trying" in list(watch.told())
    watch.vehicle(1).telemetry.custom_mode = LAND
    watch.run(1.0).orders(1)
    assert watch.run(5.0).orders(1) == [] and watch.flight(1).phase is Phase.LANDING


def test_a_hold_is_said_until_it_stands() -> None:
    watch = in_flight(1)
    watch.place(1, (0.0, 100.0, 30.0), moving=(5.0, 0.0, 0.0))
    watch.executive.hold(())
    assert watch.run(20.0).orders(1) == ["to (5, 100, 30)"]
    watch.place(1, (6.0, 100.0, 30.0))
    watch.run(1.0).orders(1)
    assert watch.run(5.0).orders(1) == []


@pytest.mark.parametrize(
    ("first", "second"),
    [("hold", "land"), ("land", "hold"), ("return", "land"), ("return", "hold"), ("hold", "return")],
)
def test_the_newer_stop_ends_the_older_one(first: str, second: str) -> None:
    watch = in_flight(1)
    STOPS[first](watch, (1,))
    watch.run(1.0).orders(1)
    STOPS[second](watch, (1,))
    reported = watch.run(2.0).orders(1)
    place = {"hold": "to (0, 100, 30)", "return": "to (0, 0, 30)", "land": "LAND"}[second]
    assert place in reported and set(reported) <= {place, "at most 8 m/s"} and watch.flight(1).phase is BECOMES[second]


# ---------------------------------------------------------------- starts, landings, those in other hands


@pytest.mark.parametrize("stop", STOPS)
def test_a_start_under_way_is_cancelled(stop: str) -> None:
    watch = Watch(1)
    watch.executive.start((1,))
    watch.place(1, (0.0, 0.0, 0.0), armed=True, landed_state=1)
    assert texts(STOPS[stop](watch, (1,))) == {1: "start cancelled"}
    watch.sent.clear()
    assert watch.run(1.0).orders(1) == ["disarm"]
    watch.vehicle(1).telemetry.armed = False
    assert watch.run(2.0).phases() == [Phase.GROUND] and watch.executive.run is RunPhase.IDLE
    assert "start cancelled, disarmed" in list(watch.told())


def test_on_the_ground_nobody_lands() -> None:
    watch = Watch(1)
    assert texts(watch.executive.land((1,))) == {1: "not: is not in the air"}
    assert texts(watch.executive.go_home((1,))) == {1: "not: has no home"}
    watch.vehicle(1).telemetry.home_m = (0.0, 0.0, 0.0)
    assert texts(watch.executive.go_home((1,))) == {1: "not: is not in the air"}
    assert watch.run(1.0).sent == [] and watch.phases() == [Phase.GROUND]


def test_one_that_is_armed_and_does_not_know_where_it_is_can_be_landed() -> None:
    watch = Watch(1)
    watch.place(1, (0.0, 0.0, 0.0), armed=True)
    watch.blind = {1}
    watch.run(2.0)
    assert texts(watch.executive.land((1,))) == {1: "lands where it is"}
    assert watch.run(1.0).orders(1) == ["LAND"]


def test_who_lands_already_is_left_to_it_by_a_return() -> None:
    watch = in_flight(1)
    watch.executive.land((1,))
    assert texts(watch.executive.go_home((1,))) == {1: "is landing already"}
    assert watch.phases() == [Phase.LANDING]


@pytest.mark.parametrize(
    ("step", "mode", "why"),
    [
        (Lost(Phase.FLYING), GUIDED, "is lost: returns when it is heard again"),
        (TakenOut.MODE_LEFT, LOITER, "is flown by its pilot (LOITER): left to the pilot, name it to take it over"),
        (TakenOut.MODE_LEFT, LAND, "its own failsafe or its landing brings it down: not returned"),
        (TakenOut.EMERGENCY, GUIDED, "is in an emergency: left out, name it"),
    ],
)
def test_a_return_of_all_leaves_alone_who_is_out_of_our_hands_and_by_name_it_does_not(
    step: Step, mode: int, why: str
) -> None:
    watch = in_flight(2)
    watch.flight(2).enter(Phase.TAKEN_OUT, watch.clock.now(), step)
    watch.vehicle(2).telemetry.custom_mode = mode
    assert texts(watch.executive.go_home(())) == {1: "returns", 2: f"not: {why}"}
    assert watch.orders(2) == []
    assert texts(watch.executive.go_home((2,))) == {2: "returns"}


@pytest.mark.parametrize("step", [TakenOut.MODE_LEFT, TakenOut.ON_BOARD])
@pytest.mark.parametrize("mode", [GUIDED, AUTO])
def test_a_return_of_all_means_who_flies_a_mission_or_is_flown_by_another_station(step: Step, mode: int) -> None:
    """It was refused, "not under this station's control", which had never been reported."""
    watch = in_flight(2)
    watch.flight(2).enter(Phase.TAKEN_OUT, watch.clock.now(), step)
    watch.vehicle(2).telemetry.custom_mode = mode
    assert texts(watch.executive.go_home(())) == {1: "returns", 2: "returns"}


@pytest.mark.parametrize("stop", STOPS)
def test_a_stop_of_all_leaves_a_vehicle_to_its_pilot_and_one_by_name_takes_it(stop: str) -> None:
    """HOLD ALL took it (LOITER -> BRAKE), RETURN ALL did not."""
    watch = in_flight(2)
    watch.vehicle(2).telemetry.custom_mode = LOITER
    left = "not: is flown by its pilot (LOITER): left to the pilot, name it to take it over"
    assert texts(STOPS[stop](watch, ()))[2] == left
    watch.run(0.5)
    assert watch.orders(2) == []
    assert not texts(STOPS[stop](watch, (2,)))[2].startswith("not")


@pytest.mark.parametrize("stop", ["return", "land"])
def test_one_that_was_lost_when_all_were_sent_down_does_not_fly_on_when_it_is_back(stop: str) -> None:
    watch = in_flight(1)
    watch.flight(1).enter(Phase.TAKEN_OUT, 0.0, Lost(Phase.FLYING))
    watch.vehicle(1).type = 1 if stop == "land" else 2
    assert not any(result.ok for result in STOPS[stop](watch, ()))
    watch.vehicle(1).type = 2
    comes_down = Phase.RETURNING if stop == "return" else Phase.HOLDING
    assert watch.run().phases() == [comes_down] and watch.executive.run is RunPhase.RETURNING


def test_a_stop_ends_what_a_restarted_station_would_have_gone_on_with() -> None:
    for stop in STOPS.values():
        watch = in_flight(1)
        watch.executive.resume_found = True
        stop(watch, (1,))
        assert not watch.executive.resume_found


# ---------------------------------------------------------------- sent home by its planner


def test_a_planner_sends_home_only_what_flies_for_it() -> None:
    watch = in_flight(3)
    watch.flight(2).enter(Phase.HOLDING, 0.0)
    watch.vehicle(3).identity.moved = "heard from another address"
    assert [watch.executive.send_home(i, "planner red") for i in (1, 2, 3, 9)] == [
        "",
        "is not flying for its planner",
        "heard from another address",
        "is not flying for its planner",
    ]
    assert watch.phases() == [Phase.RETURNING, Phase.HOLDING, Phase.FLYING]


# ---------------------------------------------------------------- resume


def test_resume_takes_those_that_fly_for_their_team_and_names_the_others() -> None:
    watch = in_flight(4)
    watch.executive.hold((3,))
    watch.executive.land((4,))
    watch.executive.hold(())
    assert watch.phases() == [Phase.HOLDING] * 4 and watch.executive.run is RunPhase.HOLD
    reply = watch.executive.resume()
    assert (reply.ok, reply.text) == (True, "resume: vehicles 1-2")
    assert texts(reply.results) == {
        1: "resumes",
        2: "resumes",
        3: "not: was held by name: resume it by name",
        4: "not: was landing: resume it by name",
    }
    assert watch.phases() == [Phase.TAKEOFF, Phase.TAKEOFF, Phase.HOLDING, Phase.HOLDING]
    assert watch.run().phases() == [Phase.FLYING, Phase.FLYING, Phase.HOLDING, Phase.HOLDING], "on their layers"
    assert watch.executive.run is RunPhase.RUNNING


def test_who_resumes_below_its_layer_climbs_there_first() -> None:
    watch = in_flight(2)
    watch.place(2, (50.0, 100.0, 33.0), custom_mode=BRAKE)
    watch.executive.hold(())
    watch.executive.resume()
    watch.orders(2)
    watch.vehicle(2).telemetry.custom_mode = GUIDED
    reported = watch.run(1.0).orders(2)
    assert "to (50, 100, 40)" in reported and "at most 8 m/s" in reported
    assert watch.phases() == [Phase.HOLDING, Phase.TAKEOFF], "the one that is ready waits for the other"
    watch.place(2, (50.0, 100.0, 39.2))
    assert watch.run().phases() == [Phase.FLYING, Phase.FLYING]


def test_one_that_does_not_reach_its_layer_is_held() -> None:
    """Its layer is at 30 m: 60 s at the slowest climb that is waited for, and 30 s to spare."""
    watch = in_flight(1)
    watch.place(1, (0.0, 100.0, 25.0))
    watch.executive.hold(())
    watch.executive.resume()
    watch.flight(1).since_s -= 89.0
    assert watch.run(0.5).phases() == [Phase.TAKEOFF]
    assert watch.run(1.0).phases() == [Phase.HOLDING] and "does not reach its layer: holds, 25 of 30 m high" in list(
        watch.told()
    )


def test_while_all_return_only_named_ones_resume() -> None:
    watch = in_flight(2)
    watch.executive.go_home(())
    watch.executive.hold((1,))
    assert watch.executive.resume().text == "the others are returning: resume those that hold by name"
    assert watch.executive.resume((2,)).text == "not resumed"
    assert watch.executive.resume((1, 2)).results == (VehicleResult(2, False, "neither holds nor is flown by hand"),)
    assert watch.phases() == [Phase.HOLDING, Phase.RETURNING]
    reply = watch.executive.resume((1,))
    assert reply.results == (VehicleResult(1, True, "resumes"),), "the one that was held by name, too"
    assert watch.phases() == [Phase.TAKEOFF, Phase.RETURNING]


def test_a_cancelled_start_is_not_resumed() -> None:
    watch = Watch(1)
    watch.executive.start((1,))
    watch.place(1, (0.0, 0.0, 0.0), armed=True, landed_state=1)
    watch.executive.hold(())
    assert watch.executive.resume().text == "no vehicle is holding"
    assert watch.executive.resume((1,)).text == "not resumed"


# ---------------------------------------------------------------- another one, another address, another boot


def test_one_heard_from_another_address_is_told_nothing_but_its_stop() -> None:
    watch = in_flight(2)
    watch.commands.submit(watch.firmware.of(watch.vehicle(1)).change_speed(watch.vehicle(1), 5.0))
    watch.executive.moved(watch.vehicle(1))
    assert watch.flight(1).phase is Phase.TAKEN_OUT and watch.flight(1).step == Lost(Phase.FLYING)
    watch.executive.land((2,))
    watch.executive.moved(watch.vehicle(2))
    watch.sent.clear()
    watch.vehicle(1).identity.identified = watch.vehicle(2).identity.identified = False
    watch.run(2.0)
    assert (watch.orders(1), watch.orders(2)) == ([], ["LAND"]), "a stop is said on"


def test_one_that_was_replaced_is_told_nothing_any_more() -> None:
    watch = in_flight(1)
    watch.executive.land((1,))
    watch.orders(1)
    watch.executive.losses.replaced(watch.vehicle(1))
    assert watch.flight(1).step is TakenOut.REPLACED
    assert watch.run(3.0).orders(1) == [] and watch.flight(1).phase is Phase.TAKEN_OUT


@pytest.mark.parametrize("what", ["moved", "rebooted", "losses.replaced"])
def test_one_in_no_team_is_nobodys_business(what: str) -> None:
    watch = in_flight(1)
    stranger = watch.place(7, (0.0, 0.0, 30.0), armed=True, landed_state=2)
    attrgetter(what)(watch.executive)(stranger)
    assert watch.run(1.0).phases() == [Phase.FLYING] and watch.orders(7) == []


@pytest.mark.parametrize("what", ["moved", "rebooted"])
def test_a_start_ends_with_the_vehicle_it_was_meant_for(what: str) -> None:
    watch = Watch(2)
    watch.executive.start((1,))
    getattr(watch.executive, what)(watch.vehicle(1))
    getattr(watch.executive, what)(watch.vehicle(2))
    why = {"moved": "heard from another address", "rebooted": "rebooted"}[what]
    assert f"not started: {why}" in list(watch.told())
    watch.vehicle(1).telemetry.prearm_ok = True
    assert "arm" not in watch.run(5.0).orders(1) and watch.flight(2).phase is Phase.GROUND


# ---------------------------------------------------------------- out of its mode, out of sight, back again


@pytest.mark.parametrize(
    ("phase", "mode", "stays"),
    [
        (Phase.FLYING, GUIDED, True),
        (Phase.FLYING, RTL, False),
        (Phase.FLYING, BRAKE, False),
        (Phase.HOLDING, BRAKE, True),
        (Phase.HOLDING, LAND, False),
        (Phase.RETURNING, AUTO, False),
        (Phase.LANDING, LAND, True),
        (Phase.LANDING, GUIDED, False),
    ],
)
def test_who_leaves_its_mode_is_in_other_hands(phase: Phase, mode: int, stays: bool) -> None:
    watch = in_flight(1)
    watch.flies(1, (0.0, 100.0, 30.0), phase, custom_mode=mode)
    watch.run()
    assert watch.flight(1).phase is (phase if stays else Phase.TAKEN_OUT)
    if not stays:
        assert any(text.startswith("left its mode (now ") for text in watch.told())
        watch.orders(1)
        assert watch.run(5.0).orders(1) == []


def test_a_mode_that_was_just_asked_for_may_show_later() -> None:
    watch = in_flight(1)
    watch.flies(1, (0.0, 100.0, 30.0), Phase.HOLDING, custom_mode=RTL)
    watch.flight(1).since_s = watch.clock.now()
    assert watch.run(2.9).phases() == [Phase.HOLDING]
    assert watch.run(0.3).phases() == [Phase.TAKEN_OUT]


def test_one_that_is_not_heard_is_out_and_its_stop_is_said_on() -> None:
    watch = in_flight(2)
    watch.executive.land((2,))
    watch.silent = {1, 2}
    watch.run(3.4)
    assert watch.phases() == [Phase.FLYING, Phase.LANDING]
    watch.run(0.4).sent.clear()
    watch.run(2.0)
    assert [flight.step for flight in watch.flights] == [Lost(Phase.FLYING), Lost(Phase.LANDING)]
    assert (watch.orders(1), watch.orders(2)) == ([], ["LAND"])


def test_one_that_is_lost_is_told_nothing_but_stops() -> None:
    watch = in_flight(1)
    watch.silent = {1}
    watch.run(3.0)
    watch.commands.submit(watch.firmware.of(watch.vehicle(1)).change_speed(watch.vehicle(1), 5.0))
    assert watch.run(0.5).orders(1) == ["at most 5 m/s"]
    watch.run(0.2).sent.clear()
    assert watch.phases() == [Phase.TAKEN_OUT] and watch.run(5.0).orders(1) == []


@pytest.mark.parametrize(("phase", "goes_on"), [(Phase.FLYING, True), (Phase.HOLDING, False)])
def test_a_failsafe_while_it_is_stopped_counts_more_than_a_veto_and_less_than_an_order(
    phase: Phase, goes_on: bool
) -> None:
    """It says RTL while a hold is still being said: of the guard's making in FLYING, an operator's in HOLDING."""
    watch = in_flight(1)
    watch.flies(1, (0.0, 100.0, 30.0), phase, moving=(3.0, 0.0, 0.0))
    watch.steering.hold(watch.vehicle(1), ordered=not goes_on)
    watch.place(1, (0.0, 100.0, 30.0), moving=(3.0, 0.0, 0.0), custom_mode=RTL, system_status=5)
    watch.run(1.0).sent.clear()
    watch.run(2.0)
    assert watch.phases() == [Phase.TAKEN_OUT if goes_on else Phase.HOLDING]
    assert watch.orders(1) == ([] if goes_on else ["BRAKE"])


def test_what_it_said_of_its_failsafe_is_told_with_its_mode() -> None:
    watch = in_flight(1)
    now = watch.clock.now()
    watch.vehicle(1).recent_reasons = [(now - 7.0, "Old Failsafe"), (now - 1.0, "Battery Failsafe")]
    watch.vehicle(1).telemetry.custom_mode = RTL
    watch.run()
    assert "left its mode (now RTL): taken out of the mission; it reported: Battery Failsafe" in list(watch.told())


def test_a_cancelled_start_stays_one_when_it_is_stopped_again() -> None:
    watch = Watch(1)
    watch.executive.start((1,))
    watch.place(1, (0.0, 0.0, 0.0), armed=True, landed_state=1)
    for _ in range(3):
        assert (
            texts(watch.executive.hold(())) == {1: "start cancelled"}
            and watch.flight(1).step is HoldStep.START_CANCELLED
        )
        watch.run(0.5)


def test_one_that_is_held_just_when_it_has_landed_is_no_cancelled_start() -> None:
    watch = in_flight(1)
    watch.flies(1, (0.0, 0.0, 0.0), Phase.LANDING, landed_state=1, custom_mode=LAND)
    assert texts(watch.executive.hold((1,))) == {1: "has touched down"}
    assert watch.run(0.5).orders(1) == ["disarm"]


def test_one_without_a_position_is_out_and_that_is_told() -> None:
    watch = in_flight(1)
    watch.blind = {1}
    watch.run(2.9)
    assert watch.phases() == [Phase.FLYING]
    watch.run(0.3)
    assert watch.phases() == [Phase.TAKEN_OUT]
    assert "NO POSITION for 3 s: taken out of the mission" in list(watch.told())


@pytest.mark.parametrize(
    ("step", "mode", "run", "becomes"),
    [
        (Lost(Phase.FLYING), GUIDED, RunPhase.RUNNING, Phase.FLYING),
        (Lost(Phase.TAKEOFF), GUIDED, RunPhase.RUNNING, Phase.FLYING),
        (Lost(Phase.FLYING), GUIDED, RunPhase.HOLD, Phase.HOLDING),
        (Lost(Phase.FLYING), RTL, RunPhase.RUNNING, Phase.HOLDING),
        (Lost(Phase.BY_HAND), GUIDED, RunPhase.RUNNING, Phase.HOLDING),
        (Lost(Phase.HOLDING), GUIDED, RunPhase.RUNNING, Phase.HOLDING),
        (Lost(Phase.RETURNING), GUIDED, RunPhase.RUNNING, Phase.RETURNING),
        (Lost(Phase.RETURNING), RTL, RunPhase.RETURNING, Phase.HOLDING),
        (Lost(Phase.LANDING), LAND, RunPhase.RETURNING, Phase.LANDING),
        (Lost(Phase.LANDING), GUIDED, RunPhase.RETURNING, Phase.HOLDING),
        (Lost(None), GUIDED, RunPhase.HOLD, Phase.HOLDING),
        (TakenOut.MODE_LEFT, GUIDED, RunPhase.RUNNING, Phase.TAKEN_OUT),
        (TakenOut.REPLACED, GUIDED, RunPhase.RUNNING, Phase.TAKEN_OUT),
        (TakenOut.ON_BOARD, AUTO, RunPhase.RUNNING, Phase.TAKEN_OUT),
    ],
)
def test_one_that_is_heard_again_goes_on_or_holds(step: Step, mode: int, run: RunPhase, becomes: Phase) -> None:
    watch = in_flight(1)
    watch.vehicle(1).telemetry.custom_mode = mode
    watch.flight(1).enter(Phase.TAKEN_OUT, watch.clock.now(), step)
    watch.executive.run = run
    watch.executive.tick()
    assert watch.flight(1).phase is becomes
    told_to_hold = becomes is Phase.HOLDING and mode == GUIDED and step != Lost(None)
    assert bool(watch.orders(1)) is told_to_hold


@pytest.mark.parametrize("off_m", [2.5, -2.5])
def test_one_that_comes_back_off_its_layer_holds(off_m: float) -> None:
    watch = in_flight(1)
    watch.place(1, (0.0, 100.0, 30.0 + off_m))
    watch.flight(1).enter(Phase.TAKEN_OUT, watch.clock.now(), Lost(Phase.FLYING))
    watch.executive.tick()
    assert watch.phases() == [Phase.HOLDING]


def test_who_has_not_said_who_it_is_is_not_taken_back() -> None:
    watch = in_flight(1)
    watch.vehicle(1).identity.identified = False
    watch.flight(1).enter(Phase.TAKEN_OUT, watch.clock.now(), Lost(Phase.FLYING))
    assert watch.run(1.0).phases() == [Phase.TAKEN_OUT]
    watch.vehicle(1).identity.identified = True
    assert watch.run().phases() == [Phase.FLYING]


@pytest.mark.parametrize(
    ("resume", "stays", "after_s", "mode", "becomes"),
    [
        (True, "", 0.0, GUIDED, Phase.TAKEOFF),
        (True, "", 10.0, GUIDED, Phase.TAKEOFF),
        (False, "", 0.0, GUIDED, Phase.HOLDING),
        (True, "was held by name", 0.0, GUIDED, Phase.HOLDING),
        (True, "", 11.0, GUIDED, Phase.HOLDING),
        (True, "", 0.0, RTL, Phase.HOLDING),
    ],
)
def test_a_restarted_station_goes_on_only_as_the_scenario_says_and_only_at_once(
    resume: bool, stays: str, after_s: float, mode: int, becomes: Phase
) -> None:
    watch = Watch(1)
    watch.clock.advance(after_s)
    watch.place(1, (0.0, 100.0, 30.0), armed=True, landed_state=2, custom_mode=mode)
    watch.flight(1).stays = stays
    watch.executive.remember_flying(watch.flight(1))
    watch.flight(1).stays = stays
    watch.executive.resume_found = resume
    watch.executive.tick()
    assert watch.phases() == [becomes]
    assert watch.orders(1) == [], "nothing is said in the same moment"
    assert watch.executive.run is (RunPhase.STARTING if becomes is Phase.TAKEOFF else RunPhase.HOLD)


# ---------------------------------------------------------------- down


@pytest.mark.parametrize(
    ("phase", "step", "height_m", "text", "is_alarm"),
    [
        (Phase.LANDING, None, 0.0, "landed and disarmed", False),
        (Phase.TAKEN_OUT, TakenOut.MODE_LEFT, 0.5, "landed and disarmed by itself, or by its pilot", False),
        (Phase.TAKEN_OUT, TakenOut.ON_BOARD, 0.5, "landed and disarmed by its mission on board", False),
        (Phase.TAKEN_OUT, TakenOut.MODE_LEFT, 12.0, "DISARMED IN THE AIR, 12 m high: it falls", True),
        (Phase.TAKEN_OUT, TakenOut.ON_BOARD, 12.0, "DISARMED IN THE AIR, 12 m high: it falls", True),
        (Phase.LANDING, None, 15.0, "DISARMED IN THE AIR, 15 m high: it falls", True),
        (Phase.FLYING, None, 0.0, "DISARMED, no landing was ordered", True),
        (Phase.RETURNING, ReturnStep.TO_LAYER, 30.0, "DISARMED IN THE AIR, 30 m high: it falls", True),
    ],
)
def test_who_disarms_is_down_and_it_is_told_how(
    phase: Phase, step: Step, height_m: float, text: str, is_alarm: bool
) -> None:
    watch = in_flight(1)
    watch.flight(1).enter(phase, watch.clock.now() - 5.0, step)
    watch.place(1, (3.0, 4.0, height_m), armed=False)
    watch.run()
    assert watch.phases() == [Phase.GROUND]
    reported = [event for event in watch.events.since(0) if event.source == "vehicle 1"]
    assert [(event.text, event.severity <= 1) for event in reported] == [(text, is_alarm)]
    assert watch.executive.run is RunPhase.IDLE and watch.run(5.0).orders(1) == []


def touching_down(landed_state: int, height_m: float) -> Watch:
    watch = in_flight(1)
    watch.flight(1).enter(Phase.LANDING, watch.clock.now() - 30.0)
    watch.place(1, (3.0, 4.0, height_m), landed_state=landed_state, custom_mode=LAND)
    return watch


@pytest.mark.parametrize(("landed_state", "height_m"), [(1, 0.1), (4, 0.4), (1, 20.0)])
def test_a_hold_of_one_that_has_just_come_down_is_no_alarm(landed_state: int, height_m: float) -> None:
    """As its own barometer has it, it may be higher; "DISARMED, no landing was ordered" was told of it."""
    watch = touching_down(landed_state, height_m)
    (result,) = watch.executive.hold((1,))
    assert (result.ok, result.text) == (True, "has touched down")
    watch.run(0.5)
    assert watch.orders(1) == (["disarm"] if landed_state == 1 and height_m < 2.0 else ["BRAKE"])
    assert watch.executive.hold((1,))[0].text == "has touched down", "also when it is told again"
    watch.run(2.0)
    watch.place(1, (3.0, 4.0, height_m), armed=False, landed_state=1)
    watch.run()
    assert watch.phases() == [Phase.GROUND]
    reported = [event for event in watch.events.since(0) if event.source == "vehicle 1"]
    assert [(event.text, event.severity <= 1) for event in reported][-1] == (
        "landed and disarmed, held on the ground",
        False,
    )


def test_a_hold_of_one_that_is_still_landing_is_a_hold_and_what_ends_it_an_alarm() -> None:
    watch = touching_down(4, 5.0)
    assert watch.executive.hold((1,))[0].text == "holds"
    watch.run(3.0).place(1, (3.0, 4.0, 0.1), armed=False, landed_state=1)
    assert "DISARMED, no landing was ordered" in watch.run().told()


def test_who_goes_up_again_after_it_was_held_on_the_ground_holds_in_the_air() -> None:
    watch = touching_down(4, 0.5)
    watch.executive.hold((1,))
    watch.place(1, (3.0, 4.0, 3.0), landed_state=2)
    watch.run(3.0).place(1, (3.0, 4.0, 0.1), armed=False, landed_state=1)
    assert "DISARMED, no landing was ordered" in watch.run().told()
