"""How much a planner may send in one plan: beyond it the station would decode while vehicles wait for set-points."""

from collections.abc import Sequence

from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.common import Annotation, TeamPlan

MAX_BYTES, MAX_BYTES_EACH = 3_000_000, 20_000
"""Bytes of a plan: in all (most of it is its snapshot), and more for every vehicle of the team."""
MAX_LEARNT_BYTES = 16_000
"""What a planner learnt, as it is kept for later tasks: the station's state file is written anew with it."""
MIN_INTENTS, INTENTS_EACH = 64, 2
MAX_ANNOTATIONS, MAX_POINTS, MAX_TEXT_CELLS = 200, 20_000, 40
"""What a planner may draw on the map; more is cut."""
MAX_METRICS = 64
"""How many numbers a planner may publish; more are cut."""
MAX_NOTES, NOTES_PER_S = 5, 0.1
"""Notes to the operator: how many in one burst, and how many per second in the long run."""


def too_large(size: int, members: int) -> str:
    """Why a plan of `size` bytes is too large for a team of `members`; "" if it is not. Called before it is decoded."""
    most = MAX_BYTES + MAX_BYTES_EACH * members
    return f"plan of {size / 1e6:.1f} MB: at most {most / 1e6:.1f} MB" if size > most else ""


def most_intents(members: int) -> int:
    """How many intents a plan may have."""
    return max(MIN_INTENTS, INTENTS_EACH * members)


def too_many(plan: TeamPlan, members: int) -> str:
    """What is wrong with the number of its intents, "" if nothing is."""
    most = most_intents(members)
    return f"more than {most} intents for {members} vehicles" if len(plan.intents) > most else ""


def shown(annotations: Sequence[Annotation]) -> tuple[Annotation, ...]:
    """What is drawn of these: texts without control characters, not too many points."""
    kept, points = [], 0
    for drawing in annotations[:MAX_ANNOTATIONS]:
        # Cut between drawings: half of a polygon would be another one.
        points += len(drawing.points_m)
        if points > MAX_POINTS:
            break
        text = clean(drawing.text, MAX_TEXT_CELLS) if drawing.text else ""
        kept.append(Annotation(drawing.kind, drawing.points_m, text))
    return tuple(kept)
