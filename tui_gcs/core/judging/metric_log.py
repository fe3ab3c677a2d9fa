"""Metrics over time: what the planners of all teams published, round by round, and how it compares with gates.

A gate is a planner's own (`Metric.gate`) or the scenario's (`[results.metrics]`), which replaces it. A gate whose
metric was never published fails.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import msgspec

from tui_gcs.core.judging.result_check import ResultCheck, at_least, at_most
from tui_gcs.core.protocol.common import PlannerInfo, StationStatus
from tui_gcs.core.protocol.planning import Metric
from tui_gcs.core.scenario.model import Scenario

SAMPLE_S = 1.0
"""Time between two samples that are kept, at first."""
MAX_SAMPLES = 1200
"""A longer series keeps every second sample, again and again: 20 minutes at first, 40 then."""
ENDS = ("_min", "_max")


class MetricSeries(msgspec.Struct):
    """One metric of one team in one round, as the station's statuses had it twice a second.

    The statistics are of all these values, the samples may be thinned out.
    """

    round: str
    team: str
    name: str
    unit: str
    last: float | None
    mean: float | None
    low: float | None
    high: float | None
    times_s: list[float]
    """Seconds since the round began."""
    values: list[float | None]
    """None: it was published, and unknown (NaN)."""


@dataclass
class _Samples:
    """The samples of one metric while it is recorded."""

    times_s: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    step_s: float = SAMPLE_S
    last: float = math.nan
    total: float = 0.0
    count: int = 0
    low: float = math.inf
    high: float = -math.inf

    def add(self, t_s: float, value: float) -> None:
        self.last = value
        if math.isfinite(value):
            self.total, self.count = self.total + value, self.count + 1
            self.low, self.high = min(self.low, value), max(self.high, value)
        if self.times_s and t_s < self.times_s[-1] + self.step_s - 1e-6:
            return
        self.times_s.append(t_s)
        self.values.append(value)
        if len(self.times_s) > MAX_SAMPLES:
            self.times_s, self.values, self.step_s = self.times_s[::2], self.values[::2], self.step_s * 2.0

    def of(self, metric: Metric) -> float | None:
        """Return the value that the metric's gate is compared with; None where it is unknown."""
        worst = self.low if metric.better == "higher" else self.high
        mean = self.total / self.count if self.count else math.nan
        return _known({"last": self.last, "worst": worst, "mean": mean}[metric.of])


class MetricLog:
    """Keeps the metrics of a flight by round and team."""

    def __init__(self) -> None:
        self._series: dict[tuple[str, str], dict[str, _Samples]] = {}
        """By (round, team), then by name."""
        self._begin_s: dict[tuple[str, str], float] = {}

    def begin(self, round_: str, team: str, t_s: float) -> None:
        """Begin to record a team in a round, or in a part of one."""
        self._series[round_, team] = {}
        self._begin_s[round_, team] = t_s

    def on_status(self, status: StationStatus, rounds: Mapping[str, str]) -> None:
        """Take the metrics in a status; `rounds` names the round of each team that is recorded now."""
        for team in status.teams:
            key = (rounds.get(team.name, ""), team.name)
            if key not in self._series:
                continue
            for name, value in team.metrics.items():
                samples = self._series[key].setdefault(name, _Samples())
                samples.add(round(status.t_s - self._begin_s[key], 2), value)

    def series(self, planners: Mapping[str, PlannerInfo], scenario: Scenario) -> list[MetricSeries]:
        """Return everything that was recorded, with the units that planners declare."""
        units = {
            (team.name, metric.name): metric.unit
            for team in scenario.teams
            if (info := planners.get(team.planner)) is not None
            for metric in info.metrics
        }
        return [
            MetricSeries(
                round_,
                team,
                name,
                units.get((team, name), ""),
                _known(s.last),
                _known(s.total / s.count if s.count else math.nan),
                _known(s.low),
                _known(s.high),
                s.times_s,
                [_known(value) for value in s.values],
            )
            for (round_, team), by_name in self._series.items()
            for name, s in sorted(by_name.items())
        ]

    def checks(self, round_: str, team: str, info: PlannerInfo, gates: Mapping[str, float]) -> list[ResultCheck]:
        """Return the checks of one team's metrics in one round; `gates` are the scenario's."""
        found = []
        for metric in info.metrics:
            samples = self._series.get((round_, team), {}).get(metric.name)
            value = samples.of(metric) if samples is not None else None
            why = f"its planner never published {metric.name}" if samples is None else f"{metric.name} is unknown"
            name = f"{round_} {team}: {metric.name}" + ("" if metric.of == "last" else f", {metric.of}")
            for end, limit in _gates_of(metric, gates):
                check = at_least if end == "_min" else at_most
                found.append(check(name, value, limit, why))
        return found


def _gates_of(metric: Metric, gates: Mapping[str, float]) -> list[tuple[str, float]]:
    """Return (end of its name, limit) of the gates of a metric: the scenario's, else the planner's own."""
    given = [(end, gates[metric.name + end]) for end in ENDS if metric.name + end in gates]
    if given or metric.gate is None:
        return given
    return [("_min" if metric.better == "higher" else "_max", float(metric.gate))]


def gate_problems(scenario: Scenario, planners: Mapping[str, PlannerInfo]) -> list[tuple[str, str]]:
    """Return (key in `[results.metrics]`, what is wrong) of gates whose metric no planner of a team declares.

    While the planner of some team is not known, every gate may be one of its own.
    """
    infos = [planners.get(name) for name in dict.fromkeys(team.planner for team in scenario.teams)]
    known = [info for info in infos if info is not None]
    if len(known) < len(infos):
        return []
    names = {metric.name for info in known for metric in info.metrics}
    what = f"no planner of this scenario declares that metric; {_declared(known)}"
    return [(gate, what) for gate in scenario.results.metrics if gate[: -len(ENDS[0])] not in names]


def _declared(infos: Iterable[PlannerInfo]) -> str:
    """Return the planners' metrics in words, for an error line."""
    return "; ".join(
        f"{info.name} declares {', '.join(metric.name for metric in info.metrics) or 'no metrics'}" for info in infos
    )


def _known(value: float) -> float | None:
    """Return a value as results hold it: rounded to six significant digits, None where it is unknown."""
    return float(f"{value:.6g}") if math.isfinite(value) else None
