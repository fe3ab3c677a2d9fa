"""Errors of planners: separates refusals from mistakes, and finds the line of the planner's file that is to blame.

A planner refuses a task by raising ValueError in `configure`. Libraries raise ValueErrors, too (numpy's "zero-size
array to reduction operation"); those are mistakes of the planner.
"""

import ast
import signal
import sys
import traceback
from pathlib import Path

from tui_gcs.planner.api import Planner

LIBRARIES = ("site-packages", "dist-packages")
"""Folders whose files belong to installed packages, not to the planner's author."""
OUR_PLANNERS = Path(__file__).resolve().parents[1]
"""The folder of the built-in planners and of the machinery that runs them."""


class PlannerError(Exception):
    """A planner is unknown, cannot be loaded, or is given wrong parameters; one line names it and the reason."""


def is_keyboard_interrupt(error: BaseException) -> bool:
    """Return whether an exception raised by a planner is a Ctrl-C of the operator.

    Workers ignore SIGINT; there a KeyboardInterrupt is the planner's own.
    """
    return isinstance(error, KeyboardInterrupt) and signal.getsignal(signal.SIGINT) is not signal.SIG_IGN


def error_with_line(trace: str, path: Path) -> str:
    """Return one line for the author of `path`: the last place in that file that `trace` names, and the error."""
    lines = [line for line in trace.strip().splitlines() if line.strip()]
    error = next((line for line in reversed(lines) if not line.startswith(" ")), "it does not say why")
    where = ""
    for line in lines:
        text = line.strip()
        if text.startswith((f'File "{path}", line ', f'File "{path.resolve()}", line ')):
            number, _, function = text.partition(", line ")[2].partition(", in ")
            where = f"{path.name}:{number}" + (f" in {function}" if function not in ("", "<module>") else "")
    return f"{where or path.name}: {error}"


def is_refusal(error: ValueError, planner: type[Planner]) -> bool:
    """Return whether `error` was raised on purpose: by a `raise` in the planner's file, in one beside it, or in ours.

    Our files count because a planner may derive from a built-in one, which refuses tasks on its behalf.
    """
    source = getattr(sys.modules.get(planner.__module__), "__file__", None)
    frames = list(traceback.walk_tb(error.__traceback__))
    if not source or not frames:
        return False
    frame, line = frames[-1]
    place = Path(frame.f_code.co_filename).resolve()
    return _is_own(place, Path(source).resolve()) and _raises(place, line)


def last_line(text: str) -> str:
    """Return the last line of a traceback, which is the error itself."""
    return (text.strip().splitlines() or ["it does not say why"])[-1]


def _is_own(place: Path, source: Path) -> bool:
    if place == source or OUR_PLANNERS in place.parents:
        return True
    folder = source.parent
    if folder.name in LIBRARIES or folder not in place.parents:
        return False
    return not set(place.relative_to(folder).parts) & set(LIBRARIES)


def _raises(place: Path, line: int) -> bool:
    """Return whether a `raise` statement, rather than a call that failed, stands at `line`."""
    try:
        # A library's ValueError passes through the planner's file at a call; a refusal ends there at a `raise`.
        tree = ast.parse(place.read_bytes())
    except (OSError, SyntaxError, ValueError):
        return False
    statements = (node for node in ast.walk(tree) if isinstance(node, ast.Raise))
    return any(node.lineno <= line <= (node.end_lineno or node.lineno) for node in statements)
