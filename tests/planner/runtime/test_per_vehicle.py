"""Planners that run once on each vehicle: what an instance sees and hears, and what becomes of one that fails."""

import math
from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tui_gcs.core.protocol.common import Freshness, PlannerTask, TeamPlan, decode
from tui_gcs.core.scenario.model import Communication
from tui_gcs.planner.api import Context, Intent, Output, Planner
from tui_gcs.planner.check.subject import comparable_bytes
from tui_gcs.planner.runtime import registry
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.kinematic_fleet import TEAM, KinematicFleet, task_for

Rule = Callable[["Talker", Context], Output]


class Talker(Planner):
    """Notes what it sees, says its step to all, and holds; a test gives it another rule."""

    name = "talker"
    instances = "per_vehicle"
    rule: Rule | None = None
    seen: dict[int, list[Context]] = {}

    def configure(self, task: PlannerTask, params: Any, rng: np.random.Generator) -> None:
        super().configure(task, params, rng)
        self.steps = 0

    def step(self, ctx: Context) -> Output:
        self.steps += 1
        self.seen.setdefault(self.task.vehicle, []).append(ctx)
        if Talker.rule is not None:
            return Talker.rule(self, ctx)
        ctx.broadcast({"step": self.steps, "luck": float(ctx.rng.random())})
        return holds(ctx)

    def snapshot(self) -> bytes:
        return str(self.steps).encode()

    def restore(self, data: bytes) -> None:
        self.steps = int(data)


def holds(ctx: Context) -> Output:
    """Let all active vehicles in sight hold, others' too."""
    heard = [m.payload["step"] for m in ctx.messages if isinstance(m.payload, dict)]
    return Output([Intent(int(v), "hold", reason=f"{heard}") for v in ctx.fleet.id[ctx.fleet.active]])


@pytest.fixture(autouse=True)
def talker(monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setattr(Talker, "rule", None)
    monkeypatch.setattr(Talker, "seen", {})
    return registry.register_class(Talker)


def world_of(count: int = 3, apart_m: float = 50.0, **communication: float) -> KinematicFleet:
    """Return vehicles in a row, 50 m apart."""
    task = task_for(range(1, count + 1), "file:talker", seed=5)
    task = msgspec.structs.replace(task, communication=Communication(**communication))
    return KinematicFleet(task, np.array([(50.0 + apart_m * i, 100.0) for i in range(count)]))


def flown(world: KinematicFleet, steps: int, host: PlannerHost | None = None) -> list[TeamPlan]:
    """Step a host this often, at 5 Hz."""
    if host is None:
        host = PlannerHost(TEAM)
        host.set_task(world.task)
    plans = []
    for _ in range(steps):
        plans.append(decode(host.answer(world.frame()), TeamPlan))
        world.move(0.2)
    return plans


def test_an_instance_sees_itself_and_the_neighbours_within_range() -> None:
    flown(world_of(3, range_m=60.0), 2)

    assert Talker.seen[1][1].fleet.id.tolist() == [1, 2]
    assert Talker.seen[2][1].fleet.id.tolist() == [1, 2, 3]
    assert Talker.seen[2][1].fleet.own.tolist() == [False, True, False]


def test_messages_arrive_in_the_next_step_and_only_within_range() -> None:
    flown(world_of(3, range_m=60.0), 3)

    assert [m.sender for m in Talker.seen[1][0].messages] == []
    assert [(m.sender, m.payload["step"]) for m in Talker.seen[2][1].messages] == [(1, 1), (3, 1)]
    assert [m.sender for m in Talker.seen[1][2].messages] == [2]


def test_intents_are_kept_for_the_own_vehicle_only() -> None:
    plan = flown(world_of(3), 1)[0]

    assert [intent.vehicle for intent in plan.intents] == [1, 2, 3]


@pytest.mark.parametrize(("loss", "least", "most"), [(0.0, 1.0, 1.0), (0.3, 0.6, 0.8), (1.0, 0.0, 0.0)])
def test_losses_are_the_share_that_the_scenario_says(loss: float, least: float, most: float) -> None:
    metrics = flown(world_of(4, loss=loss), 60)[-1].metrics

    delivered, lost = metrics["messages_delivered"], metrics["messages_lost"]
    assert least <= delivered / (delivered + lost) <= most
    assert metrics["messages_sent"] == 4 * 60


def test_with_range_0_or_all_lost_every_vehicle_is_alone() -> None:
    for communication in ({"range_m": 0.0}, {"loss": 1.0}):
        Talker.seen.clear()
        flown(world_of(3, **communication), 10)
        assert all(ctx.fleet.id.tolist() == [v] for v, contexts in Talker.seen.items() for ctx in contexts)
        assert all(not ctx.messages for contexts in Talker.seen.values() for ctx in contexts)


def test_a_delay_holds_messages_and_beacons_back() -> None:
    flown(world_of(2, delay_s=1.0), 8)

    first = next(k for k, ctx in enumerate(Talker.seen[1]) if ctx.messages)
    assert first == 5
    assert Talker.seen[1][first].messages[0].payload["step"] == 1
    ages = Talker.seen[1][first].fleet.age_s
    assert ages.tolist() == pytest.approx([0.05, 1.05])


def test_a_neighbour_that_is_lost_fades_after_3_s() -> None:
    world = world_of(2)
    host = PlannerHost(TEAM)
    host.set_task(world.task)
    flown(world, 1, host)
    world.freshness = {2: Freshness.LOST}
    world.blind = {2}
    flown(world, 20, host)

    known = [len(ctx.fleet.id) for ctx in Talker.seen[1]]
    assert known[10] == 2
    assert known[-1] == 1
    assert len(Talker.seen[2]) == 1


def test_the_same_seed_gives_the_same_flight_and_another_seed_another_one() -> None:
    def run(seed: int) -> list[bytes]:
        world = world_of(5, loss=0.3, delay_s=0.3)
        world.task = msgspec.structs.replace(world.task, seed=seed)
        return [comparable_bytes(plan) for plan in flown(world, 30)]

    assert run(5) == run(5)
    assert run(5) != run(6)


def test_a_restored_team_goes_on_bit_by_bit() -> None:
    world = world_of(4, loss=0.3, delay_s=0.5)
    host = PlannerHost(TEAM)
    host.set_task(world.task)
    flown(world, 12, host)
    kept, t_s, seq = host.snapshot(), world.t_s, world._seq
    expected = [comparable_bytes(plan) for plan in flown(world, 10, host)]

    other = PlannerHost(TEAM)
    other.set_task(world.task, kept)
    world.t_s, world._seq = t_s, seq
    assert [comparable_bytes(plan) for plan in flown(world, 10, other)] == expected


def failing(how: Callable[[Context], object]) -> Rule:
    """Return a rule in which vehicle 2's instance does this in every step."""

    def rule(planner: Talker, ctx: Context) -> Output:
        return how(ctx) if planner.task.vehicle == 2 else holds(ctx)  # type: ignore[return-value]

    return rule


def loops_forever(_ctx: Context) -> object:
    while True:
        try:
            while True:
                pass
        except Exception:  # noqa: BLE001 - as hostile as it gets
            pass


HOSTILE: dict[str, Callable[[Context], object]] = {
    "raises": lambda _ctx: 1 / 0,
    "exits": lambda _ctx: exec("raise SystemExit"),
    "no output": lambda _ctx: 3,
    "kind of intent": lambda _ctx: Output([Intent(2, "fly")]),  # type: ignore[arg-type]
    "huge reason": lambda _ctx: Output([Intent(2, "hold", reason="x" * 10_000_000)]),
    "object as payload": lambda ctx: Output(notes=[str(ctx.broadcast(object()))]),
    "loops forever": loops_forever,
}


@pytest.mark.parametrize("how", HOSTILE)
def test_a_failing_instance_is_restarted_once_and_then_holds_its_vehicle_alone(
    how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tui_gcs.planner.runtime.vehicle_instance.STEP_LIMIT_S", 0.05)
    Talker.rule = failing(HOSTILE[how])
    plans = flown(world_of(3), 5)

    assert not any(plan.error for plan in plans)
    assert "vehicle 2: its planner instance failed" in plans[0].notes[0]
    assert "it is restarted" in plans[0].notes[0]
    assert "its vehicle holds" in plans[1].notes[0]
    intents = {intent.vehicle: intent for intent in plans[-1].intents}
    assert intents[2].kind == "hold"
    assert "its planner instance failed" in intents[2].reason
    assert intents[1].reason == intents[3].reason == "[]"
    assert plans[-1].metrics["instances_failed"] == 1.0


def test_messages_that_may_not_be_sent_are_dropped_counted_and_named() -> None:
    results: list[bool] = []

    def rule(planner: Talker, ctx: Context) -> Output:
        if planner.task.vehicle == 1:
            results.extend((ctx.send(99, "who"), ctx.broadcast("x" * 5000), ctx.send(2, "ok")))
            results.extend(ctx.send(2, k) for k in range(30))
        return Output()

    Talker.rule = rule
    plans = flown(world_of(2), 2)

    assert results[:3] == [False, False, True]
    assert "vehicle 1: messages are dropped: no vehicle 99 in the team" in plans[0].notes
    assert "vehicle 1: messages are dropped: larger than 1000 bytes" in plans[0].notes
    assert any("more than 20 per second" in note for note in plans[0].notes)
    assert plans[1].metrics["messages_dropped"] == results.count(False)
    assert Talker.seen[2][1].messages[0].payload == "ok"


def test_where_all_instances_fail_the_planner_is_stopped_as_one_that_fails() -> None:
    Talker.rule = failing(lambda _ctx: 1 / 0)
    world = world_of(2)
    Talker.rule = lambda _planner, _ctx: 1 / 0  # type: ignore[assignment, return-value]
    plans = flown(world, 8)

    assert plans[-1].fate == "quarantined"
    assert "ZeroDivisionError" in plans[-1].error


def test_the_same_file_runs_centrally_when_the_scenario_says_so() -> None:
    world = world_of(3)
    world.task = msgspec.structs.replace(world.task, instances="per_team")
    plan = flown(world, 2)[-1]

    assert len(plan.intents) == 3
    ctx = Talker.seen[0][-1]
    assert ctx.fleet.own.all()
    assert not ctx.broadcast("nobody hears it")
    assert "messages_sent" not in plan.metrics


class Position(msgspec.Struct):
    """A typed payload."""

    xy_m: tuple[float, float]


def test_typed_payloads_arrive_as_declared_and_others_are_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Talker, "message_type", Position)

    def rule(planner: Talker, ctx: Context) -> Output:
        ctx.broadcast(Position((1.0, 2.0)) if planner.task.vehicle == 1 else ["nonsense", np.arange(2)])
        return Output()

    Talker.rule = rule
    plans = flown(world_of(2), 2)

    assert [m.payload for m in Talker.seen[2][1].messages] == [Position((1.0, 2.0))]
    assert Talker.seen[1][1].messages == ()
    assert plans[1].metrics["messages_dropped"] == 1.0


@settings(max_examples=30, deadline=None)
@given(
    st.recursive(
        st.none()
        | st.booleans()
        | st.integers(-(2**63), 2**63 - 1)
        | st.floats(allow_nan=False)
        | st.text(max_size=20),
        lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
        max_leaves=10,
    )
)
def test_any_payload_arrives_as_it_was_sent_or_is_dropped(payload: object) -> None:
    Talker.seen = {}

    def rule(planner: Talker, ctx: Context) -> Output:
        if planner.task.vehicle == 1:
            ctx.broadcast(payload)
        return Output()

    Talker.rule = rule
    plans = flown(world_of(2), 2)

    got = [m.payload for m in Talker.seen[2][1].messages]
    assert got == [payload] or plans[1].metrics["messages_dropped"] > 0
    assert math.isfinite(plans[1].metrics["messages_sent"])


def test_a_metric_that_one_instance_does_not_know_is_unknown_for_the_team(monkeypatch: pytest.MonkeyPatch) -> None:
    """The mean was that of the others, and its gate passed; with one instance for the team NaN fails it."""

    def rule(talker: Talker, ctx: Context) -> Output:
        known = talker.task.vehicle == 1
        return Output(metrics={"good": 5.0 if known else math.nan, "steps": float(talker.steps)})

    monkeypatch.setattr(Talker, "rule", rule)
    metrics = flown(world_of(3), 2)[-1].metrics
    assert math.isnan(metrics["good"]) and metrics["steps"] == 2.0
