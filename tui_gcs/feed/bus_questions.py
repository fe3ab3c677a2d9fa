"""Answers of the station on the console's event loop: questions are sent at once, in the order of the calls.

A link that lags delivers many keys at once: of *resume* and *hold*, given a millisecond apart, the hold arrives last.
"""

import asyncio
import contextlib

from tui_gcs.core.protocol.bus import BusError, OnAnswer


def awaited_answer(timeout_s: float) -> tuple[asyncio.Future[bytes], OnAnswer]:
    """A future for the answer of one question, and what `Bus.begin` is to call with it; `BusError`: none came."""
    loop = asyncio.get_running_loop()
    answered: asyncio.Future[bytes] = loop.create_future()
    # Its asker may have given up by then: asyncio would log the error as never retrieved.
    answered.add_done_callback(lambda future: future.cancelled() or future.exception())

    def take(answer: bytes | None) -> None:
        if answered.done():
            return
        if answer is None:
            answered.set_exception(BusError(f"the station did not answer within {timeout_s:.0f} s"))
        else:
            answered.set_result(answer)

    def on_answer(answer: bytes | None) -> None:
        with contextlib.suppress(RuntimeError):  # the console may have ended: its loop is closed
            loop.call_soon_threadsafe(take, answer)

    return answered, on_answer
