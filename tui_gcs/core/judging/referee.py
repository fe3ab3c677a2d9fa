"""The referee: measures a flight from what the station publishes, and from nothing else.

It begins a `ZoneMeasure` for each team in each round, and anew when a team loses a vehicle; one `FlightMeasure` watches
all vehicles. Their figures become checks: those of a team by what its planner is judged by (`team_checks`), and those
of the whole flight.
"""

from collections.abc import Mapping

from tui_gcs.core.judging.flight_measure import FlightMeasure
from tui_gcs.core.judging.flight_record import RecordedEvent
from tui_gcs.core.judging.flight_result import FlightResult, RoundResult
from tui_gcs.core.judging.incursions import Incursions, IntruderResult
from tui_gcs.core.judging.metric_log import MetricLog, gate_problems
from tui_gcs.core.judging.result_check import ResultCheck, at_least, at_most
from tui_gcs.core.judging.team_checks import coverage_checks, idleness_checks, intruder_checks, task_checks
from tui_gcs.core.judging.zone_measure import ZoneMeasure
from tui_gcs.core.protocol.common import EventClass, FleetFrame, JournalEvent, PlannerInfo, RunPhase, StationStatus
from tui_gcs.core.scenario.model import Round, Scenario, Team

ALERT, WARNING = 1, 4
"""MAVLink severities of events: the station reports faults of planners as alerts, and vetoes as warnings."""


class Referee:
    """Watches a whole flight and measures it."""

    def __init__(self, scenario: Scenario, planners: Mapping[str, PlannerInfo] | None = None) -> None:
        """`planners` holds what the teams' planners declare, by name; a flight of any other planner fails."""
        self._scenario = scenario
        self.planners: Mapping[str, PlannerInfo] = planners or {}
        self.metrics = MetricLog()
        self.incursions: Incursions | None = None
        """Counts intruders, where somebody knows where they are; None: none come."""
        self.measures: list[ZoneMeasure] = []
        self._area: Round | None = None
        self._flight = FlightMeasure(scenario.limits)
        self._status: StationStatus | None = None
        self.started: tuple[int, ...] = ()
        self.lost: set[int] = set()
        """Leave these vehicles out of what is expected: losing them is part of the flight."""
        self._latest = {ALERT: "", WARNING: ""}
        self._why_faults = self._why_vetoes = ""
        self._present: dict[str, ZoneMeasure] = {}
        self._members: dict[str, tuple[int, ...]] = {}
        self._last: FleetFrame | None = None
        self._frames = self._frames_lost = 0
        self._longest_gap_s = 0.0

    def begin_round(self, round_: Round, t_s: float) -> None:
        """Begin to measure a round."""
        self._area = round_
        self._flight.begin_round(round_.area)
        for team in self._scenario.teams:
            self._begin(team, t_s, "")

    def lose(self, vehicle: int, t_s: float) -> None:
        """Measure its team anew without a vehicle that is lost on purpose."""
        self.lost.add(vehicle)
        self._begin_anew(vehicle, t_s, f" ({vehicle} lost)")

    def find(self, vehicle: int, t_s: float) -> None:
        """Measure its team anew with a vehicle that is back."""
        self.lost.discard(vehicle)
        self._begin_anew(vehicle, t_s, f" ({vehicle} back)")

    def begin_again(self, t_s: float) -> None:
        """Measure every team anew after a hold."""
        for team in self._scenario.teams:
            present = self._present.get(team.name)
            if present is not None:
                present.cut_short = not present.done
                self._begin(team, t_s, f"{present.part} (after a hold)")

    def _begin_anew(self, vehicle: int, t_s: float, part: str) -> None:
        team = next((t for t in self._scenario.teams if vehicle in self._members.get(t.name, ())), None)
        present = self._present.get(team.name) if team is not None else None
        if team is not None and present is not None:
            present.cut_short = not present.done
            self._begin(team, t_s, present.part + part)
            if present.part and present.begin_s == t_s:  # several were lost at once: of no time nothing is measured
                self.measures.remove(present)

    def _begin(self, team: Team, t_s: float, part: str) -> None:
        if self._area is None:
            return
        zone = next(zone for zone in self._area.zones if zone.name == team.zone)
        info = self.planners.get(team.planner)
        judged_by = info.judged_by if info is not None else "metrics"
        measure = ZoneMeasure(self._scenario, self._area, zone, team.name, t_s, judged_by)
        if part:
            measure.carry_on(self._present[team.name])
        self._present[team.name] = measure
        measure.part = part
        measure.lasts_whole = judged_by == "intruders" and self.incursions is not None
        self.metrics.begin(self._area.name + part, team.name, t_s)
        self.measures.append(measure)

    def present(self) -> list[ZoneMeasure]:
        """The measures that run now, one of each team."""
        return list(self._present.values())

    def on_status(self, status: StationStatus) -> None:
        """Take faults, vetoes, and the teams' slots from a station status."""
        self._status = status
        # The event of the first fault or veto has just been reported: faults and vetoes themselves are only counted.
        if status.faults.get("planner") and not self._why_faults:
            self._why_faults = self._latest[ALERT]
        if any(status.vetoes.values()) and not self._why_vetoes:
            self._why_vetoes = self._latest[WARNING]
        by_name = {team.name: team for team in status.teams}
        self._members = {team.name: team.members for team in status.teams}
        for measure in self.present():
            team = by_name[measure.team]
            measure.on_points(sum(p.state == "open" and p.team in ("", measure.team) for p in status.points))
            measure.on_status(team, sum(1 for v in team.members if v in self.started and v not in self.lost))
        if status.run is RunPhase.RUNNING and self._area is not None:  # a planner does not count on vehicles that hold
            measured = {name: measure for name, measure in self._present.items() if not measure.done}
            rounds = {name: self._area.name + measure.part for name, measure in measured.items()}
            self.metrics.on_status(status, rounds)

    def on_event(self, event: JournalEvent) -> None:
        """Take what the station reports of planners, which explains faults and vetoes."""
        if event.cls is EventClass.PLANNER and event.severity in self._latest:
            self._latest[event.severity] = event.text

    def on_frame(self, frame: FleetFrame) -> None:
        """Take positions and phases of all vehicles of teams from a fleet frame."""
        self._count(frame)
        rows = [row for row in frame.rows() if row.team]
        for measure in self.present():
            measure.on_frame(frame, rows)
        self._flight.on_rows(rows)

    def _count(self, frame: FleetFrame) -> None:
        """Count frames and gaps by the frames' numbers."""
        last, self._last = self._last, frame
        self._frames += 1
        if last is None:
            return
        # Frames are numbered; a restarted station counts from 1 again, which is no loss.
        self._frames_lost += max(0, frame.seq - last.seq - 1)
        # A gap on the ground misses nothing.
        if any(last.armed):
            self._longest_gap_s = max(self._longest_gap_s, frame.t_s - last.t_s)

    def result(self) -> FlightResult:
        """The result so far."""
        rounds = [measure.result() for measure in self.measures]
        return FlightResult(
            self._scenario.name,
            self._scenario.seed,
            self._checks(rounds),
            rounds,
            self._frames,
            self._frames_lost,
            round(self._longest_gap_s, 2),
            intruders=self._intruders(),
            metrics=self.metrics.series(self.planners, self._scenario),
            records=sorted(
                [*(self.incursions.records() if self.incursions is not None else []), *self._point_records()],
                key=lambda each: each.t_s,
            ),
        )

    def _round_checks(self, measure: ZoneMeasure, r: RoundResult) -> list[ResultCheck]:
        """The checks of one team in one round: by what its planner is for, and by its own metrics."""
        limits, where, why = self._scenario.results, f"{r.round} {r.zone}", measure.why_not_measured()
        checks: list[ResultCheck] = []
        if measure.judged_by == "idleness":
            checks += idleness_checks(where, r, limits, why)
        elif measure.judged_by == "coverage":
            checks += coverage_checks(where, r, limits)
        elif measure.judged_by == "tasks":
            checks += self._task_checks(r)
        elif measure.judged_by == "intruders" and not self._came(r):
            # Nobody came: it is judged by whether it was there.
            checks.append(at_most(f"{where}: all on slot, s", r.on_slot_after_s, limits.on_slot_max_s, why))
        planner = next(team.planner for team in self._scenario.teams if team.name == r.team)
        if (info := self.planners.get(planner)) is None:
            why = f"what planner {planner} is judged by is not known"
            return [*checks, ResultCheck(f"{where}: planner {planner}"[:52], False, None, None, why)]
        return checks + self.metrics.checks(r.round, r.team, info, limits.metrics)

    def _task_checks(self, r: RoundResult) -> list[ResultCheck]:
        # Points are of the whole flight: they are judged once, with the last round.
        last = [measure for measure in self.measures if measure.team == r.team][-1]
        if self._status is None or r.round != last.round_name + last.part:
            return []
        return task_checks(r.team, list(self._status.points), self._scenario.results.tasks_done_min)

    def _point_records(self) -> list[RecordedEvent]:
        """What became of each point of interest."""
        status = self._status
        if status is None:
            return []
        begin_s = status.t_s - status.mission_time_s
        return [
            RecordedEvent(
                round(point.ended_s - begin_s, 1),
                "",
                f"task {point.state}",
                point.name,
                point.vehicle or None,
                f"priority {point.priority:g}, {point.ended_s - point.added_s:.0f} s after it was added",
            )
            for point in status.points
            if point.state != "open"
        ]

    def _intruders(self) -> list[IntruderResult]:
        return self.incursions.results() if self.incursions is not None else []

    def _came(self, r: RoundResult) -> int:
        """How many intruders came to a zone in a round."""
        return sum(i.came for i in self._intruders() if r.round.startswith(i.round) and i.zone == r.zone)

    def _checks(self, rounds: list[RoundResult]) -> list[ResultCheck]:
        limits = self._scenario.results
        checks: list[ResultCheck] = []
        for measure, r in zip(self.measures, rounds, strict=True):
            # A measure that was cut short is not judged; the one that was begun anew is.
            if r.cut_short:
                continue
            checks += self._round_checks(measure, r)
        checks += intruder_checks(rounds, self._intruders(), limits.intruders_met_min)
        for gate, problem in gate_problems(self._scenario, self.planners):
            checks.append(
                ResultCheck(f"results.metrics.{gate}", False, None, self._scenario.results.metrics[gate], problem)
            )
        faults = self._status.faults if self._status is not None else {"no status": 1}
        vetoes = self._status.vetoes if self._status is not None else {}
        kept = [v for v in self.started if v not in self.lost]
        checks += [
            at_least("vehicles flown", float(len(self._flight.flew)), float(self._scenario.vehicle_count)),
            *self._flight.region_checks(),
            *self._flight.landing_checks(kept, limits.landing_error_max_m),
            at_most("unanswered commands", float(faults.get("unanswered commands", 0)), 0.0),
            at_most("planner intents refused on slot", float(faults.get("refused on slot", 0)), 0.0),
            _no_vetoes(vetoes, self._why_vetoes),
            _no_faults(float(faults.get("planner", 0)), self._why_faults),
            at_most("link faults", float(faults.get("link", 0)), 0.0),
        ]
        return checks


def _no_vetoes(vetoes: dict[str, int], reported: str) -> ResultCheck:
    """The check that the guard vetoed nothing.

    `vetoes` counts by reason, the most frequent comes first. `reported` is what the station reported of the first one.
    """
    check = at_most("guard vetoes", float(sum(vetoes.values())), 0.0)
    commonest_first = sorted(vetoes.items(), key=lambda reason: (-reason[1], reason[0]))
    counts = ", ".join(f"{code}: {count}" for code, count in commonest_first if count)
    check.why = "; ".join(filter(None, (counts, reported if counts else "")))
    return check


def _no_faults(count: float, reported: str) -> ResultCheck:
    """The check that no planner failed; `reported` is what the station reported of the first failure."""
    check = at_most("planner faults", count, 0.0)
    check.why = reported if count else ""
    return check
