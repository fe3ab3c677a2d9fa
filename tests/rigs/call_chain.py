"""Which functions of the product called each other to get somewhere."""

import sys
import traceback
from collections.abc import Callable


def callers() -> list[str]:
    """The product's functions that led to where this is called, outermost first."""
    frames = [frame for frame, _ in traceback.walk_stack(sys._getframe(1)) if "/tui_gcs/" in frame.f_code.co_filename]
    return [frame.f_code.co_qualname for frame in reversed(frames)]


def noting_callers(function: Callable[..., object], into: list[list[str]]) -> Callable[..., object]:
    """`function`, which also notes in `into` the product's functions that led to a call of it, outermost first."""

    def noted(*args: object, **kwargs: object) -> object:
        into.append(callers())
        return function(*args, **kwargs)

    return noted
