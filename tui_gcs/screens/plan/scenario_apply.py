"""Between the edited scenario and the station: apply, keep, discard."""

from collections.abc import Callable, Coroutine

from tui_gcs.core.protocol.common import ApplyScenario
from tui_gcs.feed.feed import Feed
from tui_gcs.screens.common.key_feedback import KeyFeedback
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.plan.plan_draft import PlanDraft


class ScenarioApply:
    """Sends the edited scenario to the station; in flight that takes a second press. Nothing else here is sent."""

    def __init__(
        self,
        feed: Feed,
        draft: PlanDraft,
        feedback: KeyFeedback,
        run: Callable[[Coroutine[None, None, None]], object],
        refill: Callable[[], None],
    ) -> None:
        """`run` starts a coroutine as a worker; `refill` fills the forms from the draft."""
        self._feed = feed
        self._draft = draft
        self._model = draft.model
        self._feedback = feedback
        self._run = run
        self._refill = refill
        self._is_applying = False
        self._refusal = ""
        self._refused_text = ""
        """The scenario text that `_refusal` is about: it does not hold for an edited one."""

    @property
    def refusal(self) -> str:
        """Why the station refused the scenario as it stands here; "" if it did not."""
        return self._refusal if self._model.text == self._refused_text else ""

    def apply(self) -> None:
        """Send the scenario to the station; in flight at the second press."""
        # A second press while the first is on its way would apply the same text twice.
        if self._is_applying:
            return
        if self._draft.problems:
            self._feedback.report("not applied: a value is not allowed (u puts it back)", Ink.CAUTION)
        elif self._model.newer is not None:
            self._feedback.report("not applied: first k keep this copy, or d take the station's", Ink.CAUTION)
        elif not self._model.changes:
            self._feedback.report("nothing to apply: the station flies this")
        elif self._may_apply():
            self._is_applying = True
            base_revision, text = self._model.sending()
            self._refusal = ""
            self._feedback.report("applying: sent")
            self._run(self._request(base_revision, text))

    def _may_apply(self) -> bool:
        armed = self._feed.status.armed if self._feed.status is not None else 0
        question = f"{armed} vehicles armed: a or ^G again changes their flight now"
        return not armed or self._feedback.confirmed(f"apply to {armed}", question)

    async def _request(self, base_revision: int, text: str) -> None:
        reply = await self._feed.requests.send(ApplyScenario(base_revision=base_revision, toml=text))
        self._is_applying = False
        if reply.ok:
            if reply.scenario is not None:
                self._model.applied(text, reply.scenario.revision)
            self._feedback.report("applied: the station flies this now")
        else:
            vehicles = "".join(f"\nvehicle {r.vehicle}: {r.text}" for r in reply.results if not r.ok)
            self._refusal, self._refused_text = (reply.text or "no reason given") + vehicles, text
            self._feedback.report("NOT APPLIED, see right", Ink.WARNING)

    def keep(self) -> None:
        """Stay with this copy although the station has a newer scenario."""
        if self._model.newer is not None:
            self._model.keep()
            self._feedback.report("kept: the next apply replaces the station's newer scenario")

    def discard(self) -> None:
        """Replace this copy with the station's newer scenario, at the second press."""
        question = "drop your changes? d again drops them"
        if self._model.newer is not None and self._feedback.confirmed("discard", question):
            self._model.discard()
            self._refusal = ""
            self._refill()
            self._feedback.report("this is what the station flies")
