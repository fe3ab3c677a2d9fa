"""Errors of planners: which are refusals, which mistakes, and where in the planner's file a mistake is.

A planner refuses a task by raising ValueError in `configure`. Libraries raise ValueErrors, too (numpy's "zero-size
array to reduction operation"): those are mistakes of the planner.
"""

import ast
import signal
import sys
import traceback
from pathlib import Path

from tui_gcs.planner.api import Planner

LIBRARIES = ("site-packages", "dist-packages")
OUR_PLANNERS = Path(__file__).resolve().parents[1]
"""The folder of the built-in planners and what runs them."""


class PlannerError(Exception):
    """A planner that is unknown, cannot be loaded, or is given wrong parameters; one line says which and why."""


def is_operators(error: BaseException) -> bool:
    """Whether what came out of a planner is a Ctrl-C. Where those are ignored, in workers, it is the planner's own."""
    return isinstance(error, KeyboardInterrupt) and signal.getsignal(signal.SIGINT) is not signal.SIG_IGN


def blame(trace: str, path: Path) -> str:
    """One line for the author of `path`: the last place in it that a traceback (as text) names, and the error."""
    lines = [line for line in trace.strip().splitlines() if line.strip()]
    error = next((line for line in reversed(lines) if not line.startswith(" ")), "it does not say why")
    where = ""
    for line in lines:
        text = line.strip()
        if text.startswith((f'File "{path}", line ', f'File "{path.resolve()}", line ')):
            number, _, function = text.partition(", line ")[2].partition(", in ")
            where = f"{path.name}:{number}" + (f" in {function}" if function not in ("", "<module>") else "")
    return f"{where or path.name}: {error}"


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


def last_line(text: str) -> str:
    """The last line of a traceback: the error itself."""
    return (text.strip().splitlines() or ["it does not say why"])[-1]


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
