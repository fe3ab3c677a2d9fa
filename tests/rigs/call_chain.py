"""Which functions of the product called each other to get here."""

import sys
import threading
import traceback
from collections.abc import Callable


def noting_callers(function: Callable[..., object], into: list[list[str]]) -> Callable[..., object]:
    """`function`, which also notes in `into` the product's functions that led to a call of it, outermost first.

    A call from another thread than the main one is an error.
    """

    def noted(*args: object, **kwargs: object) -> object:
        assert threading.current_thread() is threading.main_thread()
        frames = [
            frame for frame, _ in traceback.walk_stack(sys._getframe()) if "/tui_gcs/" in frame.f_code.co_filename
        ]
        into.append([frame.f_code.co_qualname for frame in reversed(frames)])
        return function(*args, **kwargs)

    return noted
