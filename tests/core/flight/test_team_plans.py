"""Plans that are nonsense, too many or too large, and plans that the guard vetoes: why is told, and vehicles hold."""

import math
from collections.abc import Callable

import pytest

from tests.core.rigs.rig import SPOT, Rig, goto
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import PLAN
from tui_gcs.core.protocol.common import FleetFrame, Intent, Phase, PlannerTask

MakeRig = Callable[..., Rig]


@pytest.mark.parametrize("payload", [b"", b"\xff", b"junk", m.encode(m.Hold()), b"\x80"])
def test_bytes_that_are_no_plan_are_counted(rig: MakeRig, payload: bytes) -> None:
    flight = rig(1).flying()
    flight.bus.publish(PLAN.format(team="defend"), payload)
    flight.bus.publish(PLAN.format(team="nobody"), payload)
    flight.run(1.0)
    assert flight.station.conditions.dropped == {"plan not understood": 1, "plan of an unknown team": 1}
    assert flight.phase(1) is Phase.FLYING


def test_a_plan_with_too_many_intents_is_not_taken_and_its_vehicles_hold(rig: MakeRig) -> None:
    wanted: list[Intent] = []

    def wants(frame: FleetFrame, task: PlannerTask) -> list[Intent]:
        return wanted or [goto(v, 240.0 + 20 * v, 200.0, task.layers_m[v]) for v in task.members]

    flight = rig(2, wants=wants).flying().run(5.0)
    wanted += [goto(900 + k, math.nan, 0.0, 0.0) for k in range(5000)]
    flight.until(lambda: flight.phases() == {Phase.HOLDING}, 4.0)
    assert flight.alerts()[0] == "planner patrol: more than 64 intents for 2 vehicles: its plan is not taken"
    assert flight.station.flight.guard.vetoes["intents"] >= 1
    assert not flight.station.flight.guard.vetoes["unknown vehicle"]


def test_a_plan_that_is_too_large_is_not_even_decoded(rig: MakeRig) -> None:
    flight = rig(2).run(1.0)
    flight.bus.publish(PLAN.format(team="defend"), bytes(30_000_000))
    flight.run(0.5)
    assert flight.station.conditions.dropped["plan too large"] == 1
    assert any("plan of 30.0 MB: at most 3" in e.text for e in flight.events())


def test_a_plan_of_another_revision_is_not_flown(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    flight.plan(goto(1, *SPOT, 27.0), revision=0)
    flight.plan(goto(1, *SPOT, 27.0), revision=10**9)
    flight.run(5.0)
    assert flight.speed(1) < 0.3
    assert math.dist(flight.place(1)[:2], (45.0, 170.0)) < 1.0


def test_a_plan_may_not_name_vehicles_of_another_team_or_nobodys(rig: MakeRig) -> None:
    flight = rig(8, planning=False).flying()
    flight.plan(goto(5, 50.0, 300.0, 55.0), goto(77, 50.0, 300.0, 55.0), goto(1, 60.0, 170.0, 27.0), team="defend")
    flight.run(3.0)
    assert flight.station.flight.guard.vetoes == {"unknown vehicle": 2}
    assert math.dist(flight.place(5)[:2], (25.0, 170.0)) < 1.0
    assert flight.place(1)[0] > 47.0, "what is its own is flown"
    assert "vehicle 5: planner names vehicle 5, not of its team" in flight.texts("planner defend")


def test_tracks_of_nan_are_vetoed_by_kind(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying().run(0.5)
    nan = (math.nan,) * 3
    flight.plan(Intent(1, "trajectory", t0_s=0.0, dt_s=1.0, positions_m=(nan, nan), velocities_m_s=(nan, nan)))
    flight.plan(Intent(1, "goto", position_m=nan))
    flight.run(1.0)
    assert flight.station.flight.guard.vetoes == {"kind": 2}
    assert flight.sent_to(1, since_s=flight.clock.now() - 1.0) == []
    assert flight.speed(1) < 0.3


def test_a_thousand_plans_a_second_are_vetoed_by_rate_and_then_the_vehicles_hold(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    sent = len(flight.sent)
    for _ in range(60):
        for _ in range(50):
            flight.plan(goto(1, *SPOT, 27.0))
        flight.step()
    assert flight.station.flight.guard.vetoes["rate"] > 2000
    assert len(flight.sent) - sent < 3 * 12.5 + 10, "set-points stay at their 5 Hz"
    assert flight.phase(1) is Phase.HOLDING


def test_a_plan_that_says_hold_holds_until_the_next(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    flight.plan(goto(1, *SPOT, 27.0))
    flight.run(1.5)
    for _ in range(30):
        flight.plan(Intent(1, "hold"))
        flight.run(0.2)
    assert flight.speed(1) < 0.3 and flight.phase(1) is Phase.FLYING
    for _ in range(20):
        flight.plan(goto(1, *SPOT, 27.0))
        flight.run(0.2)
    assert flight.speed(1) > 2.0


# ---------------------------------------------------------------- the guard in between


def test_on_the_way_to_a_place_nobody_is_faster_than_the_limit(rig: MakeRig) -> None:
    """ArduCopter would fly to places at its own 10 m/s."""
    flight = rig(1).flying()
    fastest = 0.0
    for _ in range(30 * 20):
        flight.step()
        fastest = max(fastest, flight.speed(1))
    assert 7.5 < fastest < 8.0 * 1.05
    assert len([f for _, f in flight.sent_to(1, "COMMAND_LONG") if f["command"] == 178]) == 1, "said once"


def test_a_plan_outside_the_area_is_vetoed_the_vehicle_brakes_and_the_next_good_plan_goes_on(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()

    def fly(x: float, y: float, seconds: float) -> None:
        for _ in range(round(seconds / 0.2)):
            flight.plan(goto(1, x, y, 27.0))
            flight.run(0.2)

    fly(300.0, 170.0, 6.0)
    at_veto = flight.place(1)
    fly(700.0, 170.0, 8.0)
    assert flight.station.flight.guard.vetoes["area"] == pytest.approx(40, abs=2)
    assert flight.speed(1) < 0.3
    assert math.dist(at_veto, flight.place(1)) < 17.0
    assert flight.phase(1) is Phase.FLYING
    vetoes = [t for t in flight.texts("vehicle 1") if t.startswith("guard veto")]
    assert vetoes and "outside the operating area" in vetoes[0]
    assert len(vetoes) <= 3, "told, not shouted"
    fly(300.0, 170.0, 4.0)
    assert flight.speed(1) > 4.0, "and on"
    assert flight.station.flight.steering.vetoed_on_slot == 0


@pytest.mark.long
def test_two_sent_to_one_place_never_come_closer_than_the_separation(rig: MakeRig) -> None:
    flight = rig(2, wants=lambda frame, task: [goto(v, 200.0, 200.0, 30.0) for v in task.members]).flying()
    nearest = math.inf
    for _ in range(40 * 20):
        flight.step()
        a, b = flight.place(1), flight.place(2)
        level, upright = math.dist(a[:2], b[:2]), abs(a[2] - b[2])
        nearest = min(nearest, max(level / 10.0, upright / 5.0))
    assert nearest >= 0.95, "1.0 less what a stopping vehicle overshoots"
    assert flight.station.flight.guard.vetoes["separation"] > 0


def test_vetoes_on_slot_are_a_planner_fault(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    for _ in range(5):
        flight.plan(Intent(1, "goto", position_m=(900.0, 0.0, 27.0), joined=True, slot="1/1"))
        flight.run(0.2)
    assert flight.station.publisher.status().faults["refused on slot"] >= 4
