"""The operator's part of Remote ID: its id and place, and serial numbers for aircraft that lack their own.

OPEN_DRONE_ID_SYSTEM is sent once a second, OPERATOR_ID, SELF_ID and BASIC_ID every 3 s (docs/autopilots.md C11). They
go to every vehicle of the scenario's teams and to no other: another vehicle on the same link has another operator.
Nothing is sent that was not configured. ArduPilot with DID_OPTIONS 1 does not arm without SYSTEM (younger than 3 s) and
BASIC_ID; transmitters receive them through the autopilot, or on the same link.
"""

from collections.abc import Callable, Iterable
from typing import Any

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import NOTICE, WARNING
from tui_gcs.core.scenario.model import OperatorId
from tui_gcs.core.services.context import ServiceContext

# ASTM F3411: SYSTEM at least once a second, the other messages every 3 s (docs/autopilots.md C11).
SYSTEM_GAP_S, OTHERS_GAP_S = 1.0, 3.0
ODID_EPOCH_S = 1_546_300_800
"""OPEN_DRONE_ID_SYSTEM counts its seconds from 2019-01-01 00:00 UTC."""
PLACE_IS_FIXED = 2
"""MAV_ODID_OPERATOR_LOCATION_TYPE: a fixed place that was typed in, not measured."""
# The value for an unknown altitude in all messages of Remote ID (common.xml).
UNKNOWN_ALT_M = -1000.0
SERIAL_NUMBER, MULTIROTOR = 1, 2
"""MAV_ODID_ID_TYPE and MAV_ODID_UA_TYPE."""
TO_ALL_COMPONENTS: dict[str, Any] = {"target_component": 0, "id_or_mac": [0] * 20}


class OperatorIdService:
    """Sends the vehicles of the teams what the scenario (or the command line) gives of the operator."""

    def __init__(
        self, context: ServiceContext, settings: Callable[[], OperatorId | None], members: Callable[[], Iterable[int]]
    ) -> None:
        """Create the service.

        Args:
            context: The station's parts.
            settings: Returns what is to be sent now; None for nothing.
            members: Returns the ids of the vehicles that it is sent to.
        """
        self._context = context
        self._settings = settings
        self._members = members
        self._system_s: dict[int, float] = {}
        self._others_s: dict[int, float] = {}
        self._reported: OperatorId | None = None
        context.fleet.on_gone(self._forget)

    def tick(self) -> None:
        """Send the messages that are due."""
        settings = self._settings()
        if settings != self._reported:
            self._reported = settings
            self._others_s.clear()
            self._report(settings)
        if settings is None:
            return
        now = self._context.clock.now()
        for vehicle_id in self._members():
            vehicle = self._context.fleet.vehicles.get(vehicle_id)
            if vehicle is None or not self._may(vehicle):
                continue
            if settings.lat_deg is not None and now >= self._system_s.get(vehicle_id, now) - 1e-9:
                self._system_s[vehicle_id] = now + SYSTEM_GAP_S
                self._send_system(vehicle_id, settings)
            if now >= self._others_s.get(vehicle_id, now) - 1e-9:
                self._others_s[vehicle_id] = now + OTHERS_GAP_S
                self._send_others(vehicle_id, settings)

    def _may(self, vehicle: Vehicle) -> bool:
        """Whether Remote ID may be sent to a vehicle."""
        # Two vehicles that share a system id would both carry one serial number. Over a satellite link nothing is
        # repeated.
        spec = self._context.specs.get(vehicle.link)
        return (
            self._context.uplink.is_ours(vehicle)
            and not vehicle.why_not_commanded
            and not (spec is not None and spec.high_latency)
        )

    def _send_system(self, vehicle_id: int, settings: OperatorId) -> None:
        self._context.uplink.ask(
            vehicle_id,
            "OPEN_DRONE_ID_SYSTEM",
            **TO_ALL_COMPONENTS,
            operator_location_type=PLACE_IS_FIXED,
            classification_type=0,
            operator_latitude=round((settings.lat_deg or 0.0) * 1e7),
            operator_longitude=round((settings.lon_deg or 0.0) * 1e7),
            area_count=1,
            area_radius=0,
            area_ceiling=UNKNOWN_ALT_M,
            area_floor=UNKNOWN_ALT_M,
            category_eu=0,
            class_eu=0,
            operator_altitude_geo=UNKNOWN_ALT_M if settings.alt_m is None else settings.alt_m,
            timestamp=max(0, int(self._context.clock.wall()) - ODID_EPOCH_S),
        )

    def _send_others(self, vehicle_id: int, settings: OperatorId) -> None:
        uplink = self._context.uplink
        if settings.operator_id:
            fields = {"operator_id_type": 0, "operator_id": settings.operator_id}
            uplink.ask(vehicle_id, "OPEN_DRONE_ID_OPERATOR_ID", **TO_ALL_COMPONENTS, **fields)
        if settings.description:
            fields = {"description_type": 0, "description": settings.description}
            uplink.ask(vehicle_id, "OPEN_DRONE_ID_SELF_ID", **TO_ALL_COMPONENTS, **fields)
        if uas_id := settings.uas_ids.get(vehicle_id):
            serial = list(uas_id.encode("ascii").ljust(20, b"\0"))
            kind = {"id_type": SERIAL_NUMBER, "ua_type": MULTIROTOR, "uas_id": serial}
            uplink.ask(vehicle_id, "OPEN_DRONE_ID_BASIC_ID", **TO_ALL_COMPONENTS, **kind)

    def _report(self, settings: OperatorId | None) -> None:
        """Report once what is sent from now on."""
        if settings is None:
            text, severity = "Remote ID: nothing of the operator is sent any more", WARNING
        elif settings.lat_deg is None or settings.lon_deg is None:
            text = "Remote ID: NO PLACE of the operator is known: operator_deg in the scenario, or --operator-at"
            severity = WARNING
        else:
            operator_id = settings.operator_id or "(no id)"
            text = f"Remote ID: operator {operator_id} stands at {settings.lat_deg:.5f}, {settings.lon_deg:.5f}"
            severity = NOTICE
        self._context.events.report(EventClass.PROCESSING, "station", text, severity)

    def _forget(self, vehicle: Vehicle) -> None:
        self._system_s.pop(vehicle.id, None)
        self._others_s.pop(vehicle.id, None)
