"""Jobs that upload plans and verify them, download them and clear them.

An upload is done when the vehicle was asked what it holds, and holds what was sent. An ACK is no proof: ArduPilot
stores items one by one, and a third station may have put some in between. PX4's opaque id, its own checksum of what
arrived, is no proof of what was sent either. But a number that was once verified by reading back is one, when the same
plan gets it again.

When an upload fails the vehicle is asked, too: what it holds then is reported, and kept in the registry.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from tui_gcs.core.firmware.plan_dialects import PlanDialect, dialect_of
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.missions.plan_compare import begins_alike, compare
from tui_gcs.core.plans.check import check
from tui_gcs.core.plans.model import Plan, PlanKind
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import ALERT, NOTICE, WARNING
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.plans.plan_download import DownloadDialogue
from tui_gcs.core.services.plans.plan_messages import ACCEPTED, CANCELLED, DENIED, PlanChannel, RetryTimer, result_word
from tui_gcs.core.services.plans.plan_table import HeldPlan, MissionProgress, MissionState, PlanRegistry
from tui_gcs.core.services.plans.plan_upload import UploadDialogue, UploadResult
from tui_gcs.core.services.plans.terrain_check import TerrainCheck
from tui_gcs.core.uplink.jobs import Job

MAX_PROVEN = 50
CLEAR_TRIES = 10
CLEAR_GAP_S = 1.5
MIN_JUDGEMENT_S, MAX_JUDGEMENT_S = 0.5, 10.0
"""A judgement on an accepted mission that comes earlier may be of the old one: PX4 sends it once a second. After the
second time it is given up."""
SILENT_JUDGEMENT_S, LOSSY_JUDGEMENT_S = 2.0, 5.0
"""PX4 up to 1.16 reports only in an EVENT that a mission cannot be flown. A lost EVENT is noticed after 3 s."""
REJECTS = ("Mission rejected", "Geofence violation", "Not yet ready for mission")
"""The beginnings of PX4's texts and EVENTs that reject a mission."""
FENCE_TEXT_S = 1.5

OnDone = Callable[[Job], None]


class PlanJob(Job):
    """What uploads, downloads and deletions have in common."""

    def __init__(
        self, context: ServiceContext, registry: PlanRegistry, vehicle: int, name: str, kind: PlanKind
    ) -> None:
        """Prepare a job; `name` is the operator's word, and the service sets `on_done`."""
        super().__init__(vehicle, name)
        self.kind = kind
        self.changing = False
        """The vehicle has received the first message: what it holds may be a part of the change."""
        self.notes: list[str] = []
        """What the operator should know although the job succeeded."""
        self.before: HeldPlan | None = None
        """What was known to be on board when the job began."""
        self._context = context
        self._registry = registry
        self._channel = PlanChannel(context.uplink, vehicle, kind)
        self._timer = RetryTimer()

    @property
    def _state(self) -> MissionState:
        return self._registry.state(self.vehicle)

    @property
    def _held(self) -> HeldPlan:
        return self._state.held[self.kind]

    def on_message(self, vehicle: Vehicle, name: str, fields: dict[str, Any], now: float) -> None:
        """Take a message about this kind of plan that is addressed to us; what it requests is answered at once."""

    def _log(self, text: str, severity: int) -> None:
        self._context.events.report(EventClass.MISSION, f"vehicle {self.vehicle}", text, severity)

    def _keep(self, plan: Plan, now: float, *, read: str, ours: bool, opaque_id: int) -> None:
        """Note that `plan` is on board now, and was read as what has the fingerprint `read`."""
        held = self._held
        if ours:
            self._registry.put(self.vehicle, self.kind, read)
        held.plan, held.ours, held.opaque_id = plan, ours, opaque_id
        held.stale, held.partial, held.since_s = "", False, now
        if opaque_id:
            # A vehicle may invent a new number for every plan.
            if len(held.proven) > MAX_PROVEN:
                held.proven.clear()
            held.proven[opaque_id] = plan.fingerprint, read
        self._state.changed_s[self.kind] = now
        self._state.contradictions.pop(self.kind, None)
        if self.kind is PlanKind.MISSION:
            self._state.total, self._state.reached = len(plan.items), None

    def _mark_changing(self) -> None:
        """Note that the plan on board is about to change.

        Nothing is known until it was read; the former one may be restored.
        """
        held, self.changing = self._held, True
        self.before = replace(held) if held.known else None
        if held.known and not held.partial:
            held.before = held.plan
        held.stale = f"a {self.name} was begun, and not completed"


class DownloadJob(PlanJob):
    """Reads one kind of plan; `plan` is there once the job is done."""

    def __init__(self, context: ServiceContext, registry: PlanRegistry, vehicle: int, kind: PlanKind) -> None:
        super().__init__(context, registry, vehicle, f"{kind.word} download", kind)
        self.plan: Plan | None = None
        self.problems: list[str] = []
        """What is wrong with the plan that was received: it must not be drawn or sent again unseen (docs/threats.md
        B.6-59)."""
        self._download = DownloadDialogue(self._channel, self._timer)

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Request the count of items."""
        self._channel.home_items = dialect_of(vehicle).wire_count(Plan(self.kind))
        self._download = DownloadDialogue(self._channel, self._timer, gives_up_s=dialect_of(vehicle).gives_up_s)
        self._download.begin(now)
        self._look(vehicle, now)

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Repeat what is not answered."""
        self._download.tick(now)
        self._look(vehicle, now)

    def on_message(self, vehicle: Vehicle, name: str, fields: dict[str, Any], now: float) -> None:
        """Take a part of the answer."""
        self._download.on_message(name, fields, now)
        self._look(vehicle, now)

    def abort(self) -> None:
        """End the transfer on the vehicle: otherwise PX4 stays busy for 5 s."""
        self._channel.end(CANCELLED)

    def _look(self, vehicle: Vehicle, now: float) -> None:
        download = self._download
        self.done, self.total = download.received, download.count or 0
        if self.over or not download.over:
            return
        if download.error:
            self.finish(download.error)
            return
        self.plan = dialect_of(vehicle).from_wire(self.kind, download.items)
        self.problems = [str(problem) for problem in check(self.plan)]
        if self.problems:
            self._log(f"{self.kind.word} on board: {self.problems[0]}", WARNING)
        held = self._held
        same = held.ours and held.plan is not None and compare(held.plan, self.plan, dialect_of(vehicle)).same
        ours = same or self._registry.is_ours(self.vehicle, self.plan)
        if held.ours and held.known and not ours:
            self._log(f"{self.kind.word} on vehicle is not ours", ALERT)
        kept = held.plan if same and held.plan is not None else self.plan
        self._keep(kept, now, read=self.plan.fingerprint, ours=ours, opaque_id=download.opaque_id)
        self.finish()


class UploadJob(PlanJob):
    """Sends one plan and verifies that the vehicle holds it."""

    def __init__(
        self, context: ServiceContext, registry: PlanRegistry, vehicle: int, plan: Plan, *, in_flight: bool
    ) -> None:
        super().__init__(context, registry, vehicle, f"{plan.kind.word} upload", plan.kind)
        self.plan = plan
        self.in_flight = in_flight
        self.touched = False
        """The vehicle has received a count: what it holds may be a part of this plan."""
        self._dialect: PlanDialect
        self._terrain: TerrainCheck | None = None
        """The check that runs before anything is sent."""
        self._upload: UploadDialogue | None = None
        self._download: DownloadDialogue | None = None
        self._opaque_id = 0
        self._failure = ""
        """Why the upload failed, while the vehicle is asked what it holds now."""
        self._doubt = ""
        self._rejected = 0
        """The id of the EVENT that reported that the mission cannot be flown."""
        self._acked_s: float | None = None
        """When the vehicle accepted the plan, while its judgement is waited for."""

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Check whether the plan may be sent, and send the count."""
        self._dialect = dialect_of(vehicle)
        self._channel.home_items = self._dialect.wire_count(Plan(self.kind))
        why = self._why_not(vehicle)
        if why:
            self.finish(why)
        # Heights above the ground without terrain data sink an ArduCopter into the ground (docs/autopilots.md,
        # "Dangerous things first").
        elif self._dialect.flies_blind(self.plan):
            self._terrain = TerrainCheck(self._context)
            self._terrain.tick(vehicle, now)
        else:
            self._send(vehicle, now)

    def _send(self, vehicle: Vehicle, now: float) -> None:
        items = self._dialect.to_wire(self.plan)
        self.total = 2 * len(items)  # each is sent, and read back
        patience_s = self._dialect.patience_s
        self._upload = UploadDialogue(
            self._channel, items, self._timer, patience_s=patience_s, from_start=not self.in_flight
        )
        self._upload.begin(now)
        self.touched = self._upload.result is None
        if self.touched:
            self._mark_changing()
        self._look(vehicle, now)

    def _why_not(self, vehicle: Vehicle) -> str:
        if not self.plan.items:
            return "it has no items: clear it instead"
        problems = [str(problem) for problem in check(self.plan)]
        problems += self._dialect.problems(self.plan, _home_deg(self._context, vehicle))
        if problems:
            more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
            return problems[0] + more
        if self.kind is PlanKind.MISSION and not self.in_flight and self._dialect.flies_mission(vehicle):
            return "it flies its mission: pause first"
        return ""

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Repeat what is not answered, and wait for the vehicle's judgement."""
        if self._terrain is not None:
            self._ask_terrain(self._terrain, vehicle, now)
        elif self._download is not None:
            self._download.tick(now)
        elif self._acked_s is not None:
            self._judge(vehicle, now)
        elif self._upload is not None:
            self._upload.tick(now)
        self._look(vehicle, now)

    def _ask_terrain(self, terrain: TerrainCheck, vehicle: Vehicle, now: float) -> None:
        terrain.tick(vehicle, now)
        if terrain.answer is not None:
            self._terrain = None
            if terrain.answer:
                self.finish(terrain.answer)
            else:
                self._send(vehicle, now)

    def on_message(self, vehicle: Vehicle, name: str, fields: dict[str, Any], now: float) -> None:
        """Take a part of the dialogue."""
        if self._download is not None:
            self._download.on_message(name, fields, now)
        elif self._upload is not None:
            self._upload.on_message(name, fields, now)
        self._look(vehicle, now)

    def abort(self) -> None:
        """End the transfer on the vehicle. ArduPilot ignores that, and keeps the part that it has."""
        self._channel.end(CANCELLED)

    def _look(self, vehicle: Vehicle, now: float) -> None:
        """Go on with the next step where one is over."""
        if self.over or self._acked_s is not None:
            return
        if self._download is not None:
            items = self.total // 2
            self.done = items + min(self._download.received, items)
            if self._download.over:
                self._read_back(vehicle, self._download, now)
        elif self._upload is not None:
            self.done = self._upload.requested
            if self._upload.result is not None:
                self._sent(vehicle, self._upload, now)

    def _sent(self, vehicle: Vehicle, upload: UploadDialogue, now: float) -> None:
        self._opaque_id = upload.opaque_id
        if upload.result is UploadResult.FAILED:
            self._failure = self._with_reasons(vehicle, upload.error)
            if not self.touched:
                self.finish(self._failure)
                return
        elif upload.result is UploadResult.DOUBTFUL:
            self._doubt = self._with_reasons(vehicle, upload.error)
        # The same number for the same plan was read back before: PX4 computes it from the items.
        elif (read := self._proven_before(self._opaque_id)) is not None:
            self._proven(vehicle, read, now)
            return
        self._download = DownloadDialogue(self._channel, self._timer, gives_up_s=self._dialect.gives_up_s)
        self._download.begin(now)

    def _proven_before(self, opaque_id: int) -> str | None:
        """Return the fingerprint that was read back of this plan when it had this number; None if it never was."""
        sent, read = self._held.proven.get(opaque_id, ("", ""))
        return read if opaque_id and sent == self.plan.fingerprint else None

    def _read_back(self, vehicle: Vehicle, download: DownloadDialogue, now: float) -> None:
        """Compare what was read back, or give up if it could not be read."""
        self._download = None
        self._upload = None
        why = self._failure or self._doubt
        if download.error:
            self._unknown(why or "accepted", f"what it holds is not known: {download.error}")
            return
        held = self._dialect.from_wire(self.kind, download.items)
        result = compare(self.plan, held, self._dialect)
        if result.same and not self._failure:
            self._opaque_id = download.opaque_id or self._opaque_id
            self.notes += result.notes
            self._proven(vehicle, held.fingerprint, now)
        else:
            self._holds_other(held, download.opaque_id, why, result.differences, now)

    def _holds_other(self, held: Plan, opaque_id: int, why: str, differences: tuple[str, ...], now: float) -> None:
        """End with an error: the vehicle holds something else."""
        before = self.before.plan if self.before is not None else None
        if self.before is not None and before is not None and compare(before, held, self._dialect).same:
            self._keep(before, now, read=held.fingerprint, ours=self.before.ours, opaque_id=opaque_id)
            self.finish(f"{why or 'accepted'}; it still holds the {self.kind.word} from before")
            return
        self._keep(held, now, read=held.fingerprint, ours=False, opaque_id=opaque_id)
        # After a failed upload ArduPilot holds the part that was sent
        # (docs/autopilots.md "Missions, fence, rally of ArduCopter").
        new = begins_alike(self.plan, held, self._dialect) if why else 0
        self._held.partial = new > 0
        if self._held.partial:
            rest = "the rest is old" if len(held.items) > new else "no more"
            offer = "restore the one from before, or clear it" if self._held.before is not None else "clear it"
            self.finish(f"{why}; it holds the first {new} of {len(self.plan.items)} items, {rest}: {offer}")
        elif not held.items:
            self.finish(f"{why or 'accepted'}; it holds no {self.kind.word}")
        elif why:
            self.finish(f"{why}; it holds another {self.kind.word}")
        else:
            self._log(f"{self.kind.word} on vehicle is not ours: {differences[0]}", ALERT)
            self.finish(f"accepted, but the vehicle holds something else: {differences[0]}")

    def _unknown(self, why: str, what: str) -> None:
        self._held.stale = what
        self.finish(f"{why}; {what}")

    def _proven(self, vehicle: Vehicle, read: str, now: float) -> None:
        """The vehicle holds the plan, which is read back as `read`. Wait for its judgement where it gives one."""
        self._download = self._upload = None
        self.done = self.total
        self._keep(self.plan, now, read=read, ours=True, opaque_id=self._opaque_id)
        self._held.before = None
        waits = self.kind is PlanKind.MISSION and self._dialect.checks_after_upload
        if waits or (self.kind is PlanKind.FENCE and self._dialect.fence_text):
            self._acked_s = now
        else:
            self._succeed()

    def _judge(self, vehicle: Vehicle, now: float) -> None:
        """Wait for the judgement: PX4 checks a mission or fence only after it has accepted it."""
        acked_s = self._acked_s if self._acked_s is not None else now
        if self.kind is PlanKind.FENCE:
            thrown = [text for text in vehicle.reasons_since(self.begun_s) if text.startswith(self._dialect.fence_text)]
            if thrown:
                self.finish(f"accepted, but a part was thrown away: {thrown[0]}")
            elif now - acked_s >= FENCE_TEXT_S:
                self._succeed()
            return
        reasons = vehicle.reasons_since(self.begun_s)
        rejections = [text for text in reasons if text.startswith(REJECTS)]
        judgement = False if rejections or self._rejected else self._reported_judgement(vehicle, acked_s)
        if judgement is False and now - acked_s < MIN_JUDGEMENT_S:
            return  # its other texts are on their way
        if judgement is False:
            silent = f"event 0x{self._rejected:08x}" if self._rejected else "it did not say why"
            before = self._held.rejected.get(self._opaque_id, silent)
            why = "; ".join((rejections or reasons)[:3]) or before
            if self._opaque_id:
                self._held.rejected[self._opaque_id] = why
            self.finish(f"accepted, but it cannot be flown: {why}")
        elif judgement:
            # PX4 takes the same plan now: what prevented it is gone.
            self._held.rejected.pop(self._opaque_id, None)
            self._succeed()
        elif now - acked_s >= MAX_JUDGEMENT_S:
            self.finish("accepted, but the vehicle did not report whether it can be flown")

    def _reported_judgement(self, vehicle: Vehicle, acked_s: float) -> bool | None:
        """What MISSION_CURRENT reports of this plan since it was accepted; None if nothing yet."""
        state = self._state
        # An earlier report may be of the old plan.
        if state.last_heard_s < acked_s + MIN_JUDGEMENT_S or state.total != len(self.plan.items):
            return None
        number = state.ids.get(self.kind, 0)
        if number and self._opaque_id and number != self._opaque_id:
            return None
        if state.progress is not MissionProgress.UNKNOWN:
            return state.progress is not MissionProgress.NO_MISSION
        if state.last_heard_s < acked_s + (LOSSY_JUDGEMENT_S if vehicle.loss_pct > 0 else SILENT_JUDGEMENT_S):
            return None
        return self._opaque_id not in self._held.rejected

    def on_event(self, number: int) -> None:
        """Take the id of an EVENT of the vehicle."""
        if self.touched and number in self._dialect.rejections:
            self._rejected = number

    def _succeed(self) -> None:
        for note in self.notes:
            self._log(f"{self.name}: {note}", NOTICE)
        self.finish()

    def _with_reasons(self, vehicle: Vehicle, why: str) -> str:
        """Append the reasons that the vehicle has sent since the job began."""
        reasons = "; ".join(vehicle.reasons_since(self.begun_s)[:3])
        return f"{why} ({reasons})" if why and reasons else why or reasons


class ClearJob(PlanJob):
    """Deletes one kind of plan, and verifies that it is gone."""

    def __init__(self, context: ServiceContext, registry: PlanRegistry, vehicle: int, kind: PlanKind) -> None:
        super().__init__(context, registry, vehicle, f"{kind.word} clear", kind)
        self._tries, self._next_s = 0, 0.0
        self._refused: tuple[int, float] | None = None
        self._download: DownloadDialogue | None = None

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Send the first order, unless the vehicle flies the mission."""
        if self.kind is PlanKind.MISSION and dialect_of(vehicle).flies_mission(vehicle):
            self.finish("it flies its mission: pause first")
        else:
            self._send_clear(now)

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Repeat the order until it is answered: clearing twice does no harm."""
        if self._download is not None:
            self._download.tick(now)
            self._look(vehicle, now)
        elif self._refused is not None:
            if now >= self._refused[1]:
                reasons = "; ".join(vehicle.reasons_since(self.begun_s)[:3])
                self.finish(f"refused: {result_word(self._refused[0])}" + (f" ({reasons})" if reasons else ""))
        elif now >= self._next_s:
            if self._tries < CLEAR_TRIES:
                self._send_clear(now)
            else:
                self.finish("no answer")

    def on_message(self, vehicle: Vehicle, name: str, fields: dict[str, Any], now: float) -> None:
        """Take the answer, or the count afterwards."""
        if self._download is not None:
            self._download.on_message(name, fields, now)
            self._look(vehicle, now)
        elif name == "MISSION_ACK" and fields["type"] == ACCEPTED:
            # An ACK is no proof: the count shows whether the plan is gone.
            self._download = DownloadDialogue(self._channel, self._timer, count_only=True)
            self._download.begin(now)
            self._look(vehicle, now)
        # Texts that explain a refusal come within milliseconds, before or after the ACK: they are waited for.
        elif name == "MISSION_ACK" and fields["type"] != DENIED and self._refused is None:
            self._refused = (fields["type"], now + 0.6)

    def _send_clear(self, now: float) -> None:
        self._tries += 1
        self._next_s = now + CLEAR_GAP_S
        if not self._channel.begin("clear", "MISSION_CLEAR_ALL"):
            self.finish(self._channel.refused)
        elif self._tries == 1:
            self._mark_changing()

    def _look(self, vehicle: Vehicle, now: float) -> None:
        download = self._download
        if self.over or download is None or not download.over:
            return
        left = (download.count or 0) - dialect_of(vehicle).wire_count(Plan(self.kind))
        if download.error:
            self.finish(f"accepted, but whether it is gone is not known: {download.error}")
        elif left > 0:
            self.finish(f"accepted, but {left} items are left")
        else:
            nothing = Plan(self.kind)
            self._keep(nothing, now, read=nothing.fingerprint, ours=True, opaque_id=0)
            self.finish()


def _home_deg(context: ServiceContext, vehicle: Vehicle) -> tuple[float, float] | None:
    """The home that the vehicle reports, as (latitude, longitude) in degrees; None if unknown."""
    if vehicle.telemetry.home_m is None:
        return None
    lat_deg, lon_deg = context.fleet.frame.to_geodetic(vehicle.telemetry.home_m[0], vehicle.telemetry.home_m[1])
    return float(lat_deg), float(lon_deg)
