"""Records every veto of a rehearsal with what the vehicle did and what its planner thought at that moment."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.guard.motion_prediction import VehicleState
from tui_gcs.core.guard.permission import Verdict
from tui_gcs.core.motion.course import Reference
from tui_gcs.core.protocol.bus import PLAN, Bus
from tui_gcs.core.protocol.common import Intent, TeamPlan, Vec3, decode


@dataclass(frozen=True)
class RecordedVeto:
    """One set-point that the guard refused."""

    t_s: float
    vehicle: int
    code: str
    text: str
    place_m: Vec3
    velocity_m_s: Vec3
    asked_m: Vec3
    asked_m_s: Vec3
    planned: str

    def line(self) -> str:
        """Return one line for a person."""
        x, y, z = self.place_m
        vx, vy, _ = self.velocity_m_s
        (px, py, _), (ux, uy, _) = self.asked_m, self.asked_m_s
        return (
            f"     veto at {self.t_s:6.1f} s: vehicle {self.vehicle} at ({x:.1f}, {y:.1f}, {z:.1f}), ({vx:+.1f}, "
            f"{vy:+.1f}) m/s, asked ({px:.1f}, {py:.1f}), ({ux:+.1f}, {uy:+.1f}) m/s; {self.code}: {self.text}; "
            f"planner: {self.planned}"
        )


@dataclass
class VetoRecord:
    """The vetoes of one rehearsal, and the newest intent for each vehicle."""

    vetoes: list[RecordedVeto] = field(default_factory=list)
    intents: dict[int, Intent] = field(default_factory=dict)

    def listen(self, bus: Bus) -> None:
        """Keep the newest intent for each vehicle."""
        bus.subscribe(PLAN.format(team="*"), lambda _key, data: self._on_plan(decode(data, TeamPlan)))

    def _on_plan(self, plan: TeamPlan) -> None:
        self.intents.update({intent.vehicle: intent for intent in plan.intents})

    def thought(self, vehicle: int) -> str:
        """Return what the planner's newest intent says of this vehicle."""
        intent = self.intents.get(vehicle)
        if intent is None:
            return "no intent yet"
        return f"{intent.kind} slot {intent.slot} {'joined' if intent.joined else 'not joined'} {intent.reason}".strip()


@contextmanager
def recorded(record: VetoRecord) -> Iterator[None]:
    """Add every veto of every guard to the record."""
    judge = Guard.judge

    def judged(
        guard: Guard, states: list[VehicleState], sent: Sequence[Reference], known: list[VehicleState], now: float
    ) -> list[Verdict]:
        verdicts = judge(guard, states, sent, known, now)
        for state, reference, verdict in zip(states, sent, verdicts, strict=True):
            if not verdict.ok:
                place_m, velocity_m_s, thought = state.position_m, state.velocity_m_s, record.thought(state.id)
                found = now, state.id, verdict.code, verdict.text, place_m, velocity_m_s, *reference.at(now), thought
                record.vetoes.append(RecordedVeto(*found))
        return verdicts

    Guard.judge = judged
    try:
        yield
    finally:
        Guard.judge = judge
