"""Whether a ValueError out of `configure` was meant: raising one is how a planner says that it cannot do a task.

Libraries raise ValueErrors, too (numpy's "zero-size array to reduction operation"): those are mistakes of the planner.
"""

import ast
import sys
import traceback
from pathlib import Path

from tui_gcs.planner.api import Planner

LIBRARIES = ("site-packages", "dist-packages")
OUR_PLANNERS = Path(__file__).resolve().parents[1]
"""The folder of the built-in planners and what runs them."""


def is_meant(error: ValueError, planner: type[Planner]) -> bool:
    """Whether a `raise` of the planner's own made `error`: in its file, in one beside it, or in one of ours.

    Ours count because a planner may derive from a built-in one, which refuses for it.
    """
    source = getattr(sys.modules.get(planner.__module__), "__file__", None)
    frames = list(traceback.walk_tb(error.__traceback__))
    if not source or not frames:
        return False
    frame, line = frames[-1]
    place = Path(frame.f_code.co_filename).resolve()
    return _is_own(place, Path(source).resolve()) and _raises(place, line)


def _is_own(place: Path, source: Path) -> bool:
    if place == source or OUR_PLANNERS in place.parents:
        return True
    folder = source.parent
    if folder.name in LIBRARIES or folder not in place.parents:
        return False
    return not set(place.relative_to(folder).parts) & set(LIBRARIES)


def _raises(place: Path, line: int) -> bool:
    """Whether there is a `raise` statement there, not a call that failed."""
    try:
        tree = ast.parse(place.read_bytes())
    except (OSError, SyntaxError, ValueError):
        return False
    statements = (node for node in ast.walk(tree) if isinstance(node, ast.Raise))
    return any(node.lineno <= line <= (node.end_lineno or node.lineno) for node in statements)
