"""Loads a planner from a file and reports in one line what is wrong with the file, and where."""

import sys
import traceback
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from types import ModuleType

from tui_gcs.core.base.regular_file import open_plain
from tui_gcs.planner.api import Planner
from tui_gcs.planner.runtime.planner_errors import PlannerError, error_with_line, is_keyboard_interrupt

MAX_SOURCE_BYTES = 4_000_000
"""A longer file is refused: no source of a planner is that long."""


@dataclass(frozen=True)
class PlannerFile:
    """A planner file given on the command line; it replaces any other planner of the same name."""

    name: str
    path: Path
    sha256: str
    """Digest of the file's content at the start. With any other content the file is not loaded."""


def load_file(path: Path, wanted_sha256: str = "") -> type[Planner]:
    """Return the one planner class that a file defines. The file's code runs now, in this process.

    Classes with a leading underscore and base classes of other classes in the file are ignored. With `wanted_sha256`
    only that content is loaded.

    Raises:
        PlannerError: one line, with file and line where there is one.
    """
    source = read_source(path)
    found = sha256(source).hexdigest()
    if wanted_sha256 and found != wanted_sha256:
        what = f"changed since the start (sha256 {found[:12]}, was {wanted_sha256[:12]})"
        raise PlannerError(f"{path}: {what}: put it back, or start anew with --planner")
    module = ModuleType(f"tui_gcs_planner_{sha256(str(path.resolve()).encode()).hexdigest()[:12]}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module  # dataclasses and pickle look a class's module up there
    if str(path.parent) not in sys.path:
        sys.path.append(str(path.parent))  # last: a file beside it must not take the place of a library
    try:
        exec(compile(source, str(path), "exec"), module.__dict__)  # noqa: S102 - that is what a planner file is for
    except SyntaxError as error:
        raise PlannerError(f"{Path(error.filename or path).name}:{error.lineno}: {error.msg}") from None
    except BaseException as error:
        if is_keyboard_interrupt(error):
            raise
        raise PlannerError(error_with_line("".join(traceback.format_exception(error)), path)) from None
    return _only_planner(module, path)


def read_source(path: Path) -> bytes:
    """Return the file's bytes. Raises `PlannerError` if it cannot be read or is no Python source."""
    if path.suffix != ".py":
        raise PlannerError(f"{path.name}: a planner file ends in .py")
    try:
        with open_plain(path) as file:
            source = file.read(MAX_SOURCE_BYTES + 1)
    except OSError as error:
        raise PlannerError(f"{path}: cannot be read ({error.strerror})") from None
    if len(source) > MAX_SOURCE_BYTES or b"\0" in source:
        raise PlannerError(f"{path.name}: is no Python source")
    return source


def _only_planner(module: ModuleType, path: Path) -> type[Planner]:
    found = [
        thing
        for name, thing in vars(module).items()
        if isinstance(thing, type)
        and issubclass(thing, Planner)
        and thing.__module__ == module.__name__
        and not name.startswith("_")
    ]
    leaves = list(dict.fromkeys(c for c in found if not any(d is not c and issubclass(d, c) for d in found)))
    if not leaves:
        raise PlannerError(f"{path.name}: defines no planner (a class that derives from tui_gcs.planner.api.Planner)")
    if len(leaves) > 1:
        names = ", ".join(planner.__name__ for planner in leaves)
        raise PlannerError(f"{path.name}: defines {len(leaves)} planners ({names}): one file, one planner")
    return leaves[0]
