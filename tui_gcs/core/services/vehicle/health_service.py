"""Whether each vehicle could arm now, and if not, why. The rules are in `core/firmware/health.py`."""

from dataclasses import dataclass

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.firmware.health import (
    ArmingChecks,
    Concern,
    HealthProblem,
    flight_mode,
    problems,
    problems_in_flight,
)
from tui_gcs.core.fleet.fleet import Fields, VehicleRegistry
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import Freshness
from tui_gcs.core.services.payload.remote_id import RemoteIdService
from tui_gcs.core.services.vehicle.vehicle_events import VehicleEvents

GLITCH_TEXT_S = 12.0
"""How long an autopilot's text about a glitch counts: ArduPilot accepts a GPS that stays off after 10 s (measured)."""
OLD_S = 60.0
"""Older telemetry does not describe the present: the poorest set over a radio has a message every 20 s."""

__all__ = ["Health", "HealthProblem", "HealthService"]


@dataclass(frozen=True)
class Health:
    """Whether a vehicle could arm in the mode in which this station flies it."""

    ready: bool
    problems: tuple[HealthProblem, ...]
    """The problems, those that block arming first, each once."""


class HealthService:
    """Computes health on demand from what is known. It sends nothing to vehicles."""

    def __init__(self, fleet: VehicleRegistry, events: VehicleEvents, remote_id: RemoteIdService, clock: Clock) -> None:
        """Use the arming checks of `events` and the arm status of `remote_id`."""
        self._fleet = fleet
        self._events = events
        self._remote_id = remote_id
        self._clock = clock

    def in_flight(self, vehicle: Vehicle) -> tuple[tuple[Concern, HealthProblem], ...]:
        """The problems in its own telemetry that require an act while it flies."""
        now = self._clock.now()
        texts = vehicle.reasons_since(now - GLITCH_TEXT_S)
        return tuple(problems_in_flight(vehicle, _Newest(self._fleet, vehicle, now), texts))

    def of(self, vehicle: Vehicle) -> Health:
        """The present health of a vehicle."""
        now = self._clock.now()
        newest = _Newest(self._fleet, vehicle, now)
        mode = flight_mode(vehicle)
        checks = ArmingChecks(self._events.can_arm(vehicle, mode), tuple(self._events.reasons(vehicle, mode)))
        found = [*self._others(vehicle, now), *problems(vehicle, newest, checks, now)]
        blocking = [problem for problem in found if problem.blocks]
        others = [problem for problem in found if not problem.blocks]
        return Health(not blocking, tuple(dict.fromkeys([*blocking, *others])))

    def _others(self, vehicle: Vehicle, now: float) -> list[HealthProblem]:
        freshness = vehicle.freshness(now)
        found = []
        if freshness is Freshness.LOST:
            found.append(HealthProblem(f"LOST: silent for {now - vehicle.last_heard_s:.0f} s", blocks=True))
        elif freshness is Freshness.STALE:
            found.append(HealthProblem("no position is heard", blocks=True))
        if vehicle.why_not_commanded:
            found.append(HealthProblem(vehicle.why_not_commanded, blocks=True))
        if vehicle.why_not_started and not vehicle.telemetry.armed:
            found.append(HealthProblem(vehicle.why_not_started, blocks=True))
        transmitter = self._remote_id.why_not_arm(vehicle)
        if transmitter:
            found.append(HealthProblem(transmitter, blocks=True))
        return found


class _Newest:
    """The newest messages of one vehicle, as long as they are not too old."""

    def __init__(self, fleet: VehicleRegistry, vehicle: Vehicle, now: float) -> None:
        self._fleet, self._vehicle, self._now = fleet, vehicle, now

    def __call__(self, msgid: int) -> Fields | None:
        if self._vehicle.silent_s(msgid, self._now) > OLD_S:
            return None
        message = self._fleet.newest(self._vehicle, msgid)
        return message.fields if message is not None else None
