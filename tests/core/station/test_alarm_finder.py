"""What a flying fleet is in trouble for: found from telemetry and from the station's own state."""

from collections.abc import Iterator
from contextlib import ExitStack
from itertools import chain
from pathlib import Path
from unittest.mock import patch

import pytest

from tests.core.rigs.rig import Rig, scenario, toml
from tests.core.rigs.vehicles import with_fields
from tui_gcs.core.alarms.causes import BY_ID
from tui_gcs.core.firmware.health import (
    BATTERY_STATUS,
    EKF_STATUS_REPORT,
    SYS_STATUS,
    Concern,
    HealthProblem,
    problems_in_flight,
)
from tui_gcs.core.fleet.vehicle import Vehicle, VehicleTelemetry
from tui_gcs.core.flight.flights import TakenOut
from tui_gcs.core.motion.tracking_error import TrackingMonitor
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.alarms import action_words
from tui_gcs.core.protocol.common import Phase
from tui_gcs.core.services.payload.traffic import AdsbTrack


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    """Three vehicles in the air that nobody may move on: tests change what was heard, and put it back."""
    made = Rig(scenario(3), toml(), Path(tmp_path_factory.mktemp("alarms")))
    made.flying().run(3.0)
    yield made
    made.close()


def found(flight: Rig) -> dict[str, list[tuple[object, str]]]:
    """What is wrong now: (with whom, details) by cause."""
    wrong: dict[str, list[tuple[object, str]]] = {}
    for finding in chain.from_iterable(flight.station._alarm_finder.findings(2.0)):
        wrong.setdefault(finding.cause, []).append((finding.subject, finding.text))
    return wrong


def vehicle(flight: Rig, number: int = 2) -> Vehicle:
    """One of them."""
    return flight.station.picture.fleet.vehicles[number]


def test_a_fleet_that_is_well_has_no_alarm(flight: Rig) -> None:
    assert found(flight) == {}
    assert flight.station.alarms.alarms() == ()


def test_batteries_low_critical_and_unknown_with_a_dead_band(flight: Rig) -> None:
    for charge, cause in ((24.4, "battery-low"), (14.9, "battery-critical"), (float("nan"), "battery-unknown")):
        with with_fields(vehicle(flight), battery_pct=charge):
            assert list(found(flight)) == [cause]
    with with_fields(vehicle(flight), battery_pct=26.0):
        assert found(flight) == {}
        with patch.object(flight.station.alarms, "is_up", lambda cause, _: cause == "battery-low"):
            assert found(flight) == {"battery-low": [(2, "26 %")]}


@pytest.mark.parametrize(("state", "cause"), [(2, "battery-low"), (3, "battery-critical"), (4, "battery-critical")])
def test_a_battery_is_as_bad_as_its_vehicle_says(flight: Rig, state: int, cause: str) -> None:
    """Seen on a real PX4 at its BAT_LOW_THR: "battery CRITICAL: vehicle 5  battery low"."""
    health, said = flight.station.services.health, {"charge_state": state, "fault_bitmask": 0, "time_remaining": 0}
    one = vehicle(flight)
    with patch.object(health, "in_flight", lambda v: tuple(of_battery(v, said)) if v is one else ()):
        assert found(flight) == {
            cause: [(2, "battery at its end" if state == 4 else f"{one.telemetry.battery_pct:.0f} %")]
        }


def of_battery(one: Vehicle, said: dict[str, int]) -> Iterator[tuple[Concern, HealthProblem]]:
    return problems_in_flight(one, lambda message: said if message == BATTERY_STATUS else None)


def test_a_low_battery_on_the_ground_is_no_alarm(flight: Rig) -> None:
    with (
        with_fields(vehicle(flight), battery_pct=5.0),
        with_fields(vehicle(flight), armed=False),
        patch.object(flight.station.flight.flights.by_id[2], "phase", Phase.GROUND),
    ):
        assert found(flight) == {}


def test_who_is_armed_has_alarms_whoever_flies_it(flight: Rig) -> None:
    with patch.object(flight.station.flight.flights.by_id[2], "phase", Phase.GROUND):
        with with_fields(vehicle(flight), gps_fix=1):
            assert found(flight)["position"] == [(2, "no GPS fix")]
        with patch.object(Vehicle, "freshness", lambda self, now: m.Freshness.LOST):
            assert (2, "") in found(flight)["lost"]


def test_a_stop_that_is_not_confirmed_names_its_vehicle(flight: Rig) -> None:
    with patch.object(flight.station.comms.commands, "unconfirmed_stops", lambda: [(2, "return")]):
        assert found(flight) == {"stop": [(2, "return")]}


def test_gps_lost_and_poor(flight: Rig) -> None:
    with with_fields(vehicle(flight), gps_fix=1):
        assert found(flight)["position"] == [(2, "no GPS fix")]
    with with_fields(vehicle(flight), position_error_m=24.0):
        assert found(flight) == {"poor-position": [(2, "±25 m")]}


def test_failsafe_on_board(flight: Rig) -> None:
    with with_fields(vehicle(flight), system_status=5):
        assert found(flight) == {"failsafe": [(2, "CRITICAL: a failsafe is active")]}


def test_a_failsafe_tells_what_it_does_and_why_in_the_vehicle_s_own_words(flight: Rig) -> None:
    """As a real ArduCopter said it: two texts just before the heartbeat that shows it."""
    now = flight.clock.now()
    said = [(now - 30.0, "Arm: old"), (now - 0.3, "Battery 1 is low 10.80V used 660 mAh"), (now, "Battery Failsafe")]
    with with_fields(vehicle(flight), system_status=5, custom_mode=6, recent_reasons=said):
        reported = "RTL: Battery 1 is low 10.80V used 660 mAh; Battery Failsafe"
        assert found(flight)["failsafe"] == [(2, reported)]
        with patch.object(flight.clock, "now", lambda: now + 60.0), with_fields(vehicle(flight), recent_reasons=[]):
            assert flight.station._alarm_finder._monitor._failsafe(vehicle(flight), now + 60.0) == reported, (
                "it goes on"
            )
    found(flight)
    with with_fields(vehicle(flight), system_status=5):
        assert found(flight) == {"failsafe": [(2, "CRITICAL: a failsafe is active")]}, "another one, without a word"
    assert found(flight) == {}


def test_a_second_failsafe_says_why_too(flight: Rig) -> None:
    """A real PX4 on its way home from its fence, whose battery was empty then: "LAND: Failsafe activated"."""
    now, signs = flight.clock.now(), flight.station._alarm_finder._monitor
    fence = [(now, "Geofence: exceeding maximum distance to Home"), (now, "Failsafe activated: switching to RTL")]
    more = [(now + 40.0, "Emergency battery level: switching to Land"), (now + 41.0, "Failsafe activated")]
    over = [(now + 60.0, "Radio Failsafe Cleared")]
    with with_fields(vehicle(flight), system_status=5, custom_mode=9, recent_reasons=fence):
        assert signs._failsafe(vehicle(flight), now) == "LAND: Geofence: exceeding maximum distance to Home"
        for after_s, said in ((40.5, more[:1]), (42.0, more), (50.0, more), (61.0, over)):
            with with_fields(vehicle(flight), recent_reasons=fence + said):
                assert signs._failsafe(vehicle(flight), now + after_s) == "LAND: Emergency battery level"
    found(flight)


def test_a_failsafe_without_a_gps_fix_says_so(flight: Rig) -> None:
    """A real PX4 without GPS: its LAND is a descent that drifts, and "Failsafe activated" is all it may say."""
    said = [(flight.clock.now(), "Failsafe activated")]
    bad = {"system_status": 5, "custom_mode": 9, "recent_reasons": said, "position_error_m": float("inf")}
    with with_fields(vehicle(flight), **bad):
        assert found(flight)["failsafe"] == [(2, "LAND without a GPS fix: Failsafe activated")]
    assert found(flight) == {}


def test_who_leaves_says_why_a_fence_for_example(flight: Rig) -> None:
    """A real ArduCopter at its fence: "Circle fence breached", a notice, and RTL; its state is not CRITICAL."""
    one = flight.station.flight.flights.by_id[2]
    with patch.multiple(one, phase=Phase.TAKEN_OUT, step=TakenOut.MODE_LEFT, left_reason="Circle fence breached"):
        assert found(flight)["fence"] == [(2, "GUIDED: Circle fence breached")]
        assert BY_ID["fence"].level is BY_ID["failsafe"].level is BY_ID["battery-critical"].level
    with patch.multiple(one, phase=Phase.TAKEN_OUT, step=TakenOut.MODE_LEFT):
        assert found(flight)["left"] == [(2, "GUIDED")]


def test_who_cannot_fly_as_fast_as_it_is_asked(flight: Rig) -> None:
    slow = TrackingMonitor(asked_m_s=4.2, made_m_s=1.1, crawls_since_s=flight.clock.now() - 6.0)
    with patch.object(flight.station.flight.flights.by_id[2], "tracking", slow):
        assert found(flight) == {"beside": [(2, "flies 1 of 4 m/s")]}
        with patch.object(flight.station.flight.flights.by_id[2], "vetoed", "no"):
            assert list(found(flight)) == ["vetoed"]


EKF = {"flags": 0x33F, "velocity_variance": 0.1, "pos_horiz_variance": 0.1, "pos_vert_variance": 0.1}


def test_a_compass_in_doubt_is_no_lost_position(flight: Rig) -> None:
    """All compasses of a real ArduCopter turned: it flew on within 0.2 m of its way, and did not drift."""

    def told(**report: float) -> list[tuple[Concern, str]]:
        newest = {EKF_STATUS_REPORT: EKF | {"compass_variance": 0.1} | report}
        return [(concern, problem.text) for concern, problem in problems_in_flight(vehicle(flight), newest.get)]

    assert told() == []
    assert told(compass_variance=2.7) == [("health", "EKF: compass does not fit (2.7, should be below 1)")]
    assert told(pos_vert_variance=1.9) == [("height", "EKF: height does not fit (1.9, should be below 1)")]


@pytest.mark.parametrize(("bit", "text"), [(0x4, "compass unhealthy"), (0x40000000, "propulsion unhealthy")])
def test_who_has_no_compass_left_or_no_thrust_is_not_well(flight: Rig, bit: int, text: str) -> None:
    """An ArduCopter whose compasses all failed said nothing but this bit."""
    status = {f"onboard_control_sensors_{word}": 0x6FFFFFFF for word in ("present", "enabled", "health")}
    status["onboard_control_sensors_health"] &= ~bit
    newest = {SYS_STATUS: status}
    assert [p.text for _, p in problems_in_flight(vehicle(flight), newest.get)] == [text]


def test_why_the_last_flight_ended_is_no_reason_in_the_next(flight: Rig) -> None:
    """It lands and disarms in its failsafe, which is never seen to end in flight."""
    now, signs = flight.clock.now(), flight.station._alarm_finder._monitor

    def told(after_s: float, *, in_flight: bool) -> list[str]:
        findings = signs.findings(vehicle(flight), now + after_s, in_flight=in_flight)
        return [finding.text for finding in findings if finding.cause == "failsafe"]

    with with_fields(vehicle(flight), system_status=5):
        with with_fields(vehicle(flight), recent_reasons=[(now, "Battery Failsafe")]):
            assert "Battery Failsafe" in told(0.0, in_flight=True)[0]
        assert told(60.0, in_flight=False) == []
        assert told(600.0, in_flight=True) == ["CRITICAL: a failsafe is active"]
    assert told(601.0, in_flight=True) == []


def test_a_position_of_which_a_px4_says_that_it_has_none(flight: Rig) -> None:
    """Measured: SIM_GPS_USED 0 is GPS_FIX_TYPE_NO_GPS, 0, which is also what nobody has told yet."""
    with with_fields(vehicle(flight), gps_fix=0, position_error_m=float("inf")):
        assert found(flight)["position"] == [(2, "no GPS fix")]
    with with_fields(vehicle(flight), gps_fix=0, position_error_m=float("nan")):
        assert "position" not in found(flight)


@pytest.mark.parametrize(
    ("phase", "mode", "words", "advice"),
    [
        (Phase.RETURNING, 4, "returning", "it returns; too far? its number, c l lands it here"),
        (Phase.LANDING, 9, "landing", "it lands: keep its place clear"),
        (Phase.TAKEN_OUT, 6, "returning", "it returns; too far? its number, c l lands it here"),
        (Phase.TAKEN_OUT, 9, "landing", "it lands: keep its place clear"),
    ],
    ids=["by our order", "landing", "by its own failsafe", "landing by itself"],
)
def test_who_is_on_its_way_down_with_a_low_battery_is_not_to_be_sent_home(
    flight: Rig, phase: Phase, mode: int, words: str, advice: str
) -> None:
    """Seen: "battery CRITICAL: vehicle 2  14 %, landing   → its number, r return"."""
    with (
        with_fields(vehicle(flight), battery_pct=14.0, custom_mode=mode),
        patch.object(flight.station.flight.flights.by_id[2], "phase", phase),
    ):
        assert found(flight)["battery-critical"] == [(2, f"14 %, {words}")]
        (finding,) = [
            f for f in chain.from_iterable(flight.station._alarm_finder.findings(2.0)) if f.cause == "battery-critical"
        ]
        assert action_words(finding.action, {"orders": "c", "return_selected": "r"}) == advice


def test_what_its_own_checks_say_of_a_battery_is_told_so_too(flight: Rig) -> None:
    said = (
        ("battery", HealthProblem("battery critical", True, "battery", is_charge=True)),
        ("health", HealthProblem("gyro", True)),
    )
    with (
        patch.object(flight.station.services.health, "in_flight", lambda v: said if v is vehicle(flight) else ()),
        with_fields(vehicle(flight), battery_pct=40.0, custom_mode=9),
    ):
        assert found(flight)["battery-critical"] == [(2, "40 %, landing")]
        assert found(flight)["health"] == [(2, "gyro, landing")]


def test_outside_the_area(flight: Rig) -> None:
    with with_fields(vehicle(flight), position_m=(-30.0, 100.0, 30.0)):
        assert found(flight)["outside"] == [(2, "by 30 m")]


def test_two_that_are_too_close_are_both_named(flight: Rig) -> None:
    one = vehicle(flight, 1).telemetry.position_m
    with with_fields(vehicle(flight, 3), position_m=(one[0] + 1.5, one[1], one[2])):
        flight.station.flight.monitor.look(flight.station.picture.fleet.vehicles.values())
    wrong = found(flight)
    assert wrong == {"separation": [(1, "2 m from vehicle 3"), (3, "2 m from vehicle 1")]}
    assert found(flight) == {}


def test_one_without_a_position_may_be_too_close_from_afar_and_that_is_said(flight: Rig) -> None:
    """Seen: "TOO CLOSE: vehicle 7: 98 m from vehicle 5", where vehicle 7 had lost its GPS."""
    one, other = vehicle(flight, 1), vehicle(flight, 3)
    x, y, z = one.telemetry.position_m
    with with_fields(other, position_m=(x + 40.0, y, z), position_error_m=float("inf")):
        flight.station.flight.monitor.look(flight.station.picture.fleet.vehicles.values())
        reported = dict(found(flight)["separation"])
    assert reported[1] == "40 m from vehicle 3, known to ±100 m only"


def test_an_aircraft_that_comes_near(flight: Rig) -> None:
    x, y, _ = vehicle(flight).telemetry.position_m
    now, high_m = flight.clock.now(), vehicle(flight).telemetry.alt_amsl_m

    def track(far_m: float, up_m: float) -> AdsbTrack:
        place = (x + far_m, y, high_m + up_m)
        return AdsbTrack(7, "GABCD", place, 0.0, 0.0, place[2], True, 0.0, 0.0, 0.0, 0, 0, False, 1, now)

    traffic = flight.station.services.traffic
    with patch.object(traffic, "tracks", lambda: (track(900.0, 100.0), track(100.0, 900.0))):
        assert (2, "GABCD at 0.9 km") in found(flight)["traffic"]
    with patch.object(traffic, "tracks", lambda: (track(5000.0, 0.0), track(100.0, 900.0))):
        assert found(flight) == {}


def test_a_failed_link_is_the_cause_of_the_silence(flight: Rig) -> None:
    link = next(iter(flight.station.comms.links.values()))
    with (
        patch.object(link, "error", "no such device", create=True),
        patch.object(Vehicle, "freshness", lambda self, now: m.Freshness.LOST),
    ):
        wrong = found(flight)
    assert [subject for subject, _ in wrong["link-lost"]] == [1, 2, 3]
    assert wrong["link"] == [(link.name, "no such device")]
    assert "lost" not in wrong


def test_nothing_is_recorded(flight: Rig) -> None:
    with patch.object(flight.station.records.recorder, "error", "run.tlog: No space left on device"):
        assert found(flight)["recording"] == [("station", "run.tlog: No space left on device")]


def test_what_was_forgotten_or_cannot_be_kept_and_that_nobody_starts_it_again(flight: Rig) -> None:
    conditions = flight.station.conditions
    with patch.multiple(conditions, memory_lost="it is damaged", memory_error="No space left", orphaned=True):
        wrong = found(flight)
    assert wrong["memory"] == [("station", "it is damaged")]
    assert wrong["recording"] == [("station", "No space left")]
    assert wrong["supervisor"] == [("station", "")]


def test_a_dead_planner_counts_while_its_vehicles_fly(flight: Rig) -> None:
    with patch.object(flight.station.active.team_controllers["defend"], "worker_state", lambda: "dead"):
        assert found(flight)["planner"] == [("defend", "patrol is dead")]
        for one in flight.station.flight.flights:
            one.phase = Phase.GROUND
        grounded = found(flight)
        for one in flight.station.flight.flights:
            one.phase = Phase.FLYING
        assert "planner" not in grounded


def test_a_late_planner_s_vehicles_fly_and_a_failed_one_s_hold_until_it_is_mended(flight: Rig) -> None:
    """Seen on a busy machine: "its vehicles hold: Enter resume" over vehicles that flew; Enter did not help."""
    controller = flight.station.active.team_controllers["defend"]
    with patch.object(controller, "worker_state", lambda: "late"):
        assert found(flight) == {"planner-late": [("defend", "patrol is late")]}
        with ExitStack() as held:
            for one in flight.station.flight.flights:
                held.enter_context(patch.object(one, "phase", Phase.HOLDING))
            assert found(flight)["planner"] == [("defend", "patrol is late")]
    why = "ValueError: paths: '2:' is not EAST,NORTH in metres"
    with (
        patch.object(controller, "worker_state", lambda: "quarantined"),
        patch.object(controller.planner, "error", why),
    ):
        assert found(flight) == {"planner-failed": [("defend", f"patrol: {why}")]}
    assert "resume" not in BY_ID["planner-failed"].action
    assert "vehicles hold:" not in BY_ID["planner-late"].action


def test_who_flies_at_another_is_told_of_with_both_named(flight: Rig) -> None:
    """A pilot has taken vehicle 2, and flies it at vehicle 1, which is on its way to meet it."""
    assert flight.station._alarm_finder._next_closing_s <= flight.clock.now() + 1.0, "looked for again and again"
    x, y, z = vehicle(flight, 1).telemetry.position_m
    second = vehicle(flight).telemetry
    with (
        with_fields(vehicle(flight), position_m=(x + 60.0, y, z)),
        patch.object(VehicleTelemetry, "velocity_m_s", property(lambda t: (-8.0 if t is second else 0.0, 0.0, 0.0))),
        patch.object(flight.station.flight.flights.by_id[2], "phase", Phase.TAKEN_OUT),
        patch.object(flight.station._alarm_finder, "_next_closing_s", 0.0),
    ):
        wrong = found(flight)
    assert [subject for subject, _ in wrong["closing"]] == [1, 2]
    assert wrong["closing"][0][1] == "4 m from vehicle 2 in 4 s"
    with patch.object(flight.station._alarm_finder, "_next_closing_s", 0.0):
        assert found(flight) == {}


def test_when_nobody_is_heard_any_more_on_the_ground_either_that_is_told(flight: Rig) -> None:
    on_ground = [with_fields(vehicle(flight, v), armed=False) for v in (1, 2, 3)]
    on_ground += [patch.object(flight.station.flight.flights.by_id[v], "phase", Phase.GROUND) for v in (1, 2, 3)]
    with ExitStack() as stack:
        for one in on_ground:
            stack.enter_context(one)
        assert found(flight) == {}
        stack.enter_context(patch.object(Vehicle, "freshness", lambda self, now: m.Freshness.LOST))
        assert found(flight) == {"silence": [("station", "all 3 are LOST")]}


def test_who_holds_alone_and_what_takes_him_on(flight: Rig) -> None:
    """Enter resumes all but those who were held by name, and nobody while the fleet goes home."""
    two, executive = flight.station.flight.flights.by_id[2], flight.station.flight.executive
    with patch.object(two, "phase", Phase.HOLDING):
        assert found(flight) == {"holds": [(2, "")]}
        with patch.object(two, "stays", "was held by name"):
            assert found(flight) == {"stays": [(2, "")]}
        with patch.object(executive, "run", m.RunPhase.RETURNING):
            assert found(flight) == {"stays": [(2, "")]}
        with patch.object(executive, "run", m.RunPhase.HOLD):
            assert found(flight) == {"hold": [(2, "")]}


def test_who_is_not_where_its_plan_has_it_is_told(flight: Rig) -> None:
    """8 m beside it in a light wind, real ones told nobody; others were planned around places where they were not."""
    of_two = flight.station.flight.flights.by_id[2]

    def off(beside_m: float, late_s: float = 0.1) -> dict[str, list[tuple[object, str]]]:
        with patch.object(of_two, "tracking", TrackingMonitor(cross_m=beside_m, lag_s=late_s)):
            return found(flight)

    assert off(6.2) == {}, "on its way to its slot it may be anywhere"
    with patch.object(of_two, "joined", True):
        assert off(1.9, 0.9) == {}, "late by a slow link, perhaps"
        assert off(6.2) == {"beside": [(2, "6 m beside its way")]}
        assert off(0.5, 1.4) == {"beside": [(2, "1.4 s late")]}
        assert off(0.5, -1.4) == {"beside": [(2, "1.4 s early")]}
        with patch.object(flight.station.alarms, "is_up", lambda cause, _: cause == "beside"):
            assert off(1.6) == {"beside": [(2, "2 m beside its way")]}, "it goes when it is clearly better"
        assert off(float("nan"), float("nan")) == {}


def test_requests_are_answered_between_the_vehicles_of_a_big_fleet(flight: Rig) -> None:
    """A stop waited for up to 30 ms of CPU time while 250 vehicles were looked at."""
    with patch("tui_gcs.core.station.alarm_finder.VEHICLES_AT_ONCE", 1), with_fields(vehicle(flight), battery_pct=9.0):
        pieces = list(flight.station._alarm_finder.findings(2.0))
    by_piece = [[finding.cause for finding in piece] for piece in pieces if piece]
    assert by_piece == [["battery-critical"]] and len(pieces) >= 3 + len(flight.ids)
