"""The missions screen's keys that ask something of vehicles: upload, download, compare; and what came of it."""

from collections.abc import Collection, Sequence

from textual import work

from tui_gcs.actions import refusal
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.missions.autopilot_limits import differences
from tui_gcs.core.missions.draft import VehicleDraft
from tui_gcs.core.missions.mission_findings import FindingLevel
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.plan_transfers import PlanTransfer, PlanTransfers
from tui_gcs.screens.missions.mission_selection import MissionChoosing
from tui_gcs.screens.missions.upload_dialog import UploadDialog
from tui_gcs.screens.orders.vehicle_words import rows_of
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.drafts.save_flow import WorkingCopy
from tui_gcs.widgets.forms.form_findings import Remark
from tui_gcs.widgets.missions.mission_text import conflict_text


class MissionVehicles(MissionChoosing):
    """Nothing is sent that was not asked about; what takes time goes on in the station if this console is gone."""

    def __init__(self, feed: Feed, clock: Clock, glyphs: GlyphSet, work: WorkingCopy) -> None:
        """For this feed and this work."""
        super().__init__(feed, clock, glyphs, work)
        self._clock = clock
        self.transfers = PlanTransfers(feed.requests, clock, self._on_transfer)
        self.told: list[Remark] = []
        """What came of the last upload, download or comparison; stays until something else is done."""

    def show_all(self) -> None:
        """Everything from the draft."""
        raise NotImplementedError

    def show_transfers(self) -> None:
        """How far plans on their way are."""
        raise NotImplementedError

    def action_upload(self) -> None:
        """Ask whom to send to."""
        editor = self.editor
        planned = tuple(v for v, plan in editor.history.draft.vehicles.items() if not plan.is_empty)
        self._ask_upload(editor.vehicle, planned)

    def action_again(self) -> None:
        """Those where it failed."""
        failed = tuple(each.vehicle for each in self.transfers.failed if each.to_vehicle)
        self._ask_upload(failed[0] if len(failed) == 1 else 0, failed)

    def _ask_upload(self, one: int, several: tuple[int, ...]) -> None:
        draft = self.editor.history.draft
        groups: list[tuple[str, tuple[int, ...]]] = [("this vehicle", (one,))] if not draft.of(one).is_empty else []
        chosen = tuple(v for v in self.feed.selection.ids if v in several)
        for name, group in (("those selected", chosen), ("all that are planned", several)):
            if group and all(group != known for _, known in groups):
                groups.append((name, group))
        why = self._why_not(groups)
        if why:
            self.say(f"nothing sent: {why}", Ink.CAUTION)
            return
        asked = {vehicle for _, group in groups for vehicle in group}
        self.editor.forecast.compare_ways()
        doubts = {vehicle: self._doubt(vehicle) for vehicle in asked}
        rows = rows_of(self.feed)
        armed = [row.id for row in rows.values() if row.armed]
        autopilots = {row.id: row.autopilot for row in rows.values()}
        dialog = UploadDialog(
            groups,
            draft.vehicles,
            doubts,
            armed,
            autopilots,
            lambda: self._asked_about(asked),
            self.glyphs,
            self._clock,
        )
        self.app.push_screen(dialog, lambda vehicles: self._upload(vehicles, dialog.closed_by_itself))
        self._tell_held(dialog, tuple(sorted(asked)))

    def _asked_about(self, vehicles: Collection[int]) -> object:
        """Changes when the question whether to send is void."""
        rows = rows_of(self.feed)
        now = [(r.id, r.armed, r.phase, r.freshness) if (r := rows.get(v)) is not None else v for v in vehicles]
        return self.editor.history.draft, now, self.feed.station_lost, self.feed.requests.read_only

    @work(group="on board", exclusive=True, exit_on_error=False)
    async def _tell_held(self, dialog: UploadDialog, vehicles: tuple[int, ...]) -> None:
        held = await self.feed.on_board(vehicles)
        if dialog.is_attached:
            dialog.show_held(held)

    def _why_not(self, groups: Sequence[object]) -> str:
        refused = refusal(next(a for a in self.ACTIONS if a.id == "upload"), self.feed.action_context())
        if refused or self.editor.preview is not None:
            return refused or "first take what is generated (^G), or drop it (Esc)"
        if self.transfers.running:
            return "others are on their way (K ends them)"
        return "" if groups else "nothing is planned for them"

    def _doubt(self, vehicle: int) -> str:
        """The gravest that is to be said before it is sent."""
        remarks = [f"it cannot be sent: {f}" for f in self._errors(vehicle)]
        look = self.editor.forecast
        met = [c for c in look.conflicts if c.together and vehicle in (c.first, c.second)]
        remarks += [
            f"MEETS {c.second if c.first == vehicle else c.first} in flight if both begin together" for c in met
        ]
        remarks += [conflict_text(c) for c in look.conflicts if c.on_tour and vehicle == c.first]
        remarks += [str(f) for f in look.findings(vehicle) if f.level is FindingLevel.CAUTION]
        return remarks[0] if remarks else ""

    def _errors(self, vehicle: int) -> list[str]:
        return [str(f) for f in self.editor.forecast.findings(vehicle) if f.level is FindingLevel.ERROR]

    def _upload(self, vehicles: tuple[int, ...] | None, closed_by_itself: str) -> None:
        if not vehicles:
            self.say(f"nothing sent: {closed_by_itself or 'cancelled'}", Ink.CAUTION if closed_by_itself else Ink.TEXT)
            return
        draft = self.editor.history.draft
        self.did(f"sending to {vehicles_words(vehicles)}: K ends it")
        self._send({vehicle: draft.of(vehicle) for vehicle in vehicles})

    @work(group="transfers", exit_on_error=False)
    async def _send(self, plans: dict[int, VehicleDraft]) -> None:
        self._tell_all("upload", await self.transfers.send(plans))

    def action_download(self) -> None:
        """What this vehicle holds becomes its plan here."""
        self._fetch_for("downloaded")

    def action_compare(self) -> None:
        """How it differs from the plan here."""
        self._fetch_for("compared")

    def _fetch_for(self, what: str) -> None:
        if self.editor.vehicle in self.transfers.states():
            self.say("this vehicle's plans are on their way already", Ink.CAUTION)
        else:
            self.did(f"asking vehicle {self.editor.vehicle} what it holds")
            self._fetch(self.editor.vehicle, what)

    @work(group="transfers", exit_on_error=False)
    async def _fetch(self, vehicle: int, what: str) -> None:
        (came,) = await self.transfers.fetch([vehicle])
        if came.good and what == "downloaded":
            self.editor.take(
                f"plans of {vehicle} downloaded", self.editor.history.draft.with_vehicle(vehicle, came.plans)
            )
            self.did(f"vehicle {vehicle}: {came.text}; u takes it back")
        elif came.good:
            self.told = self._compared(came)
            self.say(f"vehicle {vehicle} compared")
            self.show_all()
        else:
            self._tell_all("download", [came])

    def _compared(self, came: PlanTransfer) -> list[Remark]:
        ours = self.editor.history.draft.of(came.vehicle)
        autopilot = self.editor.forecast.member(came.vehicle).autopilot
        told = []
        for kind in PlanKind:
            different = differences(ours.plan(kind), came.plans.plan(kind), autopilot)
            what = f"vehicle {came.vehicle}, {kind.word}"
            told += [Remark(f"{what}: {line}", Ink.CAUTION) for line in different]
            if not different:
                told.append(Remark(f"{what}: as planned", Ink.NORMAL))
        return told

    def _tell_all(self, what: str, came: Sequence[PlanTransfer]) -> None:
        """What came of it, the failed ones first."""
        self.told = [
            Remark(f"{'' if each.good else '! '}{each.vehicle}: {each.text}", Ink.NORMAL if each.good else Ink.WARNING)
            for each in sorted(came, key=lambda each: each.good)
        ]
        failed = [each.vehicle for each in came if not each.good]
        if failed:
            self.say(f"{what} FAILED for {vehicles_words(failed)}: R tries again", Ink.WARNING)
        else:
            self.say(f"{what} done: {vehicles_words(each.vehicle for each in came)}")
        self.show_all()

    def action_cancel(self) -> None:
        """End what is on its way."""
        if self.transfers.running:
            self.say("ending what is on its way", Ink.CAUTION)
            self.run_worker(self.transfers.cancel(), group="cancel", exit_on_error=False)
        else:
            self.say("nothing is on its way")

    def _on_transfer(self) -> None:
        if self.is_attached:
            self.show_transfers()
