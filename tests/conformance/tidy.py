"""After every check: landed, disarmed, its parameters as they were, no transfer under way. Whatever happened before."""

from tests.conformance.borrow import give_back
from tests.conformance.field import Failed, Field
from tests.conformance.pilot import Pilot
from tests.conformance.plans import ended
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.core.protocol.common import Freshness

TRIES = 2
HEARD_S = 60.0
"""So long it may need to be heard again after a reboot."""


def tidy(field: Field, vehicle: int) -> list[str]:
    """Make everything as it was; what could not be made so."""
    if vehicle not in field.station.picture.fleet.vehicles:
        return []
    v = field.vehicle(vehicle)
    field.station.comms.jobs.cancel(vehicle)
    left = []
    try:
        field.until(lambda: v.freshness(field.clock.now()) is not Freshness.LOST, HEARD_S, "it is heard again")
    except Failed as failed:
        left.append(f"LOST: {failed}")
    left += _landed(field, vehicle)
    left += give_back(field, vehicle)
    return left


def _landed(field: Field, vehicle: int) -> list[str]:
    pilot = Pilot(field, vehicle)
    v = pilot.vehicle
    why = ""
    for _ in range(TRIES):
        if not v.telemetry.armed:
            return []
        try:
            pilot.down()  # also where it seems to stand: it may be about to lift off
        except Failed as failed:
            why = str(failed)
    return [] if not v.telemetry.armed else [f"NOT LANDED: {why}"]


def empty(field: Field, vehicle: int, *kinds: PlanKind) -> None:
    """Delete stored plans.

    Raises:
        Failed: It keeps one.
    """
    for kind in kinds:
        job = field.station.services.missions.clear(vehicle, kind)
        ended(field, job, 60.0)
        if job.error:
            raise Failed(f"{kind.word} not deleted: {job.error}")
