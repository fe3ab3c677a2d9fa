"""Python looks for garbage while nobody types.

By itself it goes through all objects now and then in the middle of a key: 0.1 s with long missions in the console.
"""

import gc

QUIET_S = 1.0
"""Nobody types any more: so long after the last key."""
PERIOD_S = 20.0
"""It is done not more often than this,"""
LATEST_S = 60.0
"""and at the latest after this, whoever types."""
LOOK_S = 0.5
"""So often is seen whether it is time."""
_NEVER = 1_000_000


class IdleGarbage:
    """Puts off Python's full collections, and does them between keys; those of young objects go on, they are short."""

    def __init__(self) -> None:
        """Nothing is put off before `begin`."""
        self._typed_s = self._done_s = 0.0
        self._usual = gc.get_threshold()

    def begin(self, now_s: float) -> None:
        """From now on."""
        self._typed_s = self._done_s = now_s
        self._usual = gc.get_threshold()
        gc.set_threshold(self._usual[0], self._usual[1], _NEVER)

    def end(self) -> None:
        """As Python does it by itself."""
        gc.set_threshold(*self._usual)

    def typed(self, now_s: float) -> None:
        """There was a key."""
        self._typed_s = now_s

    def look(self, now_s: float) -> bool:
        """Collect if it is time; whether it was."""
        since_s = now_s - self._done_s
        due = since_s >= PERIOD_S and now_s - self._typed_s >= QUIET_S
        if not due and since_s < LATEST_S:
            return False
        gc.collect()
        self._done_s = now_s
        return True
