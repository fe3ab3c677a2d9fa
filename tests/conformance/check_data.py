"""What vehicles store: plans, parameters, files, modes. On the ground."""

from collections.abc import Callable

from tests.conformance.field import Failed, Field, NotApplicable
from tests.conformance.report import check
from tui_gcs.core.firmware.plans import dialect_of
from tui_gcs.core.geo import LocalFrame
from tui_gcs.core.plan import (
    CIRCLE_IN,
    LAND,
    POLYGON_IN,
    RALLY_POINT,
    RETURN,
    TAKE_OFF,
    WAYPOINT,
    Plan,
    PlanItem,
    PlanKind,
)
from tui_gcs.core.plan_compare import compare
from tui_gcs.core.scenario import Origin
from tui_gcs.core.services.jobs import Job
from tui_gcs.core.vehicle import Vehicle

LIMIT_S = 120.0
ITEMS = 40
MISSION_FRAME = 2
FTP = 32
"""MAV_PROTOCOL_CAPABILITY_FTP."""
AUTOPILOT_VERSION = 148


def place(vehicle: Vehicle, east_m: float, north_m: float, alt_m: float, command: int, **more: object) -> PlanItem:
    """An item at a place relative to a vehicle."""
    frame = LocalFrame(Origin(vehicle.lat_deg, vehicle.lon_deg, 0.0))
    lat_deg, lon_deg = frame.to_geodetic(east_m, north_m)
    return PlanItem(command, x=round(float(lat_deg) * 1e7), y=round(float(lon_deg) * 1e7), z=alt_m, **more)


def a_mission(vehicle: Vehicle, items: int) -> Plan:
    """Take off, zigzag about the vehicle, return."""
    points = [place(vehicle, 40.0 + 2.0 * (i % 5), 3.0 * i, 15.0 + i % 4, WAYPOINT) for i in range(items - 2)]
    return Plan(PlanKind.MISSION, (place(vehicle, 0, 0, 15.0, TAKE_OFF), *points, PlanItem(RETURN, MISSION_FRAME)))


def a_fence(vehicle: Vehicle) -> Plan:
    """A square that the vehicle stands in, and a circle about it."""
    corners = ((-400, -400), (400, -400), (400, 400), (-400, 400))
    square = tuple(place(vehicle, x, y, 0.0, POLYGON_IN, params=(4.0, 0.0, 0.0, 0.0)) for x, y in corners)
    return Plan(PlanKind.FENCE, (*square, place(vehicle, 0, 0, 0.0, CIRCLE_IN, params=(600.0, 0.0, 0.0, 0.0))))


def some_rally_points(vehicle: Vehicle) -> Plan:
    """Three places near the vehicle."""
    return Plan(PlanKind.RALLY, tuple(place(vehicle, 30.0 * i, 20.0, 20.0, RALLY_POINT) for i in range(3)))


def finished(field: Field, job: Job, limit_s: float = LIMIT_S) -> float:
    """Wait for a job; how long it took.

    Raises:
        Failed: It did, or did not end.
    """
    took_s = field.until(lambda: job.over, limit_s, job.name)
    if job.error:
        raise Failed(f"{job.name}: {job.error}")
    return took_s


def _round_trip(field: Field, vehicle: int, plan: Plan) -> str:
    missions = field.station.services.missions
    up_s = finished(field, missions.upload(vehicle, plan))
    job = missions.download(vehicle, plan.kind)
    down_s = finished(field, job)
    if job.plan is None:
        raise Failed("nothing was read")
    compared = compare(plan, job.plan, dialect_of(field.vehicle(vehicle)))
    if not compared.same:
        raise Failed(f"what was read is not what was sent: {compared}")
    cleared_s = finished(field, missions.clear(vehicle, plan.kind))
    empty = missions.download(vehicle, plan.kind)
    finished(field, empty)
    if empty.plan is None or empty.plan.items:
        raise Failed("after clearing it is not empty")
    return f"{len(plan.items)} items up and compared in {up_s:.2f} s, down {down_s:.2f} s, cleared {cleared_s:.2f} s"


@check("mission: round trip")
def mission(field: Field, vehicle: int) -> str:
    """A mission of 40 items is put there, compared, read and cleared."""
    return _round_trip(field, vehicle, a_mission(field.vehicle(vehicle), ITEMS))


@check("fence: round trip")
def fence(field: Field, vehicle: int) -> str:
    """A polygon and a circle."""
    return _round_trip(field, vehicle, a_fence(field.vehicle(vehicle)))


@check("rally: round trip")
def rally(field: Field, vehicle: int) -> str:
    """Three rally points."""
    return _round_trip(field, vehicle, some_rally_points(field.vehicle(vehicle)))


@check("mission: what the vehicle rejects is told")
def rejected(field: Field, vehicle: int) -> str:
    """A command that no autopilot knows: the upload fails with a reason."""
    v = field.vehicle(vehicle)
    plan = Plan(PlanKind.MISSION, (place(v, 0, 0, 15.0, TAKE_OFF), place(v, 30, 0, 15.0, 9999), PlanItem(LAND)))
    job = field.station.services.missions.upload(vehicle, plan)
    field.until(lambda: job.over, LIMIT_S, "mission upload")
    if not job.error:
        raise Failed("a mission with command 9999 counts as uploaded")
    finished(field, field.station.services.missions.clear(vehicle, PlanKind.MISSION))
    return job.error


@check("mission: cancelled in the middle")
def cancelled(field: Field, vehicle: int) -> str:
    """A cancelled upload ends at once, and the next one is right."""
    v = field.vehicle(vehicle)
    missions, jobs = field.station.services.missions, field.station.jobs
    job = missions.upload(vehicle, a_mission(v, 200))
    field.until(lambda: job.done > 3 or job.over, 30.0, "the upload begins")
    if job.over:
        raise NotApplicable("the upload was over before it could be cancelled")
    jobs.cancel(vehicle)
    field.run(2.0)
    plan = a_mission(v, 5)
    up_s = finished(field, missions.upload(vehicle, plan))
    finished(field, missions.clear(vehicle, PlanKind.MISSION))
    return f"cancelled after {job.done} of 200 items; the next upload was right after {up_s:.2f} s"


@check("parameters: all of them")
def parameters(field: Field, vehicle: int) -> str:
    """All parameters, by the fastest way the vehicle offers; then a second time, from what is known."""
    params = field.station.services.params
    first_s = finished(field, params.fetch_all(vehicle))
    count = len(params.table(vehicle).params)
    if count < 300:
        raise Failed(f"only {count} parameters")
    again_s = finished(field, params.fetch_all(vehicle))
    return f"{count} in {first_s:.2f} s, again in {again_s:.2f} s"


@check("parameters: set, echoed, read back")
def parameter_set(field: Field, vehicle: int) -> str:
    """A whole number and a real one are set, read back by name and put back."""
    told = []
    for name, change in _harmless(field, vehicle).items():
        before = _read(field, vehicle, name)
        wanted = change(before)
        _set(field, vehicle, name, wanted)
        now = _read(field, vehicle, name)
        _set(field, vehicle, name, before)
        if now != wanted:
            raise Failed(f"{name}: set to {wanted}, it says {now}")
        told.append(f"{name} {before:g} -> {wanted:g} -> {before:g}")
    return ", ".join(told)


@check("parameters: an unknown name is told")
def parameter_unknown(field: Field, vehicle: int) -> str:
    """A name that does not exist ends with a reason."""
    reading = field.station.services.params.read(vehicle, ["NO_SUCH_PARAM"])
    took_s = field.until(lambda: reading.over, 30.0, "an answer about NO_SUCH_PARAM")
    if "NO_SUCH_PARAM" not in reading.missing:
        raise Failed("it has a parameter NO_SUCH_PARAM")
    return f"{reading.missing['NO_SUCH_PARAM']} after {took_s:.2f} s"


def _harmless(field: Field, vehicle: int) -> dict[str, Callable[[float], float]]:
    """Parameters that may be changed on the ground without effect, by what the vehicle has."""
    table = field.station.services.params.table(vehicle).params
    wishes: dict[str, Callable[[float], float]] = {
        "RTL_ALT": lambda v: v + 100.0,
        "RTL_RETURN_ALT": lambda v: v + 1.5,
        "WPNAV_RADIUS": lambda v: v + 10.5,
        "COM_DL_LOSS_T": lambda v: v + 1,
    }
    chosen = {name: change for name, change in wishes.items() if name in table}
    if not chosen:
        raise NotApplicable("none of the parameters that may be changed without harm is there")
    return chosen


def _read(field: Field, vehicle: int, name: str) -> float:
    reading = field.station.services.params.read(vehicle, [name])
    field.until(lambda: reading.over, 20.0, f"parameter {name}")
    if name not in reading.values:
        raise Failed(f"{name}: {reading.missing.get(name)}")
    return float(reading.values[name].value)


def _set(field: Field, vehicle: int, name: str, value: float) -> None:
    setting = field.station.services.params.set(vehicle, name, value)
    field.until(lambda: setting.over, 20.0, f"setting {name}")
    if setting.error:
        raise Failed(f"{name} = {value:g}: {setting.error}")


@check("files: the root is listed")
def files(field: Field, vehicle: int) -> str:
    """MAVFTP lists a directory and reads a file of it."""
    version = field.station.fleet.newest(field.vehicle(vehicle), AUTOPILOT_VERSION)
    if version is not None and not int(version.fields["capabilities"]) & FTP:
        raise NotApplicable("it has no file transfer")
    job = field.station.services.ftp.list(vehicle, "/")
    took_s = finished(field, job)
    if not job.entries:
        raise Failed("the root is empty")
    return f"{len(job.entries)} entries in {took_s:.2f} s"


@check("modes: named and listed")
def modes(field: Field, vehicle: int) -> str:
    """The vehicle's modes have names, those of a return and a landing among them."""
    v = field.vehicle(vehicle)
    service = field.station.services.modes
    service.want(v)
    field.run(5.0)
    names = [mode.name for mode in service.list(v)]
    unknown = [word for word in ("rtl", "land") if service.number(v, word) is None]
    if not names or unknown:
        raise Failed(f"{len(names)} modes; no word for {', '.join(unknown)}")
    return f"{len(names)}: {', '.join(names[:6])} …"
