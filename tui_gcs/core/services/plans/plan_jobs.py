"""Long exchanges about plans as jobs: upload with proof, download, clear.

An upload is done when the vehicle was asked what it holds, and holds what was sent. An ACK is no proof: ArduPilot
stores items one by one, a third station may have put some in between. PX4's opaque id (its own checksum of what came)
is none either, for it is the vehicle's word about what it got, not about what we sent; but a number that was once
proven by reading back is, when the same plan gets it again.

When an upload fails the vehicle is asked, too: what it holds then is told, and kept in the book.
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
JUDGED_S, UNJUDGED_S = 0.5, 10.0
"""A verdict on an accepted mission that comes earlier may be the old one's; PX4 tells it once a second."""
SILENT_VERDICT_S, LOSSY_VERDICT_S = 2.0, 5.0
"""PX4 up to 1.16 says only that a mission cannot be flown, in an EVENT; that one is lost is noticed after 3 s."""
REJECTS = ("Mission rejected", "Geofence violation", "Not yet ready for mission")
"""How PX4's texts and EVENTs begin."""
FENCE_TEXT_S = 1.5

OnDone = Callable[[Job], None]


class PlanJob(Job):
    """What uploads, downloads and deletions have in common."""

    def __init__(self, context: ServiceContext, book: PlanRegistry, vehicle: int, name: str, kind: PlanKind) -> None:
        """`name` is the operator's word; the service sets `on_done`."""
        super().__init__(vehicle, name)
        self.kind = kind
        self.changing = False
        """The vehicle was told of it: what it holds may be a part of it."""
        self.notes: list[str] = []
        """What the operator should know of a success."""
        self.before: HeldPlan | None = None
        """What was known to be on board when it began."""
        self._context = context
        self._book = book
        self._wire = PlanChannel(context.uplink, vehicle, kind)
        self._pace = RetryTimer()

    @property
    def _state(self) -> MissionState:
        return self._book.state(self.vehicle)

    @property
    def _held(self) -> HeldPlan:
        return self._state.held[self.kind]

    def hear(self, vehicle: Vehicle, name: str, fields: dict[str, Any], now: float) -> None:
        """A message about this kind of plan, for us; what it asks is answered at once."""

    def _say(self, text: str, severity: int) -> None:
        self._context.events.report(EventClass.MISSION, f"vehicle {self.vehicle}", text, severity)

    def _keep(self, plan: Plan, now: float, *, read: str, ours: bool, opaque_id: int) -> None:
        """This is on board now, and was read as what has the fingerprint `read`."""
        held = self._held
        if ours:
            self._book.put(self.vehicle, self.kind, read)
        held.plan, held.ours, held.opaque_id = plan, ours, opaque_id
        held.stale, held.partial, held.since_s = "", False, now
        if opaque_id:
            if len(held.proven) > MAX_PROVEN:
                held.proven.clear()
            held.proven[opaque_id] = plan.fingerprint, read
        self._state.changed_s[self.kind] = now
        self._state.strange.pop(self.kind, None)
        if self.kind is PlanKind.MISSION:
            self._state.total, self._state.reached = len(plan.items), None

    def _touch(self) -> None:
        """What is on board is about to change: until it was asked nothing is known; what it held may be restored."""
        held, self.changing = self._held, True
        self.before = replace(held) if held.known else None
        if held.known and not held.partial:
            held.before = held.plan
        held.stale = f"a {self.name} was begun, and not completed"


class DownloadJob(PlanJob):
    """Reads one kind of plan; `plan` is there once it is done."""

    def __init__(self, context: ServiceContext, book: PlanRegistry, vehicle: int, kind: PlanKind) -> None:
        """See `MissionService.download`."""
        super().__init__(context, book, vehicle, f"{kind.word} download", kind)
        self.plan: Plan | None = None
        self.problems: list[str] = []
        """What is wrong with what the vehicle sent: nothing of it may be drawn or sent again unseen (B.6-59)."""
        self._reading = DownloadDialogue(self._wire, self._pace)

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Ask how many items there are."""
        self._wire.home_items = dialect_of(vehicle).wire_count(Plan(self.kind))
        self._reading = DownloadDialogue(self._wire, self._pace, gives_up_s=dialect_of(vehicle).gives_up_s)
        self._reading.begin(now)
        self._look(vehicle, now)

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Ask again for what is missing."""
        self._reading.tick(now)
        self._look(vehicle, now)

    def hear(self, vehicle: Vehicle, name: str, fields: dict[str, Any], now: float) -> None:
        """A part of the answer."""
        self._reading.hear(name, fields, now)
        self._look(vehicle, now)

    def abort(self) -> None:
        """PX4 is busy for 5 s if it is not told."""
        self._wire.end(CANCELLED)

    def _look(self, vehicle: Vehicle, now: float) -> None:
        reading = self._reading
        self.done, self.total = reading.come, reading.count or 0
        if self.over or not reading.over:
            return
        if reading.error:
            self.finish(reading.error)
            return
        self.plan = dialect_of(vehicle).from_wire(self.kind, reading.items)
        self.problems = [str(problem) for problem in check(self.plan)]
        if self.problems:
            self._say(f"{self.kind.word} on board: {self.problems[0]}", WARNING)
        held = self._held
        same = held.ours and held.plan is not None and compare(held.plan, self.plan, dialect_of(vehicle)).same
        ours = same or self._book.is_ours(self.vehicle, self.plan)
        if held.ours and held.known and not ours:
            self._say(f"{self.kind.word} on vehicle is not ours", ALERT)
        kept = held.plan if same and held.plan is not None else self.plan
        self._keep(kept, now, read=self.plan.fingerprint, ours=ours, opaque_id=reading.opaque_id)
        self.finish()


class UploadJob(PlanJob):
    """Sends one plan and proves that it is held."""

    def __init__(
        self, context: ServiceContext, book: PlanRegistry, vehicle: int, plan: Plan, *, in_flight: bool
    ) -> None:
        """See `MissionService.upload`."""
        super().__init__(context, book, vehicle, f"{plan.kind.word} upload", plan.kind)
        self.plan = plan
        self.in_flight = in_flight
        self._touched = False
        """The vehicle was told that a plan comes."""
        self._dialect: PlanDialect
        self._terrain: TerrainCheck | None = None
        """Asked before anything is sent."""
        self._sending: UploadDialogue | None = None
        self._reading: DownloadDialogue | None = None
        self._opaque_id = 0
        self._failure = ""
        """Why it failed, while it is asked what the vehicle holds now."""
        self._doubt = ""
        self._rejected = 0
        """The EVENT that said that the mission cannot be flown."""
        self._acked_s: float | None = None
        """When the vehicle accepted it, if what comes of it is waited for."""

    @property
    def touched(self) -> bool:
        """Whether the vehicle was told that a plan comes: what it holds may be that plan's already."""
        return self._touched

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Look whether it may be sent, and say how many items come."""
        self._dialect = dialect_of(vehicle)
        self._wire.home_items = self._dialect.wire_count(Plan(self.kind))
        why = self._why_not(vehicle)
        if why:
            self.finish(why)
        elif self._dialect.flies_blind(self.plan):
            self._terrain = TerrainCheck(self._context)
            self._terrain.tick(vehicle, now)
        else:
            self._send(vehicle, now)

    def _send(self, vehicle: Vehicle, now: float) -> None:
        items = self._dialect.to_wire(self.plan)
        self.total = 2 * len(items)  # each is sent, and read back
        patience_s = self._dialect.patience_s
        self._sending = UploadDialogue(
            self._wire, items, self._pace, patience_s=patience_s, from_start=not self.in_flight
        )
        self._sending.begin(now)
        self._touched = self._sending.verdict is None
        if self._touched:
            self._touch()
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
        """Repeat what is not answered; wait for the vehicle's second thoughts."""
        if self._terrain is not None:
            self._ask_terrain(self._terrain, vehicle, now)
        elif self._reading is not None:
            self._reading.tick(now)
        elif self._acked_s is not None:
            self._judge(vehicle, now)
        elif self._sending is not None:
            self._sending.tick(now)
        self._look(vehicle, now)

    def _ask_terrain(self, terrain: TerrainCheck, vehicle: Vehicle, now: float) -> None:
        terrain.tick(vehicle, now)
        if terrain.answer is not None:
            self._terrain = None
            if terrain.answer:
                self.finish(terrain.answer)
            else:
                self._send(vehicle, now)

    def hear(self, vehicle: Vehicle, name: str, fields: dict[str, Any], now: float) -> None:
        """A part of the dialogue."""
        if self._reading is not None:
            self._reading.hear(name, fields, now)
        elif self._sending is not None:
            self._sending.hear(name, fields, now)
        self._look(vehicle, now)

    def abort(self) -> None:
        """ArduPilot does not listen to that, and keeps the part that it got."""
        self._wire.end(CANCELLED)

    # ------------------------------------------------------------ after the last item

    def _look(self, vehicle: Vehicle, now: float) -> None:
        """Go on with the next step where one is over."""
        if self.over or self._acked_s is not None:
            return
        if self._reading is not None:
            items = self.total // 2
            self.done = items + min(self._reading.come, items)
            if self._reading.over:
                self._read_back(vehicle, self._reading, now)
        elif self._sending is not None:
            self.done = self._sending.asked
            if self._sending.verdict is not None:
                self._sent(vehicle, self._sending, now)

    def _sent(self, vehicle: Vehicle, sending: UploadDialogue, now: float) -> None:
        self._opaque_id = sending.opaque_id
        if sending.verdict is UploadResult.FAILED:
            self._failure = self._with_reasons(vehicle, sending.error)
            if not self._touched:
                self.finish(self._failure)
                return
        elif sending.verdict is UploadResult.DOUBTFUL:
            self._doubt = self._with_reasons(vehicle, sending.error)
        elif (read := self._proven_before(self._opaque_id)) is not None:
            self._proven(vehicle, read, now)
            return
        self._reading = DownloadDialogue(self._wire, self._pace, gives_up_s=self._dialect.gives_up_s)
        self._reading.begin(now)

    def _proven_before(self, opaque_id: int) -> str | None:
        """What was read back of just this plan when it had just this number; None: it never was."""
        sent, read = self._held.proven.get(opaque_id, ("", ""))
        return read if opaque_id and sent == self.plan.fingerprint else None

    def _read_back(self, vehicle: Vehicle, reading: DownloadDialogue, now: float) -> None:
        """What is on board is known, or cannot be known."""
        self._reading = None
        self._sending = None
        why = self._failure or self._doubt
        if reading.error:
            self._unknown(why or "accepted", f"what it holds is not known: {reading.error}")
            return
        held = self._dialect.from_wire(self.kind, reading.items)
        result = compare(self.plan, held, self._dialect)
        if result.same and not self._failure:
            self._opaque_id = reading.opaque_id or self._opaque_id
            self.notes += result.notes
            self._proven(vehicle, held.fingerprint, now)
        else:
            self._holds_other(held, reading.opaque_id, why, result.differences, now)

    def _holds_other(self, held: Plan, opaque_id: int, why: str, differences: tuple[str, ...], now: float) -> None:
        """The upload failed, and this is what the vehicle holds now."""
        before = self.before.plan if self.before is not None else None
        if self.before is not None and before is not None and compare(before, held, self._dialect).same:
            self._keep(before, now, read=held.fingerprint, ours=self.before.ours, opaque_id=opaque_id)
            self.finish(f"{why or 'accepted'}; it still holds the {self.kind.word} from before")
            return
        self._keep(held, now, read=held.fingerprint, ours=False, opaque_id=opaque_id)
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
            self._say(f"{self.kind.word} on vehicle is not ours: {differences[0]}", ALERT)
            self.finish(f"accepted, but the vehicle holds something else: {differences[0]}")

    def _unknown(self, why: str, what: str) -> None:
        self._held.stale = what
        self.finish(f"{why}; {what}")

    def _proven(self, vehicle: Vehicle, read: str, now: float) -> None:
        """The vehicle holds the plan, which comes back as `read`; does it also want it?"""
        self._reading = self._sending = None
        self.done = self.total
        self._keep(self.plan, now, read=read, ours=True, opaque_id=self._opaque_id)
        self._held.before = None
        waits = self.kind is PlanKind.MISSION and self._dialect.judges_afterwards
        if waits or (self.kind is PlanKind.FENCE and self._dialect.fence_text):
            self._acked_s = now
        else:
            self._succeed()

    def _judge(self, vehicle: Vehicle, now: float) -> None:
        """PX4 looks at a mission or fence only after it has accepted it."""
        acked_s = self._acked_s if self._acked_s is not None else now
        if self.kind is PlanKind.FENCE:
            thrown = [text for text in vehicle.reasons_since(self.begun_s) if text.startswith(self._dialect.fence_text)]
            if thrown:
                self.finish(f"accepted, but a part was thrown away: {thrown[0]}")
            elif now - acked_s >= FENCE_TEXT_S:
                self._succeed()
            return
        reasons = vehicle.reasons_since(self.begun_s)
        said = [text for text in reasons if text.startswith(REJECTS)]
        verdict = False if said or self._rejected else self._what_it_says(vehicle, acked_s)
        if verdict is False and now - acked_s < JUDGED_S:
            return  # its other texts are on their way
        if verdict is False:
            silent = f"event 0x{self._rejected:08x}" if self._rejected else "it did not say why"
            before = self._held.rejected.get(self._opaque_id, silent)
            why = "; ".join((said or reasons)[:3]) or before
            if self._opaque_id:
                self._held.rejected[self._opaque_id] = why
            self.finish(f"accepted, but it cannot be flown: {why}")
        elif verdict:
            self._held.rejected.pop(self._opaque_id, None)
            self._succeed()
        elif now - acked_s >= UNJUDGED_S:
            self.finish("accepted, but whether it can be flown the vehicle did not say")

    def _what_it_says(self, vehicle: Vehicle, acked_s: float) -> bool | None:
        """What MISSION_CURRENT says of this plan since; None: nothing yet."""
        state = self._state
        if state.heard_s < acked_s + JUDGED_S or state.total != len(self.plan.items):
            return None
        number = state.ids.get(self.kind, 0)
        if number and self._opaque_id and number != self._opaque_id:
            return None
        if state.progress is not MissionProgress.UNKNOWN:
            return state.progress is not MissionProgress.NO_MISSION
        if state.heard_s < acked_s + (LOSSY_VERDICT_S if vehicle.loss_pct > 0 else SILENT_VERDICT_S):
            return None
        return self._opaque_id not in self._held.rejected

    def hear_event(self, number: int) -> None:
        """An EVENT of the vehicle."""
        if self._touched and number in self._dialect.rejections:
            self._rejected = number

    def _succeed(self) -> None:
        for note in self.notes:
            self._say(f"{self.name}: {note}", NOTICE)
        self.finish()

    def _with_reasons(self, vehicle: Vehicle, why: str) -> str:
        """With what the vehicle said since it began."""
        reasons = "; ".join(vehicle.reasons_since(self.begun_s)[:3])
        return f"{why} ({reasons})" if why and reasons else why or reasons


class ClearJob(PlanJob):
    """Deletes one kind of plan, and looks whether it is gone."""

    def __init__(self, context: ServiceContext, book: PlanRegistry, vehicle: int, kind: PlanKind) -> None:
        """See `MissionService.clear`."""
        super().__init__(context, book, vehicle, f"{kind.word} clear", kind)
        self._tries, self._next_s = 0, 0.0
        self._refused: tuple[int, float] | None = None
        self._reading: DownloadDialogue | None = None

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Say it once."""
        if self.kind is PlanKind.MISSION and dialect_of(vehicle).flies_mission(vehicle):
            self.finish("it flies its mission: pause first")
        else:
            self._say_clear(now)

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Say it again until it is answered: clearing twice is clearing."""
        if self._reading is not None:
            self._reading.tick(now)
            self._look(vehicle, now)
        elif self._refused is not None:
            if now >= self._refused[1]:
                reasons = "; ".join(vehicle.reasons_since(self.begun_s)[:3])
                self.finish(f"refused: {result_word(self._refused[0])}" + (f" ({reasons})" if reasons else ""))
        elif now >= self._next_s:
            if self._tries < CLEAR_TRIES:
                self._say_clear(now)
            else:
                self.finish("no answer")

    def hear(self, vehicle: Vehicle, name: str, fields: dict[str, Any], now: float) -> None:
        """The answer, or the count afterwards."""
        if self._reading is not None:
            self._reading.hear(name, fields, now)
            self._look(vehicle, now)
        elif name == "MISSION_ACK" and fields["type"] == ACCEPTED:
            self._reading = DownloadDialogue(self._wire, self._pace, count_only=True)
            self._reading.begin(now)
            self._look(vehicle, now)
        elif name == "MISSION_ACK" and fields["type"] != DENIED and self._refused is None:
            self._refused = (fields["type"], now + 0.6)

    def _say_clear(self, now: float) -> None:
        self._tries += 1
        self._next_s = now + CLEAR_GAP_S
        if not self._wire.begin("clear", "MISSION_CLEAR_ALL"):
            self.finish(self._wire.refused)
        elif self._tries == 1:
            self._touch()

    def _look(self, vehicle: Vehicle, now: float) -> None:
        reading = self._reading
        if self.over or reading is None or not reading.over:
            return
        left = (reading.count or 0) - dialect_of(vehicle).wire_count(Plan(self.kind))
        if reading.error:
            self.finish(f"accepted, but whether it is gone is not known: {reading.error}")
        elif left > 0:
            self.finish(f"accepted, but {left} items are left")
        else:
            nothing = Plan(self.kind)
            self._keep(nothing, now, read=nothing.fingerprint, ours=True, opaque_id=0)
            self.finish()


def _home_deg(context: ServiceContext, vehicle: Vehicle) -> tuple[float, float] | None:
    """Where the vehicle says its home is, (latitude, longitude)."""
    if vehicle.telemetry.home_m is None:
        return None
    lat_deg, lon_deg = context.fleet.frame.to_geodetic(vehicle.telemetry.home_m[0], vehicle.telemetry.home_m[1])
    return float(lat_deg), float(lon_deg)
