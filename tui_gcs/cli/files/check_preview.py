"""`tui-gcs check SCENARIO --preview`: what its planners would achieve in each round, as on the plan screen."""

import math
import multiprocessing
import os
import sys
import time
from collections import deque
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass, replace

import msgspec

from tui_gcs.cli.files.bounded import TimeUsedUp, bounded
from tui_gcs.cli.files.check_lines import AUTOPILOTS, NOTE, WORDS, FindingLine
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.firmware.own_limits import OwnLimits, own_limits
from tui_gcs.core.firmware.registry import off_course_m
from tui_gcs.core.flight.planner_tasks import crewed, crews, within_own_limits
from tui_gcs.core.geometry.zones import area_m2
from tui_gcs.core.judging.team_separation import findings, summary
from tui_gcs.core.mavlink.enum_names import autopilot_name
from tui_gcs.core.missions.mission_findings import FindingLevel
from tui_gcs.core.missions.scenario_findings import ScenarioFinding, gate_findings, preview_findings
from tui_gcs.core.protocol.common import FleetFrame, PlannerTask, PreviewResult, PreviewTask
from tui_gcs.core.scenario.model import Round, Scenario
from tui_gcs.planner.lazy_scipy import warm_up
from tui_gcs.planner.runtime import registry
from tui_gcs.planner.runtime.plan_forecast import SearchLimit
from tui_gcs.planner.runtime.preview import preview

MAX_BYTES = 300_000_000
"""Memory for all previews that run at the same time, beside what the program takes."""
Key = tuple[str, str]
"""The names of a round and a team."""
MAX_NAMED = 6
"""So many teams are named of those for which no time was left."""
MIN_S = 0.05
"""With less time than this no preview is begun."""
TEAM_S = 0.06
"""What a team takes beside its own processor time: its process, its data and what is said of it. It is taken from the
time of all: 250 vehicles in 20 teams, three rounds, took 13.7 s where 10 were allowed."""
MAX_FOOTPRINTS = 2000
"""Footprints that fill a zone. A patrol with 1600 needs about 4 s and 230 MB, one with 24,000 12 s and 820 MB."""
SEARCH_SHARE, SEARCH_LIMIT_SHARE = 0.9, 0.6
"""A search ends after so much of its team's share of the time, and of all that it may take; then its plan is flown."""
PLAN_S, SEARCH_STEP_S = 2.2, 0.1
"""Processor time of a first plan and of a step of the search on a busy computer; an idle one needs half of it.

The steps that a team is granted are counted by these, not by the clock: the same file gives the same figures again.
"""


@dataclass
class _Budget:
    """The processor time of a preview, shared by the teams that are still to come."""

    seconds: float
    """What the user allows, on each core that is used."""
    workers: int
    waiting: int
    """Teams that have not begun."""
    used_s: float = 0.0
    granted_s: float = 0.0
    """Shares of those that run now."""

    def next_share_s(self) -> float:
        """Return the share of the next team: as much as that of all that wait with it."""
        share_s = max(self._left_s(), 0.0) / self.waiting
        self.waiting -= 1
        self.granted_s += share_s
        return share_s

    def limit_s(self, share_s: float) -> float:
        """Return how long a team with this share may compute: what the others are not granted, on one core.

        The kernel's timers count by ticks and run fast on a busy computer: a quarter of the share is added.
        """
        return min(1.25 * share_s + max(self._left_s(), 0.0), self.seconds)

    def done(self, share_s: float, used_s: float) -> None:
        """Count what a team has used."""
        self.granted_s -= share_s
        self.used_s += used_s

    def _left_s(self) -> float:
        return self.seconds * self.workers - self.used_s - self.granted_s


@dataclass(frozen=True)
class _Job:
    """The preview of one team in one round, with its limits."""

    ask: PreviewTask
    task: PlannerTask
    seconds: float
    """What the user allows, for the message."""
    share_s: float = 0.0
    limit_s: float = 0.0
    search_steps: int = 0
    max_bytes: int = MAX_BYTES


def preview_lines(scenario: Scenario, autopilot: str, seconds: float) -> list[FindingLine]:
    """Return the preview of every round, with all vehicles at their take-off places.

    Teams with an unknown planner are left out. `autopilot` is a key of `AUTOPILOTS`: the better it keeps to its course,
    the wider apart a patrol's lanes may be. `seconds` is the processor time that all teams may take on each of at most
    two cores: every team's search has the same number of steps, fewer if its share of the time is over before. Those
    for which nothing is left are named.
    """
    number = AUTOPILOTS[autopilot]
    off_m, own = off_course_m(number), own_limits(number, {}, simulated=True)
    jobs = {
        (round_.name, job.task.team): job
        for round_ in scenario.rounds
        for job in _jobs(scenario, round_, off_m, own, seconds)
    }
    results = _previews(jobs, seconds)
    lines = [
        FindingLine(WORDS[finding.level], round_.name, ": ".join(filter(None, (finding.text, finding.detail))))
        for round_ in scenario.rounds
        for finding in _round(
            scenario, round_, [found for (name, _), found in results.items() if name == round_.name], seconds
        )
    ]
    told = f"planned for {autopilot_name(number)}, up to {off_m:g} m beside its course (--autopilot)"
    if own.speed_m_s < scenario.limits.speed_m_s or own.accel_m_s2 < scenario.limits.accel_m_s2:
        told += f", with the {own.speed_m_s:g} m/s and {own.accel_m_s2:.3g} m/s2 that it flies at most"
    return [*lines, FindingLine(NOTE, "preview", told)]


def _jobs(scenario: Scenario, round_: Round, off_m: float, own: OwnLimits, seconds: float) -> Iterator[_Job]:
    crew_of, nobody = crews(scenario), FleetFrame(seq=0, t_s=0.0, wall_s=0.0, kind=RunKind.SIM)
    starts_m = {vehicle: place.place_m for crew in crew_of.values() for vehicle, place in crew.items()}
    for team in scenario.teams:
        if team.planner in registry.names():
            task = msgspec.structs.replace(crewed(scenario, round_, team, crew_of[team.name]), off_course_m=off_m)
            task = within_own_limits(task, dict.fromkeys(task.members, own))
            yield _Job(PreviewTask(0, task, nobody, starts_m=starts_m), task, seconds)


def _round(
    scenario: Scenario, round_: Round, results: list[PreviewResult], seconds: float
) -> Iterator[ScenarioFinding]:
    planner_of = {team.name: team.planner for team in scenario.teams}
    infos = registry.infos(set(planner_of.values()))
    late = [found.team for found in results if found.text == _used_up(seconds)]
    if late:
        names = ", ".join(late[:MAX_NAMED]) + (f" and {len(late) - MAX_NAMED} more" if len(late) > MAX_NAMED else "")
        yield ScenarioFinding(FindingLevel.CAUTION, f"{names}: no plan: {_used_up(seconds)}", "")
    for found in results:
        if found.team not in late:
            yield from preview_findings(found)
            if (info := infos.get(planner_of[found.team])) is not None and info.judged_by == "idleness":
                yield from gate_findings(scenario, round_, found)
    ways = {found.team: found.ways for found in results if found.ways is not None}
    yield from summary(findings(ways, scenario.limits))


def search_steps(share_s: float) -> int:
    """Return the steps of search for a team whose share of the time is this."""
    return max(0, int((share_s - PLAN_S) / SEARCH_STEP_S))


def _used_up(seconds: float) -> str:
    return f"the {seconds:g} s for all teams are used up (--seconds S for more)"


def _previews(jobs: dict[Key, _Job], seconds: float) -> dict[Key, PreviewResult]:
    """Return the result of every job, in the order of the jobs, computed on two cores where there are two."""
    results: dict[Key, PreviewResult] = {}
    workers = min(2, os.cpu_count() or 1, len(jobs))
    left_s = max(seconds - TEAM_S * len(jobs), seconds / 2)
    budget, waiting = _Budget(left_s, workers, len(jobs)), deque(jobs.items())
    steps = search_steps(seconds * workers / max(len(jobs), 1))
    # Forked, a process begins with everything imported; elsewhere than on Linux forking is not safe.
    warm_up()
    context = multiprocessing.get_context("fork" if sys.platform == "linux" else None)
    with ProcessPoolExecutor(max(workers, 1), mp_context=context) as pool:
        running: dict[Future[tuple[PreviewResult, float]], tuple[Key, _Job]] = {}
        while waiting or running:
            while waiting and len(running) < workers:
                key, job = waiting.popleft()
                share_s = budget.next_share_s()
                job = replace(
                    job,
                    share_s=share_s,
                    limit_s=budget.limit_s(share_s),
                    search_steps=steps,
                    max_bytes=MAX_BYTES // workers,
                )
                running[pool.submit(_preview, job)] = key, job
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                key, job = running.pop(future)
                results[key], used_s = future.result()
                budget.done(job.share_s, used_s)
    return {key: results[key] for key in jobs}


def _preview(job: _Job) -> tuple[PreviewResult, float]:
    """The preview of one team, within limits, and the time that it took; a failed one with what is too fine."""
    task, begin_s = job.task, time.process_time()
    area = area_m2(task.zone.shape)
    smallest_m = math.sqrt(area / (math.pi * MAX_FOOTPRINTS))
    fine = f"a footprint of {task.footprint_radius_m:g} m radius in a zone of {area:.0f} m2"
    used_up = _used_up(job.seconds)
    if task.footprint_radius_m < smallest_m:
        text = f"{fine} is too fine to plan: {math.ceil(100 * smallest_m) / 100:g} m at least"
    elif job.limit_s <= MIN_S:
        text = used_up
    else:
        try:
            with bounded(job.limit_s, job.max_bytes):
                search_s = min(SEARCH_SHARE * job.share_s, SEARCH_LIMIT_SHARE * job.limit_s)
                limit = SearchLimit(job.search_steps, begin_s + search_s)
                return preview(job.ask, {}, limit), time.process_time() - begin_s
        except TimeUsedUp:
            text = used_up if job.limit_s < job.seconds else f"{used_up}: {fine} may be too fine"
        except MemoryError:
            text = f"not planned with {job.max_bytes // 1_000_000} MB: {fine} may be too fine"
    return PreviewResult(task.team, job.ask.number, "failed", text=text), time.process_time() - begin_s
