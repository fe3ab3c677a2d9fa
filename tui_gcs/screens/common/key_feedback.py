"""What an editing screen answers to a key: a line about what it did, or a question that a second press confirms."""

import math
from collections.abc import Callable

from tui_gcs.core.base.clock import Clock
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.drafts.save_bar import SaveBar
from tui_gcs.widgets.drafts.save_flow import SaveNext, SaveStep
from tui_gcs.widgets.forms.form_findings import Remark

EXPIRES_S = 10.0
"""A question is over after this time without its second press."""
NO_LETTER = "numbers only: a letter was NOT taken, look at the number"


class KeyFeedback:
    """Keeps the message of the edit line and the one question that waits for a second press of its key."""

    def __init__(
        self,
        clock: Clock,
        save_bar: SaveBar,
        set_timer: Callable[[float, Callable[[], None]], object],
        show: Callable[[], None],
    ) -> None:
        """`show` is called whenever `message` has changed."""
        self._clock = clock
        self._save_bar = save_bar
        self._set_timer = set_timer
        self._show = show
        self.message = Remark("")
        self.report_count = 0
        """Number of calls of `report`: a part that waits for the next key sees by it that something else was done."""
        self.refused_letter = False
        """A letter was typed into the number field that has the cursor, and was not taken."""
        self._asked = ""
        self._until_s = -math.inf

    def report(self, text: str, ink: Ink = Ink.TEXT) -> None:
        """Show what became of a key, and end any question. An empty text clears the line."""
        if not text and self.refused_letter:
            # This stays in view while the number is typed: 3o5 without its letter would be 35.
            text, ink = NO_LETTER, Ink.CAUTION
        self.report_count += 1
        self._asked = ""
        self._save_bar.forget()
        self.message = Remark(text, ink)
        self._show()

    def confirmed(self, what: str, question: str) -> bool:
        """Return whether this press about `what` is the second in a row and in time; the first one shows `question`."""
        now_s = self._clock.now()
        if self._asked == what and now_s < self._until_s:
            return True
        # One question at a time: the save key must not confirm what another key has asked, nor the other way round.
        self._asked, self._until_s = what, now_s + EXPIRES_S
        self._save_bar.forget()
        self._ask(question)
        return False

    def show_save(self, step: SaveStep) -> None:
        """Show the outcome of a press of the save key."""
        self._asked = ""
        if step.what is SaveNext.CONFIRM:
            self._ask(step.text)
            return
        self.message = Remark(step.text, Ink.TEXT if step.what is SaveNext.DONE else Ink.CAUTION)
        self._show()

    def _ask(self, question: str) -> None:
        self.message = Remark(question, Ink.CAUTION)
        self._set_timer(EXPIRES_S, self.expire)
        self._show()

    def expire(self) -> None:
        """End a question that has waited too long for its second press."""
        is_over = bool(self._asked) and self._clock.now() >= self._until_s
        if is_over or self._save_bar.is_confirming:
            self.report(f"nothing done: no second key within {EXPIRES_S:.0f} s")
