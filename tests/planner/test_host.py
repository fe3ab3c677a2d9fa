"""The host: tasks, frames, timing and planners that fail."""

from collections.abc import Mapping
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
from flights import SMALL, fleet, task_of, zone_of

from tui_gcs.core.bus import FLEET, PLAN, TASK, MemoryBus
from tui_gcs.core.messages import Freshness, Intent, Phase, Plan, PlannerTask, decode, encode
from tui_gcs.planner import registry
from tui_gcs.planner.api import Context, Fleet, Output, Param, ParamValue, Planner
from tui_gcs.planner.host import PlannerHost, attach, team_view
from tui_gcs.planner.registry import PlannerError

ZONE = zone_of(SMALL)


class Probe(Planner):
    """Does what its parameters say and remembers what it saw."""

    name = "probe"
    params = (
        Param("trouble", str, "none", choices=("none", "configure", "step", "nonsense")),
        Param("speed_m_s", float, 5.0, 1.0, 8.0, "m/s"),
    )
    seen: list[str] = []
    numbers: list[float] = []

    def configure(self, task: PlannerTask, params: Mapping[str, ParamValue], rng: np.random.Generator) -> None:
        super().configure(task, params, rng)
        self.seen.append(f"configure {params['speed_m_s']}")
        self.trouble = params["trouble"]
        if self.trouble == "configure":
            raise ValueError("zone too strange")

    def start(self, t_s: float, fleet: Fleet) -> None:
        self.seen.append(f"start {t_s:g}")

    def stop(self, reason: str) -> None:
        self.seen.append(f"stop {reason}")

    def step(self, ctx: Context) -> Output:
        self.numbers.append(float(ctx.rng.random()))
        if self.trouble == "step":
            raise RuntimeError("no idea")
        if self.trouble == "nonsense":
            return None  # type: ignore[return-value]
        return Output(
            [Intent(int(i), "hold") for i in ctx.fleet.id[ctx.fleet.active]], metrics={"seven": np.float64(7)}
        )


@pytest.fixture(autouse=True)
def probe(monkeypatch: pytest.MonkeyPatch) -> type[Probe]:
    monkeypatch.setitem(registry._BUILTIN, "probe", "probe_module:Probe")
    monkeypatch.setattr(
        registry, "import_module", lambda _: __import__("types").SimpleNamespace(Probe=Probe, Patrol=Probe)
    )
    Probe.seen, Probe.numbers = [], []
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
    assert Probe.seen == ["configure 5.0", "start 0", "stop new task", "configure 6.0"]
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
    [("configure", "ValueError: zone too strange"), ("step", "RuntimeError: no idea"), ("nonsense", "not Output")],
)
def test_a_planner_that_fails_is_an_error_in_the_plan(trouble: str, told: str) -> None:
    host = probing(trouble=trouble)
    for _ in range(2):
        plan = host.step(fleet(2).frame())
        assert told in plan.error.strip().splitlines()[-1]
        assert plan.intents == ()


@pytest.mark.parametrize(
    ("task", "told"),
    [
        (task_of(ZONE, planner="petrol"), "unknown planner 'petrol'; known: patrol, probe"),
        (task_of(ZONE, planner="probe", speed_m_s=9.0), "planner 'probe': speed_m_s must be at most 8 m/s"),
        (task_of(ZONE, planner="probe", spede=1.0), "spede is no parameter of it (it has: trouble, speed_m_s)"),
        (task_of(ZONE, planner="probe", trouble=1.0), "trouble must be str, not float"),
    ],
)
def test_a_wrong_task_is_told_in_one_line(task: PlannerTask, told: str) -> None:
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


def test_the_fleet_view_is_the_team_by_id_with_who_may_be_told() -> None:
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


def test_on_a_bus_tasks_come_in_and_plans_go_out() -> None:
    bus, plans, vehicles = MemoryBus(), list[Plan](), fleet(2)
    bus.subscribe(PLAN.format(team="red"), lambda _, data: plans.append(decode(data, Plan)))
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
    assert list(registry.builtin()) == ["patrol"]
