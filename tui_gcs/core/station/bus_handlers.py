"""What the station does when something arrives unasked: an acknowledgement, a reboot, a plan, a request."""

import msgspec

from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.team_controller import TeamController
from tui_gcs.core.mavlink.commands import CMD_REQUEST_MESSAGE
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol.common import EventClass, PlannerInfo, PreviewResult, TeamPlan, decode
from tui_gcs.core.protocol.plan_limits import too_large
from tui_gcs.core.records.event_log import NOTICE, WARNING
from tui_gcs.core.station.assembly import StationParts
from tui_gcs.core.station.frontend_protocol import StationFrontend
from tui_gcs.core.station.parts import SYSTEM_ID

IDENTITY_ANSWER_S = 5.0
"""A COMMAND_ACK of CMD_REQUEST_MESSAGE so soon after the fleet's own identity request answers that request."""
MAX_CONNECTED = 256
"""Principals whose presence is kept; nothing depends on more than that."""


class BusHandlers:
    """Handles events of the fleet and samples of the bus, and passes each on to the parts that depend on it."""

    def __init__(self, parts: StationParts) -> None:
        self._frontend: StationFrontend | None = None
        self._parts = parts
        self._own = SYSTEM_ID[parts.config.kind]
        self._fleet, self._comms = parts.picture.fleet, parts.comms
        self._bus, self._events = parts.records.bus, parts.records.events

    def listen(self) -> None:
        """Register at the fleet, the key store and the bus; nothing is handled before."""
        fleet, comms = self._fleet, self._comms
        fleet.on_message("COMMAND_ACK", self._on_ack)
        fleet.on_gone(self._on_gone)
        fleet.on_radio(lambda source, fields: comms.rates.radio_status(source.link, fields))
        fleet.on_component(comms.rates.forget)
        fleet.on_component(comms.firmware.forget)
        fleet.paths.on_reboot.append(self._on_reboot)
        fleet.paths.on_replace.append(self._on_replace)
        fleet.paths.on_move.append(self._on_move)
        self._parts.picture.trust.on_change.append(self._on_keys)
        self._bus.subscribe(keys.PLAN.format(team="*"), self._on_plan)
        self._bus.subscribe(keys.PREVIEW.format(team="*"), self._on_preview)
        self._bus.watch(keys.ALIVE.format(principal="*"), self._on_alive)

    def attach(self, frontend: StationFrontend) -> None:
        """Answer requests by `frontend` from now on; before, nothing answers them."""
        self._frontend = frontend
        self._bus.answer(keys.REQUEST.format(principal="*"), frontend.on_question)

    def _on_ack(self, vehicle: Vehicle, fields: Fields) -> None:
        commands, now = self._comms.commands, self._parts.records.clock.now()
        awaited = (
            fields["command"] == CMD_REQUEST_MESSAGE and now - vehicle.identity.version_requested_s < IDENTITY_ANSWER_S
        )
        if awaited and not commands.pending(vehicle.id, "identify"):
            return
        if fields.get("target_system", 0) in (0, self._own):
            commands.on_ack(vehicle, fields["command"], fields["result"])
        else:
            commands.ignored["ack for another station"] += 1

    def _on_move(self, vehicle: Vehicle) -> None:
        self._comms.rates.forget(vehicle)
        self._parts.flight.executive.moved(vehicle)

    def _on_reboot(self, vehicle: Vehicle) -> None:
        self._comms.rates.forget(vehicle)
        self._comms.firmware.forget(vehicle)
        # Orders given before a reboot are void, but a stop stays until the vehicle confirms it.
        self._comms.commands.cancel(vehicle.id, keep_stops=True, housekeeping=True)
        self._parts.flight.executive.rebooted(vehicle)

    def _on_replace(self, vehicle: Vehicle) -> None:
        self._comms.rates.forget(vehicle)
        self._comms.firmware.forget(vehicle)
        self._parts.flight.executive.losses.replaced(vehicle)

    def _on_gone(self, vehicle: Vehicle) -> None:
        self._comms.firmware.forget(vehicle)
        self._comms.rates.forget(vehicle)
        self._comms.commands.cancel(vehicle.id, housekeeping=True)

    def _on_keys(self) -> None:
        """Decide anew for every source what is done with its frames, because signing keys changed."""
        for intake in self._fleet.intakes.values():
            for source in intake.sources.values():
                source.forget()

    def _on_plan(self, key: str, payload: bytes) -> None:
        team = key.split("/")[2]
        controller, dropped = self._parts.active.team_controllers.get(team), self._parts.conditions.dropped
        if controller is None:
            dropped["plan of an unknown team"] += 1
            return
        # Checked before decoding: a huge plan would hold up the tick while it is decoded.
        if problem := too_large(len(payload), len(controller.task.members) if controller.task else 0):
            dropped["plan too large"] += 1
            self._events.report(EventClass.PLANNER, f"planner {team}", f"{problem}: not taken", WARNING, every_s=10)
            return
        try:
            plan = decode(payload, TeamPlan)
        except msgspec.MsgspecError as error:
            dropped["plan not understood"] += 1
            text = f"plan not understood: {error}"
            self._events.report(EventClass.PLANNER, f"planner {team}", text, WARNING, every_s=10)
            return
        if plan.declares is not None:
            self._on_declaration(controller, plan.declares)
        for vehicle, reason in controller.take(plan):
            self._send_home(controller, vehicle, reason)

    def _on_declaration(self, controller: TeamController, info: PlannerInfo) -> None:
        """Take the new declaration of a watched planner file that was saved; for simulated vehicles only."""
        config = self._parts.config
        known = config.planners.get(info.name)
        # A LIVE station never takes code or parameters that changed after its start.
        ours = known is not None and known.file == info.file != "" and controller.team.planner == info.name
        if config.kind is RunKind.SIM and ours and info != known:
            config.planners[info.name] = info
            text = f"planner {info.name}: parameters {', '.join(param.name for param in info.params) or 'none'}"
            self._events.report(EventClass.PLANNER, f"planner {controller.team.name}", clean(text), NOTICE)

    def _send_home(self, controller: TeamController, vehicle: int, reason: str) -> None:
        """Return a vehicle because its planner asks for it, and journal it as the planner's act."""
        why_not = self._parts.flight.executive.send_home(vehicle, by=f"planner {controller.team.name}")
        text = f"vehicle {vehicle} is not sent home: {why_not}" if why_not else f"sends vehicle {vehicle} home"
        text += f" ({reason})" if reason else ""
        severity = WARNING if why_not else NOTICE
        self._events.report(EventClass.PLANNER, f"planner {controller.team.name}", text, severity, every_s=5)

    def _on_preview(self, key: str, payload: bytes) -> None:
        try:
            result = decode(payload, PreviewResult)
        except msgspec.MsgspecError:
            self._parts.conditions.dropped["preview not understood"] += 1
            return
        if self._frontend is not None:
            self._frontend.take_preview(key.split("/")[2], result)

    def _on_alive(self, key: str, present: bool) -> None:
        principal = key.rsplit("/", 1)[1]
        connected = self._parts.conditions.connected
        if present and len(connected) < MAX_CONNECTED:
            connected.setdefault(principal, self._parts.records.clock.now())
        elif not present:
            connected.pop(principal, None)
        if principal.startswith("planner-") and principal[8:] in self._parts.active.team_controllers:
            self._parts.active.team_controllers[principal[8:]].on_alive(present)
