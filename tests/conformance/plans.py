"""Plans that checks put on vehicles, and how they wait for what they asked."""

from tests.conformance.field import Failed, Field
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.plans.model import (
    CIRCLE_IN,
    POLYGON_IN,
    RALLY_POINT,
    RETURN,
    TAKE_OFF,
    WAYPOINT,
    Plan,
    PlanItem,
    PlanKind,
)
from tui_gcs.core.uplink.jobs import Job

LIMIT_S = 120.0
MISSION_FRAME = 2


def place(vehicle: Vehicle, east_m: float, north_m: float, alt_m: float, command: int, **more: object) -> PlanItem:
    """An item at a place relative to a vehicle."""
    frame = LocalFrame(Origin(vehicle.telemetry.lat_deg, vehicle.telemetry.lon_deg, 0.0))
    lat_deg, lon_deg = frame.to_geodetic(east_m, north_m)
    return PlanItem(command, x=round(float(lat_deg) * 1e7), y=round(float(lon_deg) * 1e7), z=alt_m, **more)


def a_mission(vehicle: Vehicle, items: int) -> Plan:
    """Take off, zigzag about the vehicle (300 m at most), return."""
    points = [
        place(vehicle, 40.0 + 2.0 * (i % 5), 3.0 * (i % 97), 15.0 + i % 4 + 0.25 * (i // 97), WAYPOINT)
        for i in range(items - 2)
    ]
    return Plan(PlanKind.MISSION, (place(vehicle, 0, 0, 15.0, TAKE_OFF), *points, PlanItem(RETURN, MISSION_FRAME)))


def a_polygon(vehicle: Vehicle, half_m: float, corners: int = 4) -> tuple[PlanItem, ...]:
    """A square, or what is left of it, that the vehicle stands in; it is to be kept in."""
    places = ((-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m))[:corners]
    return tuple(place(vehicle, x, y, 0.0, POLYGON_IN, params=(float(corners), 0.0, 0.0, 0.0)) for x, y in places)


def a_fence(vehicle: Vehicle) -> Plan:
    """A square that the vehicle stands in, and a circle about it."""
    circle = place(vehicle, 0, 0, 0.0, CIRCLE_IN, params=(600.0, 0.0, 0.0, 0.0))
    return Plan(PlanKind.FENCE, (*a_polygon(vehicle, 400.0), circle))


def some_rally_points(vehicle: Vehicle, count: int = 3) -> Plan:
    """Places near the vehicle."""
    return Plan(PlanKind.RALLY, tuple(place(vehicle, 3.0 * i, 20.0, 20.0, RALLY_POINT) for i in range(count)))


def ended(field: Field, job: Job, limit_s: float = LIMIT_S) -> float:
    """Wait for the end of a job, good or bad, and until everybody knows of it; how long it took."""
    jobs = field.station.comms.jobs
    return field.until(lambda: job.over and jobs.running(job.vehicle) is not job, limit_s, f"{job.name}: an end")


def finished(field: Field, job: Job, limit_s: float = LIMIT_S) -> float:
    """Wait for a job that has to go well; how long it took.

    Raises:
        Failed: It did, or did not end.
    """
    took_s = ended(field, job, limit_s)
    if job.error:
        raise Failed(f"{job.name}: {job.error}")
    return took_s


def refusal(field: Field, job: Job, what: str) -> str:
    """Wait for a job that must not go well; the reason that it tells.

    Raises:
        Failed: It went well.
    """
    ended(field, job)
    if not job.error:
        raise Failed(f"{what} counts as uploaded")
    return job.error
