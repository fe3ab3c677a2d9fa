"""The results of a flight: what each team reached in each round, the checks, and what the figures do not cover."""

import msgspec

from tui_gcs.core.geometry.zone_cells import UnreachablePart
from tui_gcs.core.judging.flight_record import RecordedEvent
from tui_gcs.core.judging.incursions import IntruderResult
from tui_gcs.core.judging.metric_log import MetricSeries
from tui_gcs.core.judging.result_check import ResultCheck
from tui_gcs.core.protocol.planning import JudgedBy

GAP_S = 0.5
"""Frames come every 0.1 s; in a gap of this length vehicles can pass each other, or a cell, unseen."""


class RoundResult(msgspec.Struct):
    """What one team reached in one round. None: it was not measured."""

    round: str
    zone: str
    role: str
    team: str
    n: int
    """The number of vehicles on slots, without those in reserve."""
    on_slot_after_s: float | None
    measured_s: float
    worst_idleness_s: float | None
    avg_idleness_s: float | None
    coverage: float
    bound_s: float | None
    """Worst idleness that no plan beats; None where no vehicle was on a slot."""
    ratio: float | None
    """Worst idleness over `ideal_s`."""
    period_s: float | None
    off_slot_p95_m: float | None = None
    """The distance from the plan that 95 % of all positions in the measured time keep."""
    off_slot_max_m: float | None = None
    lag_max_s: float | None = None
    """The earliest or latest of all vehicles, smoothed over two seconds."""
    stands: bool = False
    """Whether vehicles hover over the zone or are so slow that none can be told to be early or late."""
    cut_short: bool = False
    """The team lost a vehicle before this was measured: it is not judged, and what follows is measured anew."""
    reserve: int = 0
    """Vehicles that waited in reserve when all were on their slots."""
    judged_by: JudgedBy = "idleness"
    covered_s: float | None = None
    """Seconds from the beginning until every cell was seen once, where that is judged."""
    cover_bound_s: float | None = None
    """The least time that this can take, where it is judged."""
    p99_idleness_s: float | None = None
    """Worst idleness that 99 % of the area keeps."""
    ideal_s: float | None = None
    """A / (n v 2r), A being the area that can be seen; None where no vehicle was on a slot."""
    cells: int = 0
    """Number of cells that can be seen."""
    unseen_cells: int = 0
    """How many of `cells` were never seen."""
    unseen_s: float | None = None
    """For how long they were not seen: since all vehicles were on their slots."""
    unreachable: tuple[UnreachablePart, ...] = ()
    """Parts of the zone that no vehicle can see; they count in no figure."""

    @property
    def unseen(self) -> str:
        """Which cells were not seen, as text; "" if all were."""
        if not self.unseen_cells or self.unseen_s is None:
            return ""
        return f"{self.unseen_cells:,} of {self.cells:,} cells unseen for {self.unseen_s:.0f} s"


class FlightResult(msgspec.Struct):
    """The result of a whole flight."""

    scenario: str
    seed: int
    checks: list[ResultCheck]
    rounds: list[RoundResult]
    frames: int = 0
    """Fleet frames that were measured."""
    frames_lost: int = 0
    """Fleet frames that the station published and the bus dropped on the way to the referee."""
    longest_gap_s: float = 0.0
    """The longest time without a frame while vehicles flew."""
    intruders: list[IntruderResult] = []
    """Results of a rehearsal with intruders."""
    metrics: list[MetricSeries] = []
    """What the planners published, over time."""
    records: list[RecordedEvent] = []
    """What happened one by one: intruders met, tasks done."""

    @property
    def incomplete(self) -> str:
        """What the figures do not cover, as text; "" if no frame was missed."""
        if not self.frames_lost and self.longest_gap_s <= GAP_S:
            return ""
        missed = []
        if self.frames_lost:
            missed.append(f"{self.frames_lost} of {self.frames + self.frames_lost} pictures of the fleet lost")
        if self.longest_gap_s > GAP_S:
            missed.append(f"no picture of the fleet for up to {self.longest_gap_s:.1f} s")
        return "figures are INCOMPLETE: " + ", ".join(missed)

    @property
    def ok(self) -> bool:
        """Whether all checks of the flight hold."""
        return all(check.ok for check in self.checks)
