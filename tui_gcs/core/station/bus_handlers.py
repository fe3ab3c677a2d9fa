"""What a station does when something comes by itself: an answer, a reboot, a plan, a question, a planner that dies."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import msgspec

from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.team_controller import TeamController
from tui_gcs.core.mavlink.commands import CMD_REQUEST_MESSAGE
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol.common import EventClass, Plan, PlannerInfo, PreviewResult, decode, encode
from tui_gcs.core.protocol.plan_limits import too_large
from tui_gcs.core.records.event_log import NOTICE, WARNING

if TYPE_CHECKING:
    from tui_gcs.core.station.station import Station

ASKED_S = 5.0
"""So long the answer to the question who it is may take."""


class BusHandlers:
    """Takes what comes, and tells those whom it concerns."""

    def __init__(self, station: "Station", own: int) -> None:
        """`own` is the station's system id; nothing is listened to before `listen`."""
        self._station = station
        self._own = own

    def listen(self) -> None:
        """Begin."""
        self._station.fleet.on_message("COMMAND_ACK", self._on_ack)
        self._station.fleet.on_gone(self._on_gone)
        self._station.fleet.on_radio(lambda source, fields: self._station.rates.radio_status(source.link, fields))
        self._station.fleet.on_component(self._station.rates.forget)
        self._station.fleet.on_component(self._station.firmware.forget)
        self._station.fleet.paths.on_reboot.append(self._on_reboot)
        self._station.fleet.paths.on_replace.append(self._on_replace)
        self._station.fleet.paths.on_move.append(self._on_move)
        self._station.trust.on_change.append(self._on_keys)
        self._station.bus.subscribe(keys.PLAN.format(team="*"), self._on_plan)
        self._station.bus.subscribe(keys.PREVIEW.format(team="*"), self._on_preview)
        self._station.bus.answer(keys.REQUEST.format(principal="*"), self._on_question)
        self._station.bus.watch(keys.ALIVE.format(principal="*"), self._on_alive)

    def _on_ack(self, vehicle: Vehicle, fields: Fields) -> None:
        asked = (
            fields["command"] == CMD_REQUEST_MESSAGE
            and self._station.clock.now() - vehicle.identity.version_requested_s < ASKED_S
        )
        if asked and not self._station.commands.pending(vehicle.id, "identify"):
            return
        if fields.get("target_system", 0) in (0, self._own):
            self._station.commands.on_ack(vehicle, fields["command"], fields["result"])
        else:
            self._station.commands.ignored["ack for another station"] += 1

    def _on_move(self, vehicle: Vehicle) -> None:
        self._station.rates.forget(vehicle)
        self._station.executive.moved(vehicle)

    def _on_reboot(self, vehicle: Vehicle) -> None:
        self._station.rates.forget(vehicle)
        self._station.firmware.forget(vehicle)
        self._station.commands.cancel(vehicle.id, keep_stops=True, housekeeping=True)
        self._station.executive.rebooted(vehicle)

    def _on_replace(self, vehicle: Vehicle) -> None:
        self._station.rates.forget(vehicle)
        self._station.firmware.forget(vehicle)
        self._station.executive.replaced(vehicle)

    def _on_gone(self, vehicle: Vehicle) -> None:
        self._station.firmware.forget(vehicle)
        self._station.rates.forget(vehicle)
        self._station.commands.cancel(vehicle.id, housekeeping=True)

    def _on_keys(self) -> None:
        """Keys changed: what is done with whose frames is looked up anew."""
        for intake in self._station.fleet.intakes.values():
            for source in intake.sources.values():
                source.forget()

    def _on_plan(self, key: str, payload: bytes) -> None:
        team = key.split("/")[2]
        desk = self._station.team_controllers.get(team)
        if desk is None:
            self._station.dropped["plan of an unknown team"] += 1
            return
        if problem := too_large(len(payload), len(desk.task.members) if desk.task else 0):
            self._station.dropped["plan too large"] += 1
            text = f"{problem}: not taken"
            self._station.events.report(EventClass.PLANNER, f"planner {team}", text, WARNING, every_s=10)
            return
        try:
            plan = decode(payload, Plan)
        except msgspec.MsgspecError as error:
            self._station.dropped["plan not understood"] += 1
            text = f"plan not understood: {error}"
            self._station.events.report(EventClass.PLANNER, f"planner {team}", text, WARNING, every_s=10)
            return
        if plan.declares is not None:
            self._on_declaration(desk, plan.declares)
        for vehicle, reason in desk.take(plan):
            self._send_home(desk, vehicle, reason)

    def _on_declaration(self, desk: TeamController, info: PlannerInfo) -> None:
        """A file that is watched was saved: its planner may take other parameters. Of simulated vehicles only."""
        config = self._station.config
        known = config.planners.get(info.name)
        ours = known is not None and known.file == info.file != "" and desk.team.planner == info.name
        if config.kind is RunKind.SIM and ours and info != known:
            config.planners[info.name] = info
            text = f"planner {info.name} takes: {', '.join(param.name for param in info.params) or 'nothing'}"
            self._station.events.report(EventClass.PLANNER, f"planner {desk.team.name}", clean(text), NOTICE)

    def _send_home(self, desk: TeamController, vehicle: int, reason: str) -> None:
        """As its planner asks; told and journalled as its wish."""
        why_not = self._station.executive.send_home(vehicle)
        text = f"vehicle {vehicle} is not sent home: {why_not}" if why_not else f"sends vehicle {vehicle} home"
        text += f" ({reason})" if reason else ""
        severity = WARNING if why_not else NOTICE
        self._station.events.report(EventClass.PLANNER, f"planner {desk.team.name}", text, severity, every_s=5)

    def _on_preview(self, key: str, payload: bytes) -> None:
        try:
            self._station.requests.planners.take(key.split("/")[2], decode(payload, PreviewResult))
        except msgspec.MsgspecError:
            self._station.dropped["preview not understood"] += 1

    def _on_question(self, key: str, payload: bytes, reply: Callable[[bytes], None]) -> None:
        reply(encode(self._station.requests.answer(key.rsplit("/", 1)[1], payload)))

    def _on_alive(self, key: str, present: bool) -> None:
        principal = key.rsplit("/", 1)[1]
        if principal.startswith("planner-") and principal[8:] in self._station.team_controllers:
            self._station.team_controllers[principal[8:]].on_alive(present)
