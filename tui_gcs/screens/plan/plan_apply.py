"""The plan screen's keys between the working copy and the station: apply, keep, discard."""

from tui_gcs.core.protocol.common import ApplyScenario
from tui_gcs.screens.plan.plan_forms import PlanForms
from tui_gcs.widgets.basics.palette import Ink


class PlanApply(PlanForms):
    """Only here anything is sent, and in flight not without a second press."""

    refusal = ""
    """Why the station did not take the last one."""
    refused_text = ""
    """That was it: of another copy nobody has said anything."""
    _applying = False

    def action_apply(self) -> None:
        """Send the working copy to the station; in flight the second press does it."""
        if self._applying:
            return
        if self.draft.problems:
            self.say("not applied: a value is not allowed (u puts it back)", Ink.CAUTION)
        elif self.model.newer is not None:
            self.say("not applied: first k keep this copy, or d take the station's", Ink.CAUTION)
        elif not self.model.changes:
            self.say("nothing to apply: the station flies this")
        elif self._may_apply():
            self._applying = True
            base_revision, text = self.model.sending()
            self.refusal = ""
            self.say("applying: sent")
            self.run_worker(self._apply(base_revision, text), group="apply")

    def _may_apply(self) -> bool:
        armed = self.feed.status.armed if self.feed.status is not None else 0
        question = f"{armed} vehicles armed: a or ^G again changes their flight now"
        return not armed or self.confirmed(f"apply to {armed}", question)

    async def _apply(self, base_revision: int, text: str) -> None:
        reply = await self.feed.requests.send(ApplyScenario(base_revision=base_revision, toml=text))
        self._applying = False
        if reply.ok:
            if reply.scenario is not None:
                self.model.applied(text, reply.scenario.revision)
            self.say("applied: the station flies this now")
        else:
            vehicles = "".join(f"\nvehicle {r.vehicle}: {r.text}" for r in reply.results if not r.ok)
            self.refusal, self.refused_text = (reply.text or "no reason given") + vehicles, text
            self.say("NOT APPLIED, see right", Ink.WARNING)

    def action_keep(self) -> None:
        """Stay with this copy although the station has a newer scenario."""
        if self.model.newer is not None:
            self.model.keep()
            self.say("kept: the next apply replaces the station's newer scenario")

    def action_discard(self) -> None:
        """Drop this copy for the station's newer scenario; the second press does it."""
        if self.model.newer is not None and self.confirmed("discard", "drop your changes? d again drops them"):
            self.model.discard()
            self.refusal = ""
            self.show_forms()
            self.say("this is what the station flies")
