"""How much a planner may say at once: beyond it the station would be busy with one plan while vehicles wait for it."""

from collections.abc import Sequence

from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.common import Annotation, Plan

MAX_BYTES, MAX_BYTES_EACH = 3_000_000, 20_000
"""Of a plan: in all (most of it is its snapshot), and more for every vehicle of the team."""
MAX_LEARNT_BYTES = 16_000
"""Of what a planner learnt, as it is kept for another task and another station: its memory is written anew with it."""
MIN_INTENTS, INTENTS_EACH = 64, 2
MAX_ANNOTATIONS, MAX_POINTS, MAX_TEXT_CELLS = 200, 20_000, 40
"""What a planner may draw; the rest is cut."""
MAX_METRICS = 64
"""And count."""
MAX_NOTES, NOTES_PER_S = 5, 0.1
"""And tell the operator: so many at once, and so often in the long run."""


def too_large(size: int, members: int) -> str:
    """What is wrong with a plan of so many bytes for so many vehicles, "" if nothing is. Asked before it is decoded."""
    most = MAX_BYTES + MAX_BYTES_EACH * members
    return f"plan of {size / 1e6:.1f} MB: at most {most / 1e6:.1f} MB" if size > most else ""


def most_intents(members: int) -> int:
    """How many intents a plan may have."""
    return max(MIN_INTENTS, INTENTS_EACH * members)


def too_many(plan: Plan, members: int) -> str:
    """What is wrong with the number of its intents, "" if nothing is."""
    most = most_intents(members)
    return f"more than {most} intents for {members} vehicles" if len(plan.intents) > most else ""


def shown(annotations: Sequence[Annotation]) -> tuple[Annotation, ...]:
    """What is drawn of these: texts without control characters, not too many points."""
    kept, points = [], 0
    for drawing in annotations[:MAX_ANNOTATIONS]:
        points += len(drawing.points_m)
        if points > MAX_POINTS:
            break
        text = clean(drawing.text, MAX_TEXT_CELLS) if drawing.text else ""
        kept.append(Annotation(drawing.kind, drawing.points_m, text))
    return tuple(kept)
