"""Lock-step flights of a planner under check: the shipped scenario, and faults injected on purpose."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec
import numpy as np

from tui_gcs.cli.common import read_scenario
from tui_gcs.core.judging.flight_result import FlightResult
from tui_gcs.core.judging.mission_script import Script, Step
from tui_gcs.core.judging.result_check import ResultCheck
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol.common import (
    EventClass,
    FleetFrame,
    JournalEvent,
    Phase,
    Reply,
    Resume,
    StationStatus,
    decode,
    encode,
)
from tui_gcs.core.protocol.metric_names import seen_pct
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.planner.api import Context, Intent, Output, Planner
from tui_gcs.planner.check.subject import CheckedPlanner, Finding, failed, noted, passed
from tui_gcs.planner.runtime import registry
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.rehearsal.lock_step import LockStep

QUICK_MEASURED_S, QUICK_ROUND_S = 40.0, 150.0
"""A quick check measures this long, in one round that is at most so long; a full one measures as the scenario says."""
FAULTS_ROUND_S = 3600.0
"""Faults are injected in a round that does not end before they are over."""
PRINCIPAL = "check"

ADVICE = {
    "separation, x limit": "give each vehicle its own layer (fleet.layer_m) or plan paths that stay apart",
    "outside operating area, m": "stay inside task.area less task.limits.geofence_margin_m",
    "outside altitude band, m": "stay between task.area.alt_min_m and alt_max_m: fleet.layer_m is",
    "guard vetoes": "a vetoed vehicle brakes and holds: look at area, speed and distances of what is asked",
    "planner intents refused on slot": "the guard refused what was asked of vehicles that were on their slot",
    "planner faults": "it raised, was silent or was late",
    "not landed and disarmed": "all must be able to come home from wherever they were sent",
}
"""Checks of a flight, and what a planner's author can do about each."""
GATE_ADVICE = "a gate of the scenario's [results], or of the planner's own `metrics`"


@dataclass
class MonitoredFlight:
    """A lock-step flight of the planner, with the events that the station reported about it."""

    subject: CheckedPlanner
    scenario: Scenario
    folder: Path
    hosts: Callable[[str], PlannerHost]
    events: list[JournalEvent] = field(default_factory=list)
    status: StationStatus | None = None
    frame: FleetFrame | None = None

    def __post_init__(self) -> None:
        """Set the flight up, on the ground."""
        self.flight = LockStep(self.scenario, "", self.folder, hosts=self.hosts, files=self.subject.files)
        # As in a rehearsal: the same flight, judged by the same gates.
        self.script = Script(self.scenario, self.flight.bus, principal=PRINCIPAL, whole_duration=False)
        self.flight.bus.subscribe(keys.EVENT, lambda _, data: self.events.append(decode(data, JournalEvent)))
        self.flight.bus.subscribe(keys.STATUS, self._take)
        self.flight.bus.subscribe(keys.FLEET, self._take)

    def _take(self, key: str, data: bytes) -> None:
        if key == keys.STATUS:
            self.status = decode(data, StationStatus)
        else:
            self.frame = decode(data, FleetFrame)

    def tick(self, *, scripted: bool = True) -> None:
        """Advance by one tick; with `scripted` the flight's script goes on, too."""
        self.subject.beat()
        self.flight.step()
        if scripted:
            self.script.tick()

    def reported(self, since: int = 0) -> str:
        """Return the first event about the planner after number `since`; "" if there is none."""
        texts = [e.text for e in self.events[since:] if e.cls is EventClass.PLANNER and e.severity <= WARNING]
        return texts[0] if texts else ""


WARNING = 4
"""The MAVLink severity of a warning; smaller numbers are graver."""


def flown_scenario(subject: CheckedPlanner) -> Scenario:
    """Return the shipped scenario with this planner in all teams, as `tui-gcs rehearse --planner` flies it.

    A quick check flies one round of it, and measures for a shorter time.
    """
    scenario, _, _ = read_scenario(None)
    # A team that names the planner keeps its parameters.
    teams = tuple(
        t if t.planner == subject.name else msgspec.structs.replace(t, planner=subject.name, parameters={})
        for t in scenario.teams
    )
    if subject.instances is not None:
        teams = tuple(msgspec.structs.replace(t, instances=subject.instances) for t in teams)
    scenario = msgspec.structs.replace(scenario, teams=teams, seed=subject.seed)
    if not subject.quick:
        return scenario
    first = msgspec.structs.replace(scenario.rounds[0], duration_s=QUICK_ROUND_S)
    results = msgspec.structs.replace(scenario.results, measured_s=QUICK_MEASURED_S)
    return msgspec.structs.replace(scenario, rounds=(first,), results=results)


def shipped(subject: CheckedPlanner) -> Iterator[Finding]:
    """Fly all rounds of the shipped scenario with eight vehicles in two teams, and yield the findings."""
    scenario = flown_scenario(subject)
    with TemporaryDirectory() as folder:
        watched = MonitoredFlight(subject, scenario, Path(folder), partial(PlannerHost, files=subject.files))
        while not watched.script.done:
            watched.tick()
        watched.flight.close()
    result = watched.script.referee.result()
    if watched.script.problem:
        yield failed(watched.script.problem, f"the station reported: {watched.reported() or 'nothing of the planner'}")
    for check in result.checks:
        yield _judged(check)
    whys = [measure.why_not_measured() for measure in watched.script.referee.measures]
    yield from _idleness(result, whys)


def _judged(check: ResultCheck) -> Finding:
    value = "--" if check.value is None else f"{check.value:g}"
    limit = "--" if check.limit is None else f"{check.limit:g}"
    text = f"{check.name}: {value} (limit {limit})"
    if check.ok:
        return passed(text)
    return failed(text, ": ".join(filter(None, (ADVICE.get(check.name, ""), check.why))) or GATE_ADVICE)


def _idleness(result: FlightResult, whys: list[str]) -> Iterator[Finding]:
    """Yield the findings about idleness; `whys` explains for each round why it was not measured."""
    for r, why in zip(result.rounds, whys, strict=True):
        where = f"{r.round} {r.zone}"
        if r.judged_by != "idleness":
            yield noted(f"{where}: judged by {r.judged_by}; {seen_pct(r.coverage):.1f} % of the zone was seen", "")
        elif r.ratio is None or r.worst_idleness_s is None:
            seen = f"coverage {seen_pct(r.coverage):.1f} %, " if r.on_slot_after_s is not None else ""
            yield noted(f"{where}: {seen}idleness not measured", why)
        else:
            worst = f"worst idleness {r.worst_idleness_s:.1f} s = {r.ratio:.2f} x the ideal of {r.ideal_s:.1f} s"
            yield noted(f"{where}: coverage {seen_pct(r.coverage):.1f} %, {worst}")


# ---------------------------------------------------------------- faults on purpose


@dataclass
class InjectedFault:
    """The fault that is injected now."""

    raises: int = 0
    """For how many steps the planner raises an error."""
    hangs: bool = False
    garbage: bool = False


class PlannedError(Exception):
    """Raised in a planner on purpose, to see how its vehicles are protected."""


class HangingHost(PlannerHost):
    """A planner host as the station sees one that hangs: it never answers."""

    switch: InjectedFault

    def due(self, t_s: float) -> bool:
        """Return False while the host hangs."""
        return not self.switch.hangs and super().due(t_s)


def faulty(planner: type[Planner], switch: InjectedFault) -> type[Planner]:
    """Return the same planner class, with the faults of `switch`."""

    class Faulty(planner):  # type: ignore[valid-type, misc]
        def step(self, ctx: Context) -> Output:
            if switch.raises > 0:
                switch.raises -= 1
                raise PlannedError("put in by the check")
            return garbage(ctx) if switch.garbage else super().step(ctx)

    return Faulty


def garbage(ctx: Context) -> Output:
    """Return output that no vehicle may fly, of another kind for each vehicle and second."""
    out, nan = Output(), math.nan
    for row, vehicle in enumerate(ctx.fleet.id.tolist()):
        x, y, z = np.nan_to_num(ctx.fleet.position_m[row]).tolist()
        other = np.nan_to_num(ctx.fleet.position_m[row - 1]).tolist()
        out.intents.append(
            (
                Intent(vehicle, "goto", position_m=(nan, y, z)),
                Intent(vehicle, "goto", position_m=(x + 5000.0, y, z)),
                Intent(vehicle, "goto", position_m=(x, y, -40.0)),
                Intent(vehicle, "goto", position_m=(other[0], other[1], other[2])),
                Intent(vehicle, "velocity", velocity_m_s=(80.0, 0.0, 0.0), valid_s=30.0),
                Intent(vehicle, "orbit", position_m=(x, y, z), radius_m=-3.0),
                Intent(vehicle, "trajectory", dt_s=0.1, positions_m=((x, y, z),) * 700, velocities_m_s=()),
            )[(row + int(ctx.t_s)) % 7]
        )
    return Output(intents=[*out.intents, Intent(9999, "return")])


def protection(subject: CheckedPlanner) -> Iterator[Finding]:
    """Yield what happens to the vehicles when this planner fails: it is flown, not assumed."""
    switch = InjectedFault()
    name = registry.register_class(faulty(subject.planner, switch))
    scenario = flown_scenario(subject)
    round_ = msgspec.structs.replace(scenario.rounds[0], duration_s=FAULTS_ROUND_S)
    scenario = msgspec.structs.replace(scenario, rounds=(round_,))
    team = msgspec.structs.replace(scenario.teams[0], planner=name, parameters={})
    scenario = msgspec.structs.replace(scenario, teams=(team,), places=scenario.places[:4])

    def host(team: str) -> PlannerHost:
        made = HangingHost(team)
        made.switch = switch
        return made

    with TemporaryDirectory() as folder:
        watched = MonitoredFlight(subject, scenario, Path(folder), host)
        while watched.script.step in (Step.WAIT, Step.TAKE_OFF):
            watched.tick()
        _run(watched, 15.0)
        if watched.script.done or not _flying(watched):
            yield failed(f"it does not come to fly: {watched.script.problem or watched.reported()}", "see flight")
            return
        yield _exception(watched, switch)
        yield _silence(watched, switch)
        yield _nonsense(watched, switch)
        watched.flight.close()


def _run(watched: MonitoredFlight, duration_s: float, until: Callable[[], bool] = lambda: False) -> float:
    """Fly on without the script, and return how many seconds it took."""
    begin_s = watched.flight.clock.now()
    while watched.flight.clock.now() - begin_s < duration_s and not until():
        watched.tick(scripted=False)
    return watched.flight.clock.now() - begin_s


def _flying(watched: MonitoredFlight) -> int:
    return 0 if watched.frame is None else sum(phase is Phase.FLYING for phase in watched.frame.phase)


def _resume(watched: MonitoredFlight) -> None:
    """Resume as an operator does, once all vehicles hold."""
    _run(watched, 5.0)
    key = keys.REQUEST.format(principal=PRINCIPAL)
    decode(watched.flight.bus.ask(key, encode(Resume())), Reply)
    _run(watched, 30.0, lambda: _flying(watched) == 4)
    _run(watched, 5.0)


def _exception(watched: MonitoredFlight, switch: InjectedFault) -> Finding:
    since, switch.raises = len(watched.events), 1
    _run(watched, 5.0)
    flying, reported = _flying(watched), watched.reported(since)
    if flying == 4 and reported:
        return passed(f"an exception in step: reported ({_short(reported)}), restarted once, all fly on")
    return failed(f"an exception in step: {flying} of 4 fly on, reported: {reported or 'nothing'}", RESTART_ADVICE)


RESTART_ADVICE = "snapshot() and restore() must let a new planner go on where the failed one was"


def _silence(watched: MonitoredFlight, switch: InjectedFault) -> Finding:
    since, switch.hangs = len(watched.events), True
    took_s = _run(watched, 10.0, lambda: _flying(watched) == 0)
    reported, held = watched.reported(since), _flying(watched) == 0
    switch.hangs = False
    _resume(watched)
    if held and reported and _flying(watched) == 4:
        return passed(f"a hang: all hold after {took_s:.1f} s, reported ({_short(reported)}), fly on after resume")
    holds = "all hold" if held else "NOT all hold"
    text = f"a hang: {holds}, reported: {reported or 'nothing'}; {_flying(watched)} of 4 fly on"
    return failed(text, "after a hold it must plan again from where vehicles are")


def _nonsense(watched: MonitoredFlight, switch: InjectedFault) -> Finding:
    since, before = len(watched.events), _vetoes(watched)
    switch.garbage = True
    _run(watched, 12.0)
    switch.garbage = False
    vetoes, reported = _vetoes(watched) - before, watched.reported(since)
    checks = {c.name: c for c in watched.script.referee.result().checks}
    bad = [checks[name] for name in ("separation, x limit", "outside operating area, m") if not checks[name].ok]
    if vetoes and reported and not bad:
        text = f"{vetoes} vetoes, reported ({_short(reported)}), no vehicle outside or close"
        return passed(f"garbage intents for 12 s: {text}")
    text = "; ".join(f"{c.name} {c.value}" for c in bad) or f"{vetoes} vetoes, reported: {reported or 'nothing'}"
    return failed(f"garbage intents for 12 s: {text}", "this is the station's fault, not the planner's: report it")


def _vetoes(watched: MonitoredFlight) -> int:
    return sum(watched.status.vetoes.values()) if watched.status is not None else 0


def _short(text: str) -> str:
    return text if len(text) <= 60 else text[:59] + "…"
