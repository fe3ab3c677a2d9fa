"""What the planners would make of the edited round, asked in the background while it is edited.

The station plans the preview in separate worker processes; a newer request cancels an older one there.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from textual.screen import Screen
from textual.timer import Timer
from textual.worker import WorkType

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.judging.team_separation import TeamSeparationFinding, findings
from tui_gcs.core.protocol.common import CancelPreview, GetPreviews, Preview, PreviewResult
from tui_gcs.core.scenario.model import Limits
from tui_gcs.feed.feed import Feed
from tui_gcs.widgets.forms.form_text import FieldError, to_number

PAUSE_S = 0.7
"""A preview is requested this long after the last edit: half a typed number is not worth planning."""
POLL_S = 0.4
CHECK_S = 0.1
MIN_IDLENESS_S, MAX_IDLENESS_S = 0.1, 86_400.0

Target = tuple[int, str, int]
"""What is previewed: base revision, scenario text, index of the round."""


class PlanPreview:
    """The preview request that is under way, and what is known of its results."""

    def __init__(
        self,
        host: Screen[Any],
        feed: Feed,
        clock: Clock,
        *,
        target: Callable[[], Target | None],
        limits: Callable[[], Limits],
        show: Callable[[], None],
    ) -> None:
        """`host` runs timers and workers. `target` is None while nothing can be planned; `show` shows new results."""
        self._host, self._feed, self._clock = host, feed, clock
        self._target, self._limits, self._show = target, limits, show
        self.results: Mapping[str, PreviewResult] = {}
        """Results by team; empty while nothing is known."""
        self.meetings: Sequence[TeamSeparationFinding] = ()
        """Where the tours of teams come near each other."""
        self.idleness_s = 0.0
        """Above 0: the request was how many vehicles reach this worst idleness."""
        self.waited_s = 0
        """Whole seconds since the request, while a planner is still working on it."""
        self._requested: Target | None = None
        self._numbers: frozenset[int] | set[int] = frozenset()
        """Numbers of the previews that the station began for the last request: others are of other consoles."""
        self._next: tuple[Preview | GetPreviews, float] | None = None
        """The next request to the station and when it is due, on the console's clock."""
        self._check: Timer | None = None
        self._requested_s = 0.0

    def request_later(self) -> None:
        """Request a preview of what is shown once the operator pauses, if it has changed; old results are dropped."""
        target = self._target()
        if target == self._requested or not self._host.is_current:
            return
        self._requested, self.idleness_s = target, 0.0
        self._stop()
        if self.results:
            self._set_results({})
            # Later, because this is called while the plan is being shown.
            self._host.call_later(self._show)
        if target is not None:
            self._send_in(PAUSE_S, Preview(*target))

    def request_fleet_size(self, team: str, idleness_s: float) -> None:
        """Request at once how many vehicles a team needs for this worst idleness."""
        target = self._target()
        if target is not None:
            self._stop()
            self._requested, self.idleness_s = target, idleness_s
            self._send(Preview(*target, team, idleness_s))

    def end(self) -> None:
        """Cancel what is under way: the screen is not shown any more."""
        self._stop()
        # A planner that works for a preview which is not shown takes a core from the flight.
        if any(found.state == "running" for found in self.results.values()):
            self._host.run_worker(self._feed.requests.send(CancelPreview()), group="end of preview")
        self._requested = None
        self._set_results({})

    def _send_in(self, wait_s: float, question: Preview | GetPreviews) -> None:
        self._next = question, self._clock.now() + wait_s
        if self._check is None:
            self._check = self._host.set_interval(CHECK_S, self.send_if_due)

    def send_if_due(self) -> None:
        """Send the next request if it has waited long enough."""
        if self._next is not None and self._clock.now() >= self._next[1]:
            question = self._next[0]
            self._wait_no_more()
            self._send(question)

    def _wait_no_more(self) -> None:
        self._next = None
        if self._check is not None:
            self._check.stop()
            self._check = None

    def _stop(self) -> None:
        self._wait_no_more()
        self._host.workers.cancel_group(self._host, "preview")

    def _set_results(self, results: Mapping[str, PreviewResult]) -> None:
        self.results = results
        ways = {team: found.ways for team, found in results.items() if found.ways is not None}
        self.meetings = findings(ways, self._limits()) if len(ways) > 1 and not self.idleness_s else ()

    def _send(self, question: Preview | GetPreviews) -> None:
        async def ask() -> None:
            # The coroutine is made when the worker begins: a worker that is cancelled before has requested nothing.
            await self._request(question)

        work: WorkType[None] = ask
        self._host.run_worker(work, group="preview", exclusive=True)

    async def _request(self, question: Preview | GetPreviews) -> None:
        """Ask the station, and poll until every team has a result. A request of another console ends this one."""
        if isinstance(question, Preview):
            self._requested_s = self._clock.now()
        reply = await self._feed.requests.send(question)
        numbers = {found.number for found in reply.previews.values()}
        if isinstance(question, Preview):
            self._numbers = numbers
        # Other numbers are those of another console's request, which has replaced this one in the station.
        known = reply.previews if reply.ok and numbers == self._numbers else {}
        is_running = any(found.state == "running" for found in known.values())
        before, self.waited_s = self.waited_s, int(self._clock.now() - self._requested_s) if is_running else 0
        if known != self.results or self.waited_s != before:
            self._set_results(known)
            self._show()
        if is_running:
            self._send_in(POLL_S, GetPreviews())


def to_idleness(text: str) -> float:
    """Return the worst idleness that was typed, seconds. Raises FieldError."""
    idleness_s = to_number(text, "idleness")
    if not MIN_IDLENESS_S <= idleness_s <= MAX_IDLENESS_S:
        raise FieldError(f"idleness: must be 0.1 to {MAX_IDLENESS_S:g} s")
    return idleness_s
