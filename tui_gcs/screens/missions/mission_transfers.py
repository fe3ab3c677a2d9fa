"""The missions screen's keys that involve vehicles: upload, download, compare; and what came of them."""

from collections.abc import Callable, Collection, Sequence
from functools import partial
from typing import Any

from textual.screen import Screen
from textual.worker import WorkType

from tui_gcs.actions import refusal
from tui_gcs.actions.mission_actions import MISSION_ACTIONS
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.missions.autopilot_limits import differences
from tui_gcs.core.missions.draft import VehicleDraft
from tui_gcs.core.missions.mission_findings import FindingLevel
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.services import CompareMission
from tui_gcs.core.requests.plan_rows import plan_rows
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.plan_transfers import PlanTransfer, PlanTransfers
from tui_gcs.screens.common.key_feedback import KeyFeedback
from tui_gcs.screens.missions.upload_dialog import UploadComparison, UploadDialog
from tui_gcs.screens.orders.vehicle_words import rows_of
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.forms.form_findings import Remark
from tui_gcs.widgets.missions.mission_editor import MissionEditor
from tui_gcs.widgets.missions.mission_text import conflict_text

UPLOAD = next(action for action in MISSION_ACTIONS if action.id == "upload")


class MissionTransfers:
    """Asks before anything is sent, starts transfers, and keeps the report of the last one.

    A transfer is a task of the station: it goes on there if this console ends.
    """

    def __init__(
        self,
        host: Screen[Any],
        editor: MissionEditor,
        feed: Feed,
        clock: Clock,
        glyphs: GlyphSet,
        feedback: KeyFeedback,
        *,
        did: Callable[[str], None],
        show: Callable[[], None],
        show_progress: Callable[[], None],
    ) -> None:
        """`host` runs workers and dialogs. `did` reports an edit and shows the draft, `show` shows the report, too."""
        self._host = host
        self._editor = editor
        self._feed = feed
        self._clock = clock
        self._glyphs = glyphs
        self._feedback = feedback
        self._did, self._show, self._show_progress = did, show, show_progress
        self.jobs = PlanTransfers(feed.requests, clock, self._on_transfer)
        self.report: list[Remark] = []
        """The outcome of the last upload, download or comparison; it stays until something else is done."""

    def upload(self) -> None:
        """Ask which vehicles to send to: the edited one, the selected ones or all with plans."""
        planned = tuple(v for v, plan in self._editor.history.draft.vehicles.items() if not plan.is_empty)
        self._ask_upload(self._editor.vehicle, planned)

    def upload_again(self) -> None:
        """Ask to send once more to the vehicles where it failed."""
        failed = tuple(each.vehicle for each in self.jobs.failed if each.to_vehicle)
        self._ask_upload(failed[0] if len(failed) == 1 else 0, failed)

    def _ask_upload(self, one: int, several: tuple[int, ...]) -> None:
        draft = self._editor.history.draft
        groups: list[tuple[str, tuple[int, ...]]] = [("this vehicle", (one,))] if not draft.of(one).is_empty else []
        chosen = tuple(v for v in self._feed.selection.ids if v in several)
        for name, group in (("those selected", chosen), ("all that are planned", several)):
            # A group with the same vehicles as one before is not offered twice.
            if group and all(group != known for _, known in groups):
                groups.append((name, group))
        why = self._why_not(groups)
        if why:
            self._feedback.report(f"nothing sent: {why}", Ink.CAUTION)
            return
        vehicles = {vehicle for _, group in groups for vehicle in group}
        # The question names conflicts, so the comparison cannot wait for a pause here.
        self._editor.forecast.compare_paths()
        warnings = {vehicle: self._warning(vehicle) for vehicle in vehicles}
        rows = rows_of(self._feed)
        armed = [row.id for row in rows.values() if row.armed]
        autopilots = {row.id: row.autopilot for row in rows.values()}
        dialog = UploadDialog(
            groups,
            draft.vehicles,
            warnings,
            [(c.first, c.second) for c in self._editor.forecast.conflicts if c.together],
            armed,
            autopilots,
            lambda: self._state_of(vehicles),
            lambda group: self._run(partial(self._compare, dialog, group), "comparison"),
            self._glyphs,
            self._clock,
        )
        self._host.app.push_screen(dialog, lambda vehicles: self._send(vehicles, dialog.closed_by_itself))
        show = partial(self._show_held, dialog, tuple(sorted(vehicles)))
        self._run(show, "on board", exclusive=True)

    def _run(self, job: WorkType[None], group: str, *, exclusive: bool = False) -> None:
        self._host.run_worker(job, group=group, exclusive=exclusive, exit_on_error=False)

    def _state_of(self, vehicles: Collection[int]) -> object:
        """Return what the question is about: it is void when this changes."""
        rows = rows_of(self._feed)
        now = [(r.id, r.armed, r.phase, r.freshness) if (r := rows.get(v)) is not None else v for v in vehicles]
        return self._editor.history.draft, now, self._feed.station_lost, self._feed.requests.read_only

    async def _show_held(self, dialog: UploadDialog, vehicles: tuple[int, ...]) -> None:
        held = await self._feed.on_board(vehicles)
        if dialog.is_attached:
            dialog.show_held(held)

    async def _compare(self, dialog: UploadDialog, vehicles: tuple[int, ...]) -> None:
        """Have the station compare the missions of a group with what flies and with what other vehicles hold."""
        draft, meets, remarks = self._editor.history.draft, dict[int, str](), dict[str, None]()
        for vehicle in vehicles:
            plan = draft.of(vehicle).plan(PlanKind.MISSION)
            if not plan.items:
                continue
            reply = await self._feed.requests.send(CompareMission((vehicle,), plan_rows(plan), vehicles))
            meets |= {result.vehicle: result.text for result in reply.results if not result.ok}
            if reply.text:
                remarks[reply.text if reply.results else f"not compared: {reply.text}"] = None
        if dialog.is_attached:
            dialog.show_comparison(vehicles, UploadComparison(meets, "; ".join(remarks)))

    def _why_not(self, groups: Sequence[object]) -> str:
        refused = refusal(UPLOAD, self._feed.action_context())
        if refused or self._editor.preview is not None:
            return refused or "first take what is generated (^G), or drop it (Esc)"
        if self.jobs.running:
            return "others are on their way (K ends them)"
        return "" if groups else "nothing is planned for them"

    def _warning(self, vehicle: int) -> str:
        """Return the gravest finding about a vehicle's plans."""
        look = self._editor.forecast
        found = [f"it cannot be sent: {f}" for f in look.findings(vehicle) if f.level is FindingLevel.ERROR]
        met = [c for c in look.conflicts if c.together and vehicle in (c.first, c.second)]
        found += [f"MEETS {c.second if c.first == vehicle else c.first} in flight if both begin together" for c in met]
        found += [conflict_text(c) for c in look.conflicts if c.on_tour and vehicle == c.first]
        found += [str(f) for f in look.findings(vehicle) if f.level is FindingLevel.CAUTION]
        return found[0] if found else ""

    def _send(self, vehicles: tuple[int, ...] | None, closed_by_itself: str) -> None:
        if not vehicles:
            ink = Ink.CAUTION if closed_by_itself else Ink.TEXT
            self._feedback.report(f"nothing sent: {closed_by_itself or 'cancelled'}", ink)
            return
        draft = self._editor.history.draft
        self._did(f"sending to {vehicles_words(vehicles)}: K ends it")
        plans = {vehicle: draft.of(vehicle) for vehicle in vehicles}
        self._run(partial(self._upload, plans), "transfers")

    async def _upload(self, plans: dict[int, VehicleDraft]) -> None:
        self._report("upload", await self.jobs.send(plans))

    def fetch(self, what: str) -> None:
        """Read the plans that the edited vehicle holds: "downloaded" into the draft, or "compared" with it."""
        vehicle = self._editor.vehicle
        if vehicle in self.jobs.states():
            self._feedback.report("this vehicle's plans are on their way already", Ink.CAUTION)
        else:
            self._did(f"asking vehicle {vehicle} what it holds")
            self._run(partial(self._fetch, vehicle, what), "transfers")

    async def _fetch(self, vehicle: int, what: str) -> None:
        (came,) = await self.jobs.fetch([vehicle])
        if came.good and what == "downloaded":
            draft = self._editor.history.draft.with_vehicle(vehicle, came.plans)
            self._editor.take(f"plans of {vehicle} downloaded", draft)
            self._did(f"vehicle {vehicle}: {came.text}; u takes it back")
        elif came.good:
            self.report = self._comparison(came)
            self._feedback.report(f"vehicle {vehicle} compared")
            self._show()
        else:
            self._report("download", [came])

    def _comparison(self, came: PlanTransfer) -> list[Remark]:
        ours = self._editor.history.draft.of(came.vehicle)
        autopilot = self._editor.forecast.vehicle(came.vehicle).autopilot
        report = []
        for kind in PlanKind:
            different = differences(ours.plan(kind), came.plans.plan(kind), autopilot)
            what = f"vehicle {came.vehicle}, {kind.word}"
            report += [Remark(f"{what}: {line}", Ink.CAUTION) for line in different]
            if not different:
                report.append(Remark(f"{what}: as planned", Ink.NORMAL))
        return report

    def _report(self, what: str, came: Sequence[PlanTransfer]) -> None:
        """Report finished transfers, those that failed first."""
        self.report = [
            Remark(f"{'' if each.good else '! '}{each.vehicle}: {each.text}", Ink.NORMAL if each.good else Ink.WARNING)
            for each in sorted(came, key=lambda each: each.good)
        ]
        failed = [each.vehicle for each in came if not each.good]
        if failed:
            self._feedback.report(f"{what} FAILED for {vehicles_words(failed)}: ^R why, R tries again", Ink.WARNING)
        else:
            self._feedback.report(f"{what} done: {vehicles_words(each.vehicle for each in came)}")
        self._show()

    def cancel(self) -> None:
        """Cancel the transfers that are under way."""
        if self.jobs.running:
            self._feedback.report("ending what is on its way", Ink.CAUTION)
            self._host.run_worker(self.jobs.cancel(), group="cancel", exit_on_error=False)
        else:
            self._feedback.report("nothing is on its way")

    def _on_transfer(self) -> None:
        if self._host.is_attached:
            self._show_progress()
