"""Open tasks from outside, points of interest, as drawings of the map."""

from collections.abc import Iterable

from tui_gcs.core.protocol.common import Annotation, PointOfInterest

TASKS = " tasks"
"""The key under which a map shows them beside the drawings of teams: no team has such a name."""


def task_markers(points: Iterable[PointOfInterest]) -> tuple[Annotation, ...]:
    """Return a marker with its name for each open point."""
    return tuple(Annotation("marker", (point.place_m,), point.name) for point in points if point.state == "open")
