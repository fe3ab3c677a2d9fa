"""A Pilot that knows when the console has nothing left to do.

Textual's own guesses: it sleeps in steps of 20 ms until the process seems idle, twice a key, and sends every widget a
message to see it come back. That was half the time of the tests of the screens, and on a busy machine a wrong guess.
Here nothing is guessed: every widget waits for a message, none is under way, and all that changed is drawn.
"""

import asyncio
import time
from collections.abc import Collection
from typing import Any

from textual import events
from textual.app import App
from textual.message_pump import MessagePump
from textual.pilot import Pilot
from textual.screen import Screen

import tests.screens.rigs.parsed_styles  # noqa: F401 - each style sheet is parsed once per process

MAX_S = 10.0
"""A widget that waits for something else than a message is not waited for any longer."""
SPINS = 50
"""Turns of the loop before other threads are given time."""
QUIET = 5
"""Turns in which nothing happens: what threads and drivers hand to the loop takes up to three to become a message."""


class QuietPilot(Pilot[Any]):
    """As its base; waits for what is really under way."""

    async def press(self, *keys: str) -> None:
        """See `Pilot.press`: one after the other, each with all that it leads to."""
        driver = self.app._driver
        assert driver is not None
        for key in keys:
            driver.send_message(_event(key, self.app))
            await self.quiet()

    async def pause(self, delay: float | None = None) -> None:
        """See `Pilot.pause`."""
        if delay is not None:
            await asyncio.sleep(delay)
        await self.quiet()

    async def quiet(self) -> None:
        """All messages are handled, all animations have ended, and all that changed is drawn."""
        end_s, spins, quiet = time.monotonic() + MAX_S, 0, 0
        others: Collection[Any] = asyncio.get_running_loop()._ready  # type: ignore[attr-defined]  # who has the next turn
        while quiet < QUIET and time.monotonic() < end_s and self.app._running and self.app._exception is None:
            spins += 1
            await asyncio.sleep(0.001 if spins % SPINS == 0 else 0)
            if others or (quiet == QUIET - 1 and self._is_busy()):  # to look at all widgets takes a while
                quiet = 0
            else:
                quiet += 1

    def _is_busy(self) -> bool:
        waits = self.app._exit or self.app._batch_count or self.app._resize_event is not None  # Textual waits itself
        if waits or any(_handles(pump) for pump in (self.app, *self.app._registry)):
            return True
        if any(_redrawn(screen) for screen in self.app.screen_stack):
            return True
        return bool(self.app._animator._animations or self.app._animator._scheduled)


def _event(key: str, app: App[Any]) -> events.Key:
    """As `App._press_keys` makes them."""
    import unicodedata

    from textual.keys import REPLACED_KEYS, _character_to_key, _get_unicode_name_from_key

    if len(key) == 1 and not key.isalnum():
        key = _character_to_key(key)
    original = REPLACED_KEYS.get(key, key)
    character: str | None
    try:
        character = unicodedata.lookup(_get_unicode_name_from_key(original))
    except KeyError:
        character = key if len(key) == 1 else None
    event = events.Key(key, character)
    event.set_sender(app)
    return event


def _handles(pump: MessagePump) -> bool:
    """Whether it handles a message, or one is there for it."""
    if not pump._running or pump._closed:
        return False
    queue = pump._message_queue
    waits = queue.empty() and any(not waiter.done() for waiter in queue.ready_event._waiters)
    return not waits or pump._pending_message is not None or bool(pump._next_callbacks)


def _redrawn(screen: Screen[Any]) -> bool:
    """Draw what changed on a screen that can be seen; whether that was anything."""
    if not screen.is_current or not _has_changed(screen):
        return False
    screen._on_timer_update()
    return not _has_changed(screen)  # of one behind a dialog, widgets that cannot be seen stay as they are


def _has_changed(screen: Screen[Any]) -> bool:
    # Textual marks all of a screen behind a dialog as changed whenever it draws a part of it.
    whole = screen._repaint_required and screen.is_active
    return bool(
        whole
        or screen._layout_required
        or screen._scroll_required
        or screen._recompose_required
        or screen._dirty_widgets
        or screen._callbacks
    )
