"""Python's full garbage collections, done while the operator does not type.

By itself Python goes through all objects now and then in the middle of a key: 0.1 s with long missions in the console.
"""

import gc

QUIET_S = 1.0
"""The operator has paused when no key came for this long."""
MIN_PERIOD_S = 20.0
MAX_PERIOD_S = 60.0
"""A collection is done after this long even while the operator types."""
LOOK_S = 0.5
"""Seconds between two calls of `look`."""
# The oldest generation is collected when no key was pressed for a while, never by its counter.
_NEVER = 1_000_000


class IdleGarbage:
    """Puts off full collections until there is a pause between keys; those of young objects go on, they are short."""

    def __init__(self) -> None:
        self._key_s = self._done_s = 0.0
        self._usual = gc.get_threshold()

    def begin(self, now_s: float) -> None:
        """Put off full collections from now on."""
        self._key_s = self._done_s = now_s
        self._usual = gc.get_threshold()
        gc.set_threshold(self._usual[0], self._usual[1], _NEVER)

    def end(self) -> None:
        """Leave collections to Python again."""
        gc.set_threshold(*self._usual)

    def note_key(self, now_s: float) -> None:
        """Note that a key was pressed: the pause between keys begins again."""
        self._key_s = now_s

    def look(self, now_s: float) -> bool:
        """Collect if it is time; return whether it was."""
        since_s = now_s - self._done_s
        due = since_s >= MIN_PERIOD_S and now_s - self._key_s >= QUIET_S
        if not due and since_s < MAX_PERIOD_S:
            return False
        gc.collect()
        self._done_s = now_s
        return True
