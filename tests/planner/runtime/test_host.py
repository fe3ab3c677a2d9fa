"""The host: tasks, frames, timing and planners that fail."""

import gc
from collections.abc import Callable, Mapping
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest

from tests.planner.rigs.flights import SMALL, fleet, task_of, zone_of
from tests.planner.rigs.flights import Fleet as Vehicles
from tui_gcs.core.protocol.bus import FLEET, PLAN, TASK, MemoryBus
from tui_gcs.core.protocol.common import Freshness, Intent, Phase, PlannerFrame, PlannerTask, TeamPlan, decode, encode
from tui_gcs.planner.api import Context, Event, Fleet, Output, Param, ParamValue, Planner
from tui_gcs.planner.runtime import registry
from tui_gcs.planner.runtime.bus_adapter import attach
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.message_conversion import team_view
from tui_gcs.planner.runtime.planner_errors import PlannerError
from tui_gcs.planner.runtime.work_budget import WorkBudget

ZONE = zone_of(SMALL)


class Probe(Planner):
    """Does what its parameters say and remembers what it saw."""

    name = "probe"
    params = (
        Param(
            "trouble",
            str,
            "none",
            choices=(
                "none",
                "configure",
                "step",
                "nonsense",
                "once",
                "numpy",
                "float id",
                "exit",
                "big",
                "no bytes",
                "heir",
                "testator",
            ),
        ),
        Param("speed_m_s", float, 5.0, 1.0, 8.0, "m/s"),
    )
    iterations_per_s = 12.0
    notes: list[str] = []
    seen: list[str] = []
    numbers: list[float] = []
    granted: list[int] = []
    steps = 0

    def configure(self, task: PlannerTask, params: Mapping[str, ParamValue], rng: np.random.Generator) -> None:
        super().configure(task, params, rng)
        self.seen.append(f"configure {params['speed_m_s']}")
        self.trouble, self.steps = params["trouble"], 0
        if self.trouble == "configure":
            raise ValueError("zone too strange")

    def start(self, t_s: float, fleet: Fleet) -> None:
        self.seen.append(f"start {t_s:g}")

    def stop(self, reason: str) -> None:
        self.seen.append(f"stop {reason}")

    def event(self, event: Event) -> None:
        self.seen.append(f"{event.t_s:g} {event.kind} {event.vehicle}")

    def snapshot(self) -> bytes:
        return {"big": bytes(2_000_000), "no bytes": "text"}.get(str(self.trouble), b"%d" % self.steps)  # type: ignore

    def restore(self, data: bytes) -> None:
        self.steps = int(data)
        self.seen.append(f"restore {self.steps}")

    def step(self, ctx: Context) -> Output:
        self.numbers.append(float(ctx.rng.random()))
        self.granted.append(ctx.iterations)
        self.steps += 1
        if self.trouble == "once" and len(self.numbers) == 15:
            raise RuntimeError("just this once")
        if self.trouble == "exit":
            raise SystemExit
        if self.trouble in ("numpy", "float id"):
            x, i = np.array([1.0, 2.0, 3.0]), np.int64(1)
            way, vehicle = np.stack([x, x]), 1.5 if self.trouble == "float id" else i
            intent = Intent(vehicle, "trajectory", dt_s=np.float64(1), positions_m=way, velocities_m_s=way)  # type: ignore
            return Output([intent, Intent(1, "goto", position_m=(1.0, 2.0, np.float64(5)))])  # type: ignore
        if self.trouble == "step":
            raise RuntimeError("no idea")
        if self.trouble == "nonsense":
            return None  # type: ignore[return-value]
        holds = [Intent(int(i), "hold") for i in ctx.fleet.id[ctx.fleet.active]]
        return Output(holds, metrics={"seven": np.float64(7)}, notes=self.notes)

    def learnt(self) -> bytes:
        if self.trouble == "testator":
            raise RuntimeError("leaves nothing")
        return str(self.steps).encode()

    def inherit(self, learnt: bytes) -> None:
        self.seen.append(f"inherit {learnt.decode()}")
        if self.trouble == "heir":
            raise RuntimeError("wants nothing of it")


@pytest.fixture(autouse=True)
def probe(monkeypatch: pytest.MonkeyPatch) -> type[Probe]:
    monkeypatch.setitem(registry._BUILTIN, "probe", "probe_module:Probe")
    monkeypatch.setattr(
        registry, "import_module", lambda _: __import__("types").SimpleNamespace(Probe=Probe, Patrol=Probe)
    )
    Probe.seen, Probe.numbers, Probe.granted = [], [], []
    return Probe


def host_of(task: PlannerTask) -> PlannerHost:
    host = PlannerHost("red")
    host.set_task(task)
    return host


def probing(**parameters: float | str) -> PlannerHost:
    return host_of(task_of(ZONE, planner="probe", **parameters))


def test_a_planner_is_configured_started_stepped_and_stopped() -> None:
    host, vehicles = probing(), fleet(2)
    plan = host.step(vehicles.frame())
    host.step(vehicles.frame())
    host.set_task(msgspec.structs.replace(task_of(ZONE, planner="probe", speed_m_s=6.0), revision=8))
    assert Probe.seen == ["configure 5.0", "start 0", "configure 6.0", "stop new task", "inherit 2"]
    assert (plan.team, plan.revision, plan.seq, plan.t_s, plan.error) == ("red", 7, 1, 0.0, "")
    assert [intent.vehicle for intent in plan.intents] == [1, 2]
    assert plan.metrics == {"seven": 7.0}
    assert host.revision == 8


def test_the_same_task_again_changes_nothing() -> None:
    host = probing()
    host.set_task(msgspec.structs.replace(task_of(ZONE, planner="probe"), t_s=99.0))
    assert Probe.seen == ["configure 5.0"]


def test_another_teams_task_is_refused() -> None:
    with pytest.raises(ValueError, match="team 'blue'"):
        PlannerHost("blue").set_task(task_of(ZONE))


def test_a_host_without_a_task_has_nothing_to_do() -> None:
    host = PlannerHost("red")
    assert not host.due(100.0)
    assert host.revision == -1
    with pytest.raises(RuntimeError, match="no task"):
        host.step(fleet(1).frame())


def test_ten_frames_a_second_give_five_steps() -> None:
    host, vehicles, stepped = probing(), fleet(1), 0
    for i in range(100):
        vehicles.t_s = 0.1 * i + (0.01 if i % 3 else 0.0)
        if host.due(vehicles.t_s):
            host.step(vehicles.frame())
            stepped += 1
    assert stepped == 50


def test_after_a_gap_steps_are_not_made_up_for() -> None:
    host, vehicles = probing(), fleet(1)
    host.step(vehicles.frame())
    vehicles.t_s = 60.0
    host.step(vehicles.frame())
    assert not host.due(60.1)


@pytest.mark.parametrize(
    ("trouble", "told"),
    [("configure", "zone too strange"), ("step", "RuntimeError: no idea"), ("nonsense", "not Output")],
)
def test_a_planner_that_fails_is_an_error_in_the_plan(trouble: str, told: str) -> None:
    host = probing(trouble=trouble)
    for _ in range(3):
        plan = host.step(fleet(2).frame())
        assert told in plan.error.strip().splitlines()[-1]
        assert plan.intents == ()
    assert plan.fate == "quarantined"


@pytest.mark.parametrize(
    ("task", "told"),
    [
        (
            task_of(ZONE, planner="petrol"),
            "unknown planner 'petrol'; known: guardian, patrol, probe, search, survey, waypoints",
        ),
        (task_of(ZONE, planner="probe", speed_m_s=9.0), "planner 'probe': speed_m_s must be at most 8 m/s"),
        (task_of(ZONE, planner="probe", spede=1.0), "spede is no parameter of it (it has: trouble, speed_m_s)"),
        (task_of(ZONE, planner="probe", trouble=1.0), "trouble must be str, not float"),
    ],
)
def test_a_wrong_task_is_reported_in_one_line(task: PlannerTask, told: str) -> None:
    plan = host_of(task).step(fleet(1).frame())
    assert told in plan.error
    assert "\n" not in plan.error


def test_random_numbers_come_from_task_seed_and_team() -> None:
    def drawn(team: str, seed: int) -> float:
        host = PlannerHost(team)
        host.set_task(msgspec.structs.replace(task_of(ZONE, planner="probe"), team=team, seed=seed))
        host.step(fleet(1).frame())
        return Probe.numbers[-1]

    assert drawn("red", 1) == drawn("red", 1)
    assert len({drawn("red", 1), drawn("red", 2), drawn("blue", 1)}) == 3


def test_the_fleet_view_is_the_team_by_id_with_its_active_vehicles() -> None:
    vehicles = fleet(6)
    vehicles.ids = (9, 4, 3, 2, 7, 5)
    vehicles.phase = {9: Phase.HOLDING}
    vehicles.freshness = {4: Freshness.LOST, 3: Freshness.STALE}
    vehicles.position_m[3] = np.nan
    view = team_view(vehicles.frame(), task_of(ZONE, (9, 4, 3, 2, 5, 11)))
    assert view.id.tolist() == [2, 3, 4, 5, 9]
    assert view.active.tolist() == [False, True, False, True, False]
    assert view.layer_m.tolist() == [34.0, 41.0, 48.0, 55.0, 83.0]
    assert view.position_m.shape == view.velocity_m_s.shape == (5, 3)


def test_a_step_gets_its_time_its_deadline_the_wind_and_read_only_arrays(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told: list[Context] = []
    monkeypatch.setattr(Probe, "step", lambda _, ctx: told.append(ctx) or Output())
    frame = msgspec.structs.replace(fleet(2).frame(), t_s=7.5, wind_m_s=(3.0, -1.0))
    assert not probing().step(frame).error
    (ctx,) = told
    assert (ctx.t_s, ctx.wind_m_s, ctx.deadline_s) == (7.5, (3.0, -1.0), 0.1)
    assert not ctx.fleet.position_m.flags.writeable and not ctx.tracks.position_m.flags.writeable


def test_on_a_bus_tasks_come_in_and_plans_go_out() -> None:
    bus, plans, vehicles = MemoryBus(), list[TeamPlan](), fleet(2)
    bus.subscribe(PLAN.format(team="red"), lambda _, data: plans.append(decode(data, TeamPlan)))
    attached = attach(PlannerHost("red"), bus)
    bus.publish(FLEET, encode(vehicles.frame()))
    bus.publish(TASK.format(team="red"), encode(task_of(ZONE, planner="probe")))
    for t_s in (0.0, 0.1, 0.2):
        vehicles.t_s = t_s
        bus.publish(FLEET, encode(vehicles.frame()))
    attached.close()
    bus.publish(FLEET, encode(vehicles.frame()))
    assert [(plan.t_s, plan.revision) for plan in plans] == [(0.0, 7), (0.2, 7)]


def test_a_module_that_cannot_be_imported_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_: str) -> None:
        raise ImportError("no module named numpyy")

    monkeypatch.setattr(registry, "import_module", broken)
    with pytest.raises(PlannerError, match="'probe' cannot be loaded: ImportError: no module named numpyy"):
        registry.load("probe")


def test_what_is_not_a_planner_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "import_module", lambda _: SimpleNamespace(Probe=dict))
    with pytest.raises(PlannerError, match="'probe' is not a subclass"):
        registry.load("probe")


def test_parameters_are_completed_with_defaults() -> None:
    assert registry.complete("probe", {"speed_m_s": 3}) == {"trouble": "none", "speed_m_s": 3.0}


def test_built_in_planners_declare_what_they_take(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    assert {param.name for param in registry.declared("patrol")} >= {"speed_fraction", "margin_m", "direction", "seed"}
    assert "patrol" in registry.names()


# ---------------------------------------------------------------- events


def seen_while(host: PlannerHost, vehicles: Vehicles, change: Callable[[], None]) -> list[str]:
    """The events of the step after a change."""
    change()
    Probe.seen.clear()
    vehicles.t_s += 0.2
    host.step(vehicles.frame())
    return list(Probe.seen)


def test_events_come_before_the_step_that_sees_the_change() -> None:
    host, vehicles = probing(), fleet(3)
    vehicles.phase[3] = Phase.GROUND

    def told(vehicle: int, phase: Phase = Phase.FLYING, freshness: Freshness = Freshness.OK) -> list[str]:
        def change() -> None:
            vehicles.phase[vehicle], vehicles.freshness[vehicle] = phase, freshness

        return [text.split(" ", 1)[1] for text in seen_while(host, vehicles, change)]

    host.step(vehicles.frame())
    assert Probe.seen == ["configure 5.0", "start 0"], "what is there at the start is no event"
    assert told(3, Phase.TAKEOFF) == []
    assert told(3, Phase.HOLDING) == [], "ready on its layer, not held"
    assert told(3) == ["joined 3"]
    assert told(3, Phase.HOLDING) == ["held 3"]
    assert told(3, Phase.TAKEOFF) == [], "back to its layer"
    assert told(3) == ["resumed 3"]
    assert told(3, freshness=Freshness.LOST) == ["lost 3"]
    assert told(3) == ["joined 3"]
    assert told(3, Phase.RETURNING) == ["returned 3"]
    assert told(3, Phase.RETURNING, Freshness.LOST) == []
    assert told(3, Phase.GROUND) == []
    assert told(3) == ["joined 3"]
    assert told(3, Phase.TAKEN_OUT) == ["returned 3"]


def test_a_vehicle_that_is_not_in_the_frame_any_more_is_lost() -> None:
    host, vehicles = probing(), fleet(2)
    host.step(vehicles.frame())
    gone = fleet(1)
    assert seen_while(host, gone, lambda: None) == ["0.2 lost 2"]


def test_a_low_battery_is_reported_once_a_flight() -> None:
    host, vehicles = probing(), fleet(2)
    vehicles.battery_pct[2] = 24.0
    host.step(vehicles.frame())
    assert Probe.seen[-1] == "0 low battery 2"
    assert seen_while(host, vehicles, lambda: vehicles.battery_pct.update({2: 26.0})) == []
    assert seen_while(host, vehicles, lambda: vehicles.battery_pct.update({2: 20.0, 1: np.nan})) == []
    assert seen_while(host, vehicles, lambda: vehicles.phase.update({2: Phase.GROUND})) == ["0.6 returned 2"]
    told = seen_while(host, vehicles, lambda: vehicles.phase.update({2: Phase.FLYING}))
    assert told == ["0.8 joined 2", "0.8 low battery 2"]


# ---------------------------------------------------------------- iterations, rate


def test_iterations_are_granted_by_mission_time_however_frames_come() -> None:
    host, vehicles = probing(), fleet(1)
    for t_s in np.cumsum([0.0, 0.2, 0.2, 0.6, 0.2, 0.3, 0.5, 0.2, 0.3, 0.5]):
        vehicles.t_s = float(t_s)
        host.step(vehicles.frame())
    assert sum(Probe.granted) == 12 * 3 + 2, "12 a second; the first step is given one period"
    vehicles.t_s += 60.0
    host.step(vehicles.frame())
    assert Probe.granted[-1] == 12, "of a long gap one second is made up for"


@pytest.mark.parametrize(
    ("own_share", "told"),
    [(0.1, "this computer is too busy"), (1.0, "its steps take 400 ms of 500")],
    ids=["the computer is busy", "the planner is slow"],
)
def test_in_the_air_a_busy_computer_gives_up_background_work_before_steps_come_late(
    own_share: float, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """12 a second, 0.5 s a step: 6 each, until steps take longer than half of their period."""
    monkeypatch.setattr(Probe, "rate_hz", 2.0)
    stopwatch_s, step_s = 0.0, 0.1

    def perf_counter() -> float:
        nonlocal stopwatch_s
        stopwatch_s += step_s
        return stopwatch_s

    computed_s = 0.0

    def thread_time() -> float:
        nonlocal computed_s
        computed_s += step_s * own_share
        return computed_s

    times = SimpleNamespace(perf_counter=perf_counter, thread_time=thread_time)
    monkeypatch.setattr("tui_gcs.planner.runtime.host.time", times)
    host, vehicles = probing(), fleet(1)
    host.budget = WorkBudget()
    notes: list[str] = []

    def steps(number: int) -> list[int]:
        for _ in range(number):
            vehicles.t_s += 0.5
            notes.extend(host.step(vehicles.frame()).notes)
        return Probe.granted[-number:]

    assert steps(3) == [6, 6, 6]
    step_s = 0.4
    assert steps(5) == [6, 3, 1, 0, 0]
    assert notes == [], "a moment of it is not worth a word"
    assert steps(8) == [0] * 8
    assert notes == [f"{told}: its vehicles fly on, no better plan is searched meanwhile"]
    step_s = 0.1
    assert steps(30)[-1] == 6, "little by little all of it again"
    assert len(notes) == 1
    step_s = 0.6
    assert steps(2) == [6, 0], "a late step: what is under way makes the next one late, too, the third must not be"


@pytest.mark.parametrize(
    ("name", "value"), [("rate_hz", 0.5), ("rate_hz", 50.0), ("rate_hz", float("nan")), ("iterations_per_s", -1.0)]
)
def test_a_declared_rate_that_cannot_be_kept_is_told(monkeypatch: pytest.MonkeyPatch, name: str, value: float) -> None:
    monkeypatch.setattr(Probe, name, value)
    plan = probing().step(fleet(1).frame())
    assert f"planner 'probe': {name} {value!r} is not from" in plan.error
    assert plan.fate == "quarantined"


def test_a_plan_says_how_often_its_planner_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Probe, "rate_hz", 10.0)
    host, vehicles = probing(), fleet(1)
    assert host.step(vehicles.frame()).rate_hz == 10.0
    assert host.due(0.09) and not host.due(0.05)


# ---------------------------------------------------------------- failures


def run(host: PlannerHost, vehicles: Vehicles, steps: int) -> list[TeamPlan]:
    plans = []
    for _ in range(steps):
        plans.append(decode(host.answer(vehicles.frame()), TeamPlan))
        vehicles.t_s = round(vehicles.t_s + 0.2, 6)
    return plans


def test_a_planner_that_fails_once_goes_on_from_its_snapshot() -> None:
    host, vehicles = probing(trouble="once"), fleet(2)
    plans = run(host, vehicles, 20)
    assert [plan.fate for plan in plans if plan.error] == ["restarts"]
    assert "RuntimeError: just this once" in plans[14].error and "Traceback" in plans[14].error
    assert plans[15].intents, "the next step plans again"
    assert Probe.seen == ["configure 5.0", "start 0", "configure 5.0", "restore 11"], "of 2.0 s, not started again"


def test_a_planner_that_fails_again_is_left_alone_until_a_new_task() -> None:
    host, vehicles = probing(trouble="step"), fleet(1)
    assert [plan.fate for plan in run(host, vehicles, 5)] == ["restarts"] + ["quarantined"] * 4
    assert len(Probe.numbers) == 2
    host.set_task(msgspec.structs.replace(task_of(ZONE, planner="probe", trouble="step"), revision=8))
    assert [plan.fate for plan in run(host, vehicles, 2)] == ["restarts", "quarantined"]


def test_a_planner_that_ends_its_process_does_not() -> None:
    assert "SystemExit" in run(probing(trouble="exit"), fleet(1), 1)[0].error


def test_garbage_is_not_looked_for_while_a_planner_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor is it forgotten afterwards, whatever comes out of the step."""
    was_on: list[bool] = []

    def step(self: Probe, ctx: Context) -> Output:
        was_on.append(gc.isenabled())
        raise KeyError(ctx.t_s)

    monkeypatch.setattr(Probe, "step", step)
    plan = probing().step(fleet(2).frame())
    assert plan.error and was_on == [False] and gc.isenabled()


def test_numpy_in_intents_travels_as_numbers() -> None:
    plan = run(probing(trouble="numpy"), fleet(1), 1)[0]
    assert plan.error == ""
    assert plan.intents[0].positions_m == ((1.0, 2.0, 3.0), (1.0, 2.0, 3.0))
    assert plan.intents[1].position_m == (1.0, 2.0, 5.0)


def test_an_intent_of_wrong_types_is_the_planners_error() -> None:
    plan = run(probing(trouble="float id"), fleet(1), 1)[0]
    assert "its plan cannot be sent: Expected `int`" in plan.error and "vehicle" in plan.error


@pytest.mark.parametrize(
    ("trouble", "told"),
    [
        ("big", "no snapshot: ValueError: a snapshot of 2.0 MB: at most 1 MB are kept"),
        ("no bytes", "must be bytes, not str"),
    ],
)
def test_a_snapshot_that_cannot_be_kept_is_reported_and_not_fatal(trouble: str, told: str) -> None:
    plans = run(probing(trouble=trouble), fleet(1), 3)
    assert told in plans[0].notes[0]
    assert all(plan.error == "" and plan.snapshot is None for plan in plans)


def test_a_new_host_goes_on_from_a_snapshot_bit_by_bit() -> None:
    host, vehicles = probing(), fleet(3)
    plans = run(host, vehicles, 12)
    kept = [plan.snapshot for plan in plans if plan.snapshot is not None]
    assert len(kept) == 2, "every 2 s"
    vehicles.phase[2] = Phase.HOLDING
    run(host, vehicles, 1)
    snapshot, numbers, granted = host.snapshot(), len(Probe.numbers), len(Probe.granted)
    begin_s = vehicles.t_s
    run(host, vehicles, 10)
    other = PlannerHost("red")
    other.set_task(msgspec.structs.replace(task_of(ZONE, planner="probe"), revision=9, t_s=50.0), snapshot)
    assert not other.problem
    Probe.seen.clear()
    vehicles.t_s = begin_s
    run(other, vehicles, 10)
    assert Probe.numbers[numbers : numbers + 10] == Probe.numbers[numbers + 10 :]
    assert Probe.granted[granted : granted + 10] == Probe.granted[granted + 10 :]
    assert Probe.seen == [], "neither a start nor an event that was told before"


@pytest.mark.parametrize("snapshot", [b"junk", b"\x80"])
def test_a_snapshot_of_something_else_is_not_used(snapshot: bytes) -> None:
    host = PlannerHost("red")
    host.set_task(task_of(ZONE, planner="probe"), snapshot)
    plan = host.step(fleet(1).frame())
    assert plan.notes == ("begins anew: the snapshot is not readable",)
    run(host, fleet(1), 1)
    other = PlannerHost("red")
    other.set_task(task_of(ZONE, planner="probe", speed_m_s=6.0), host.snapshot())
    assert other.step(fleet(1).frame()).notes == ("begins anew: the snapshot is of another task",)


def test_a_snapshot_that_cannot_be_restored_is_reported_and_the_planner_starts_anew(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    host, vehicles = probing(), fleet(1)
    run(host, vehicles, 2)
    monkeypatch.setattr(Probe, "restore", lambda *_: 1 / 0)
    other = PlannerHost("red")
    other.set_task(task_of(ZONE, planner="probe"), host.snapshot())
    plan = other.step(vehicles.frame())
    assert plan.notes == ("begins anew: restore failed: ZeroDivisionError: division by zero",)
    assert plan.error == "" and Probe.seen[-2:] == ["configure 5.0", "start 0.4"]


def test_a_planner_of_a_new_task_inherits_from_the_one_before() -> None:
    host, vehicles = probing(), fleet(1)
    host.step(vehicles.frame())
    host.set_task(msgspec.structs.replace(task_of(ZONE, planner="probe"), revision=8))
    assert Probe.seen[-3:] == ["configure 5.0", "stop new task", "inherit 1"]
    host.set_task(task_of(ZONE, planner="probe", trouble="heir"))
    plan = host.step(vehicles.frame())
    assert "RuntimeError: wants nothing of it" in plan.error
    assert plan.fate == "quarantined"


def test_a_planner_that_cannot_say_what_it_learnt_does_not_keep_the_next_from_flying() -> None:
    host, vehicles = probing(trouble="testator"), fleet(1)
    host.step(vehicles.frame())
    host.set_task(msgspec.structs.replace(task_of(ZONE, planner="probe"), revision=8))
    plan = host.step(vehicles.frame())
    assert plan.notes == ("begins anew: what it learnt is lost: RuntimeError: leaves nothing",)
    assert plan.error == ""


def test_what_was_learnt_is_kept_with_a_snapshot_for_another_task() -> None:
    host, vehicles = probing(), fleet(1)
    host.step(vehicles.frame())
    other = host_of(msgspec.structs.replace(task_of(ZONE, planner="probe"), revision=8, footprint_radius_m=9.0))
    other.inherit(host.snapshot())
    assert Probe.seen[-1] == "inherit 1"
    other.step(vehicles.frame())
    other.inherit(host.snapshot())
    assert Probe.seen[-1] == "start 0", "too late: it flies"


def test_a_planner_that_keeps_only_what_it_learnt_begins_anew_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Probe, "snapshot", lambda _: b"")
    host, vehicles = probing(), fleet(1)
    host.step(vehicles.frame())
    other = PlannerHost("red")
    other.set_task(task_of(ZONE, planner="probe"), host.snapshot())
    assert other.step(vehicles.frame()).notes == ()
    assert Probe.seen[-3:] == ["configure 5.0", "inherit 1", "start 0"]


def test_what_was_learnt_is_sent_alone_for_the_next_task_and_station() -> None:
    host, vehicles = probing(), fleet(1)
    plan = host.step(vehicles.frame())
    assert plan.learnt and b"restore" not in plan.learnt
    assert host.step(vehicles.frame()).learnt is None, "as before"
    other = PlannerHost("red")
    other.set_task(msgspec.structs.replace(task_of(ZONE, planner="probe", speed_m_s=6.0), revision=9), plan.learnt)
    assert other.step(vehicles.frame()).notes == ()
    assert Probe.seen[-3:] == ["configure 6.0", "inherit 1", "start 0"]


def test_a_snapshot_of_another_task_still_says_what_was_learnt() -> None:
    host, vehicles = probing(), fleet(1)
    host.step(vehicles.frame())
    other = PlannerHost("red")
    other.set_task(task_of(ZONE, planner="probe", speed_m_s=6.0), host.snapshot())
    assert Probe.seen[-2:] == ["configure 6.0", "inherit 1"]


def test_what_another_version_learnt_is_not_inherited(monkeypatch: pytest.MonkeyPatch) -> None:
    host, vehicles = probing(), fleet(1)
    learnt = host.step(vehicles.frame()).learnt or b""
    monkeypatch.setattr(Probe, "version", "2")
    other = PlannerHost("red")
    other.set_task(task_of(ZONE, planner="probe"), learnt)
    assert other.step(vehicles.frame()).notes == ("begins anew: the snapshot is of probe 1",)
    assert not [seen for seen in Probe.seen if seen.startswith("inherit")]


def test_an_heir_that_cannot_take_what_was_kept_begins_anew_and_flies() -> None:
    host, vehicles = probing(), fleet(1)
    learnt = host.step(vehicles.frame()).learnt or b""
    other = PlannerHost("red")
    other.set_task(task_of(ZONE, planner="probe", trouble="heir"), learnt)
    plan = other.step(vehicles.frame())
    assert plan.error == ""
    assert plan.notes == ("begins anew: what was learnt is of no use: RuntimeError: wants nothing of it",)
    assert Probe.seen[-4:] == ["configure 5.0", "inherit 1", "configure 5.0", "start 0"]


def test_too_much_learnt_data_is_reported_and_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Probe, "learnt", lambda _: bytes(20_000))
    plan = probing().step(fleet(1).frame())
    assert plan.learnt is None and plan.snapshot
    assert plan.notes == ("not kept: ValueError: it learnt 20.1 kB: at most 16 kB outlive this task and the station",)


def test_a_planner_that_goes_on_from_a_snapshot_inherits_nothing() -> None:
    host, vehicles = probing(), fleet(1)
    host.step(vehicles.frame())
    host.set_task(msgspec.structs.replace(task_of(ZONE, planner="probe"), revision=8), host.snapshot())
    assert "restore 1" in Probe.seen
    assert not [seen for seen in Probe.seen if seen.startswith("inherit")]


def test_what_the_operator_should_know_travels_with_the_plan(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Probe, "notes", ["slower: wind"])
    assert probing().step(fleet(1).frame()).notes == ("slower: wind",)
    monkeypatch.setattr(Probe, "notes", ["x" * 1000] * 100)
    assert probing().step(fleet(1).frame()).notes == ("x" * 400,) * 5


def test_a_planner_frame_gives_a_planner_the_same_view_as_the_whole_frame() -> None:
    lasts_s = (600.0, 500.0, 400.0, 300.0, 200.0, 100.0)
    whole = msgspec.structs.replace(fleet(6).frame(), battery_left_s=lasts_s, home_s=lasts_s[::-1])
    task = task_of(ZONE, (2, 3, 5))
    part = decode(encode(whole), PlannerFrame)
    expected, seen = vars(team_view(whole, task)), vars(team_view(part, task))
    assert all(np.array_equal(column, seen[name]) for name, column in expected.items()) and len(expected["id"]) == 3
    assert part == msgspec.convert(msgspec.to_builtins(whole), PlannerFrame)
