"""Uploads, downloads and clears the missions, fences and rally points of vehicles, and follows their progress.

    job = missions.upload(1, plan, on_done)        # done only when the vehicle was asked and holds the plan
    missions.state(1).current                      # the item it flies to
    missions.holds(1, plan)                        # True, False, or None where that is not known

A change that is not ours raises the alarm "mission on vehicle is not ours", and what was known is marked stale. It is
noticed by the vehicle's own plan numbers, by its count of items, or by its ACK to another station.
"""

import math
from functools import partial
from typing import Any, TypeVar

from tui_gcs.core.firmware.plan_dialects import CMD_SET_CURRENT, dialect_of
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.permission import Order
from tui_gcs.core.plans.model import Plan, PlanKind
from tui_gcs.core.protocol.common import EventClass, Freshness
from tui_gcs.core.records.event_log import ALERT
from tui_gcs.core.services.context import ActionDone, ServiceContext
from tui_gcs.core.services.plans.mission_jumps import jump_words
from tui_gcs.core.services.plans.plan_jobs import ClearJob, DownloadJob, OnDone, PlanJob, UploadJob
from tui_gcs.core.services.plans.plan_messages import ACCEPTED
from tui_gcs.core.services.plans.plan_table import MissionProgress, MissionState, PlanRegistry
from tui_gcs.core.uplink.actions import MavCommand, RetryClass, VehicleAction

TRANSFER = ("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ACK")
PROGRESS = {progress.value: progress for progress in MissionProgress}
NO_MISSION = 0xFFFF
"""The value of MISSION_CURRENT.total and .seq of a vehicle without a mission."""
LATE_REPORT_S = 4.0
"""How late reports may be after a change of ours."""
LOOK_PERIOD_S, SILENT_S = 1.0, 5.0
"""How often MISSION_CURRENT is looked for, and after which silence it is requested: poor links lack it."""
MISSION_CURRENT = 42
MAX_CONTRADICTIONS = 2
"""How many reports in a row must contradict what is known before that is an alarm."""

Fields = dict[str, Any]
J = TypeVar("J", bound=PlanJob)


class MissionService:
    """Submits plan jobs, and keeps what is known of each vehicle's plans in `registry`."""

    def __init__(self, context: ServiceContext) -> None:
        self._context = context
        self.registry = PlanRegistry()
        self._next_look_s = -math.inf
        for name in TRANSFER:
            context.fleet.on_message(name, partial(self._on_transfer, name))
        context.fleet.on_message("MISSION_CURRENT", self._on_current)
        context.fleet.on_message("MISSION_ITEM_REACHED", self._on_reached)
        context.fleet.on_message("EVENT", self._on_event)
        context.forget_with(self._on_reboot)

    def upload(
        self, vehicle: int, plan: Plan, on_done: OnDone | None = None, *, in_flight: bool = False, first: bool = False
    ) -> UploadJob:
        """Submit a job that puts `plan` on a vehicle.

        Problems of the plan, and what the vehicle reports against it, become the job's `error`.

        Args:
            vehicle: The vehicle's id.
            plan: Its kind and items.
            on_done: Called once, however the job ends.
            in_flight: Upload also while the vehicle flies its mission, which then changes item by item.
            first: Queue the job before all others.
        """
        return self._submit(UploadJob(self._context, self.registry, vehicle, plan, in_flight=in_flight), on_done, first)

    def download(
        self, vehicle: int, kind: PlanKind, on_done: OnDone | None = None, *, first: bool = False
    ) -> DownloadJob:
        """Submit a job that reads what a vehicle holds: `job.plan`."""
        return self._submit(DownloadJob(self._context, self.registry, vehicle, kind), on_done, first)

    def clear(self, vehicle: int, kind: PlanKind, on_done: OnDone | None = None) -> ClearJob:
        """Submit a job that deletes one kind of plan.

        For all kinds call it once each, because ArduPilot knows no "all".
        """
        return self._submit(ClearJob(self._context, self.registry, vehicle, kind), on_done, False)

    def restore(self, vehicle: int, kind: PlanKind, on_done: OnDone | None = None) -> UploadJob | None:
        """Put back what a vehicle held before an upload failed; None if that is not known."""
        before = self.state(vehicle).held[kind].before
        return None if before is None or not before.items else self.upload(vehicle, before, on_done)

    def set_current(self, vehicle: int, index: int, on_done: ActionDone | None = None) -> str:
        """Make the vehicle go on with item `index` of the plan; returns "" or why it cannot.

        `on_done` as in `VehicleAction`.
        """
        known = self._context.fleet.vehicles.get(vehicle)
        if known is None:
            return "unknown vehicle"
        state, dialect = self.state(vehicle), dialect_of(known)
        if state.total is not None and not 0 <= index < state.total:
            return f"item {index + 1} of {state.total} does not exist"
        if not 0 <= index < NO_MISSION - 1:
            return f"item {index + 1} does not exist"
        seq = dialect.seq_of(index)
        self._context.commands.submit(
            VehicleAction(
                vehicle,
                "mission item",
                RetryClass.SET,
                send=lambda copy: self._send_current(vehicle, seq, copy, by_command=dialect.sets_by_command),
                confirmed=lambda v: self.state(v.id).current == index,
                command=CMD_SET_CURRENT if dialect.sets_by_command else None,
                on_done=on_done,
            )
        )
        return ""

    def state(self, vehicle: int) -> MissionState:
        """Return what is known of a vehicle's plans and progress.

        Do not keep it: after a reboot it is another object.
        """
        return self.registry.state(vehicle)

    def holds(self, vehicle: int, plan: Plan) -> bool | None:
        """Whether the vehicle holds `plan`, as far as is known; None if it has to be asked (`download`)."""
        held = self.state(vehicle).held[plan.kind]
        if not held.known or held.plan is None:
            return None
        return held.plan.fingerprint == plan.fingerprint

    def tick(self) -> None:
        """Request MISSION_CURRENT from vehicles that fly a mission and do not report it by themselves."""
        now = self._context.clock.now()
        if now < self._next_look_s:
            return
        self._next_look_s = now + LOOK_PERIOD_S
        for vehicle in self._context.fleet.vehicles.values():
            dialect = dialect_of(vehicle)
            if not dialect.reports_on_request or vehicle.path.high_latency or vehicle.freshness(now) is Freshness.LOST:
                continue
            state = self.state(vehicle.id)
            held = state.held[PlanKind.MISSION].plan
            # Only vehicles with a mission: on a poor link every request costs telemetry.
            if (
                (held is not None and held.items) or dialect.flies_mission(vehicle)
            ) and now - state.last_heard_s > SILENT_S:
                self._context.request_message(vehicle.id, MISSION_CURRENT)

    def _submit(self, job: J, on_done: OnDone | None, first: bool) -> J:
        job.on_done = on_done
        return self._context.jobs.submit(job, first=first)

    def _send_current(self, vehicle: int, seq: int, copy: int, *, by_command: bool) -> str:
        uplink = self._context.uplink
        self.state(vehicle).led_on_s = self._context.clock.now()
        if not by_command:
            return uplink.action(vehicle, Order("mission item"), "MISSION_SET_CURRENT", seq=seq)
        order = MavCommand(CMD_SET_CURRENT, (seq,))
        return uplink.action(vehicle, Order("mission item"), order.message, **order.fields(copy))

    def _on_transfer(self, name: str, vehicle: Vehicle, fields: Fields) -> None:
        """Pass a message of the mission protocol to the job that runs with this vehicle."""
        if not self._context.is_for_us(fields):
            if name == "MISSION_ACK" and fields["type"] == ACCEPTED:
                self._changed_by_another(vehicle, fields)
            return
        job = self._context.jobs.running(vehicle.id)
        # A part of a transfer that was not begun here is dropped, e.g. requests for a cancelled upload.
        if isinstance(job, PlanJob) and not job.over and fields.get("mission_type", 0) == job.kind:
            job.on_message(vehicle, name, fields, self._context.clock.now())
        else:
            self._context.fleet.dropped.count(f"{name} outside of a transfer", vehicle.id)

    def _changed_by_another(self, vehicle: Vehicle, fields: Fields) -> None:
        """Take the ACK of another station's upload or deletion: the plan on board has changed."""
        kind = fields.get("mission_type", 0)
        if kind in tuple(PlanKind):
            system, now = fields["target_system"], self._context.clock.now()
            stations, text = self._context.fleet.other_stations, f"another station changed its {PlanKind(kind).word}"
            stations.hear_command(vehicle.network, system, vehicle.system, now)
            stations.note(vehicle.network, vehicle.system, text, now, of_mission=kind == PlanKind.MISSION)
            self._not_ours(vehicle.id, PlanKind(kind), f"station {system} changed it")

    def _not_ours(self, vehicle: int, kind: PlanKind, why: str) -> None:
        held = self.state(vehicle).held[kind]
        if held.known:
            held.stale = why
            text = f"{kind.word} on vehicle {'is not ours' if held.ours else 'changed'}: {why}"
            self._context.events.report(EventClass.MISSION, f"vehicle {vehicle}", text, ALERT, every_s=5)

    def _on_event(self, vehicle: Vehicle, fields: Fields) -> None:
        job = self._context.jobs.running(vehicle.id)
        if isinstance(job, UploadJob) and not job.over:
            job.on_event(fields["id"])

    def _on_reached(self, vehicle: Vehicle, fields: Fields) -> None:
        state = self.state(vehicle.id)
        index = dialect_of(vehicle).index_of(fields["seq"])
        if index >= 0 and (state.total is None or index < state.total):
            state.reached = index

    def _on_current(self, vehicle: Vehicle, fields: Fields) -> None:
        state, now = self.state(vehicle.id), self._context.clock.now()
        before, silent_s, state.last_heard_s = state.current, now - state.last_heard_s, now
        state.progress = PROGRESS.get(fields.get("mission_state", 0), MissionProgress.UNKNOWN)
        total = fields.get("total", 0)
        if total == NO_MISSION or (total == 0 and state.progress is MissionProgress.NO_MISSION):
            state.total = 0
        else:
            state.total = total or None  # 0: it does not report the count
        state.current = self._index(vehicle, fields["seq"], state.total)
        self._look_for_jump(vehicle, state, before, silent_s)
        numbers = (fields.get("mission_id", 0), fields.get("fence_id", 0), fields.get("rally_points_id", 0))
        state.ids = dict(zip(PlanKind, numbers, strict=True))
        # A vehicle that never numbered a kind (ArduPilot) cannot contradict by a number.
        state.numbered |= {kind for kind, number in state.ids.items() if number}
        for kind in PlanKind:
            self._compare(vehicle.id, state, kind)

    def _look_for_jump(self, vehicle: Vehicle, state: MissionState, before: int | None, silent_s: float) -> None:
        """Note where it went on with an item to which neither its plan nor this station led it."""
        held, now = state.held[PlanKind.MISSION], self._context.clock.now()
        if before is None or state.current is None or held.plan is None or not held.known:
            return
        if now - max(state.led_on_s, state.changed_s.get(PlanKind.MISSION, -math.inf)) < LATE_REPORT_S:
            return
        here_deg = vehicle.telemetry.lat_deg, vehicle.telemetry.lon_deg
        if text := jump_words(held.plan.items, before, state.current, here_deg, silent_s):
            self._context.fleet.other_stations.note(vehicle.network, vehicle.system, f"it {text}", now, of_mission=True)

    def _index(self, vehicle: Vehicle, seq: int, total: int | None) -> int | None:
        """The plan's item that a sequence number means; None for what cannot be (docs/threats.md B.6-65)."""
        index = dialect_of(vehicle).index_of(seq)
        if total == 0 or seq == NO_MISSION or (total is not None and index >= total):
            return None
        # ArduPilot reports home (item 0) as current before the first item.
        return max(index, 0)

    def _compare(self, vehicle: int, state: MissionState, kind: PlanKind) -> None:
        """Compare a report with what is believed to be on board."""
        held, why = state.held[kind], ""
        if held.plan is None or held.stale:
            return
        if held.opaque_id and kind in state.numbered and state.ids[kind] != held.opaque_id:
            why = "its number is another one"
        elif kind is PlanKind.MISSION and state.total is not None and state.total != len(held.plan.items):
            why = f"it has {state.total} items instead of {len(held.plan.items)}"
        job = self._context.jobs.running(vehicle)
        at_work = isinstance(job, PlanJob) and job.kind is kind
        # During and shortly after a transfer reports are late, and may still be of the old plan.
        if not why or at_work or state.last_heard_s - state.changed_s.get(kind, -math.inf) < LATE_REPORT_S:
            state.contradictions[kind] = 0
            return
        state.contradictions[kind] = state.contradictions.get(kind, 0) + 1
        if state.contradictions[kind] >= MAX_CONTRADICTIONS:
            self._not_ours(vehicle, kind, why)

    def _on_reboot(self, vehicle: Vehicle) -> None:
        """Forget what was known, and end a transfer that is under way."""
        self.registry.forget(vehicle.id)
        job = self._context.jobs.running(vehicle.id)
        if isinstance(job, PlanJob):
            # ArduPilot keeps the part that was sent, and may fly it.
            half = isinstance(job, UploadJob) and job.touched
            unknown = f"; it may hold a part of this {job.kind.word}: look what it holds" if half else ""
            job.finish(f"the vehicle rebooted, or is another one{unknown}")
