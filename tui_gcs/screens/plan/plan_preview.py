"""What planners would make of the edited round, found out in the background while it is edited.

The station's planner workers do it on the side, in processes of their own; a newer question ends an older one.
"""

from collections.abc import Mapping, Sequence

from textual.timer import Timer
from textual.worker import WorkType

from tui_gcs.core.judging.team_separation import TeamSeparationFinding, findings
from tui_gcs.core.protocol.common import CancelPreview, GetPreviews, Preview, PreviewResult
from tui_gcs.core.scenario.model import Limits
from tui_gcs.screens.common.draft_screen import DraftScreen

PAUSE_S = 0.7
"""So long after the last edit: nobody wants to know of half a number."""
POLL_S = 0.4
LOOK_S = 0.1


class PlanPreview(DraftScreen):
    """The question that is asked now, and what is known of the answer."""

    previews: Mapping[str, PreviewResult] = {}
    """By team; empty while nothing is known."""
    meetings: Sequence[TeamSeparationFinding] = ()
    """Of all teams that are known."""
    asked_s = 0.0
    """Above 0: the question was how many vehicles it takes for this idleness."""
    _foreseen: tuple[int, str, int] | None = None
    """What was asked about last."""
    _numbers: frozenset[int] | set[int] = frozenset()
    """Of the question that was asked last."""
    _next: tuple[Preview | GetPreviews, float] | None = None
    """What is asked when, on the console's clock: the next edit, or a look for an answer."""
    _look: Timer | None = None
    """Looks whether it is time, while something waits."""
    _asked_at = 0.0
    """When the question left, on the console's clock."""
    waited_s = 0
    """Whole seconds since then, while somebody still plans."""

    @property
    def what_to_foresee(self) -> tuple[int, str, int] | None:
        """(base revision, text, round) of what is shown; None while nothing can be planned for it."""
        raise NotImplementedError

    @property
    def limits_now(self) -> Limits:
        """Of what is shown."""
        raise NotImplementedError

    def show_foreseen(self) -> None:
        """Something is known, or not known any more."""
        raise NotImplementedError

    def _ask_in(self, wait_s: float, question: Preview | GetPreviews) -> None:
        self._next = question, self.clock.now() + wait_s
        if self._look is None:
            self._look = self.set_interval(LOOK_S, self.ask_if_due)

    def ask_if_due(self) -> None:
        """Ask what has waited long enough."""
        if self._next is not None and self.clock.now() >= self._next[1]:
            question = self._next[0]
            self._wait_no_more()
            self._wonder(question)

    def _wait_no_more(self) -> None:
        self._next = None
        if self._look is not None:
            self._look.stop()
            self._look = None

    def foresee_later(self) -> None:
        """Ask about what is shown once the operator pauses, if it is something new; what was known is old then."""
        what = self.what_to_foresee
        if what == self._foreseen or not self.is_current:
            return
        self._foreseen, self.asked_s = what, 0.0
        self._stop()
        if self.previews:
            self._know({})
            self.call_later(self.show_foreseen)
        if what is not None:
            self._ask_in(PAUSE_S, Preview(*what))

    def foresee_now(self, team: str, idleness_s: float) -> None:
        """How many vehicles does this team need?"""
        what = self.what_to_foresee
        if what is not None:
            self._stop()
            self._foreseen, self.asked_s = what, idleness_s
            self._wonder(Preview(*what, team, idleness_s))

    def end_preview(self) -> None:
        """Nobody wants to know any more."""
        self._stop()
        if any(found.state == "running" for found in self.previews.values()):
            self.run_worker(self.feed.requests.send(CancelPreview()), group="end of preview")
        self._foreseen = None
        self._know({})

    def _know(self, previews: Mapping[str, PreviewResult]) -> None:
        self.previews = previews
        ways = {team: found.ways for team, found in previews.items() if found.ways is not None}
        self.meetings = findings(ways, self.limits_now) if len(ways) > 1 and not self.asked_s else ()

    def _stop(self) -> None:
        self._wait_no_more()
        self.workers.cancel_group(self, "preview")

    def _wonder(self, question: Preview | GetPreviews) -> None:
        async def ask() -> None:  # not begun before the worker is: one that is cancelled first has asked nothing
            await self._ask_station(question)

        work: WorkType[None] = ask
        self.run_worker(work, group="preview", exclusive=True)

    async def _ask_station(self, question: Preview | GetPreviews) -> None:
        """Ask, and look again until all have answered; somebody else's question ends this one."""
        if isinstance(question, Preview):
            self._asked_at = self.clock.now()
        reply = await self.feed.requests.send(question)
        numbers = {found.number for found in reply.previews.values()}
        if isinstance(question, Preview):
            self._numbers = numbers
        known = reply.previews if reply.ok and numbers == self._numbers else {}
        running = any(found.state == "running" for found in known.values())
        before, self.waited_s = self.waited_s, int(self.clock.now() - self._asked_at) if running else 0
        if known != self.previews or self.waited_s != before:
            self._know(known)
            self.show_foreseen()
        if running:
            self._ask_in(POLL_S, GetPreviews())
