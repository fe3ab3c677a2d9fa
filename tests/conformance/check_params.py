"""Parameters: fetched, set, refused; and what they say of failsafes."""

from collections.abc import Callable

from tests.conformance.borrow import borrow, give_back, have, read
from tests.conformance.field import Failed, Field, NotApplicable
from tests.conformance.plans import ended, finished
from tests.conformance.report import check

LEAST = 300
"""ArduCopter has some 1300, PX4 some 900."""
HARMLESS: dict[str, Callable[[float], float]] = {
    "RTL_ALT": lambda v: v + 100.0,
    "RTL_ALT_M": lambda v: v + 1.0,
    "RTL_RETURN_ALT": lambda v: v + 1.5,
    "WPNAV_RADIUS": lambda v: v + 10.5,
    "COM_DL_LOSS_T": lambda v: v + 1,
}
"""Parameters that may be changed on the ground without effect, whole ones and others."""
RANGED = ("COM_DL_LOSS_T", "GF_ACTION", "RTL_RETURN_ALT", "LAND_SPEED", "RTL_ALT")


@check("parameters: all of them", takes_s=10.0)
def parameters(field: Field, vehicle: int) -> str:
    """All parameters, by the fastest way the vehicle offers; then a second time, from what is known."""
    params = field.station.services.params
    first_s = finished(field, params.fetch_all(vehicle))
    count = len(params.table(vehicle).params)
    if count < LEAST:
        raise Failed(f"only {count} parameters")
    again_s = finished(field, params.fetch_all(vehicle))
    return f"{count} in {first_s:.2f} s, again in {again_s:.2f} s"


@check("parameters: set, echoed, read back")
def parameter_set(field: Field, vehicle: int) -> str:
    """A whole number and a real one are set, read back by name and put back."""
    reported = []
    for name, before in have(field, vehicle, list(HARMLESS)).items():
        wanted = HARMLESS[name](before)
        borrow(field, vehicle, {name: wanted})
        now = read(field, vehicle, name)
        left = give_back(field, vehicle)
        again = read(field, vehicle, name)
        if now != wanted or again != before or left:
            raise Failed(f"{name}: set to {wanted:g} it says {now:g}, put back to {before:g} it says {again:g} {left}")
        reported.append(f"{name} {before:g} -> {wanted:g} -> {before:g}")
    if not reported:
        raise NotApplicable(f"it has none of {', '.join(HARMLESS)}")
    return ", ".join(reported)


@check("parameters: an unknown name is told", takes_s=12.0)
def parameter_unknown(field: Field, vehicle: int) -> str:
    """A name that does not exist ends with a reason, read or set."""
    params = field.station.services.params
    reading = params.read(vehicle, ["NO_SUCH_PARAM"])
    took_s = field.until(lambda: reading.over, 30.0, "an answer about NO_SUCH_PARAM")
    setting = params.set(vehicle, "NO_SUCH_PARAM", 1.0)
    field.until(lambda: setting.over, 30.0, "an end of setting NO_SUCH_PARAM")
    if "NO_SUCH_PARAM" not in reading.missing or not setting.error:
        raise Failed("it has a parameter NO_SUCH_PARAM")
    return f"read: {reading.missing['NO_SUCH_PARAM']} (after {took_s:.2f} s); set: {setting.error}"


@check("parameters: a value out of range", takes_s=10.0)
def parameter_range(field: Field, vehicle: int) -> str:
    """Where the vehicle tells the range of its parameters, a value beyond is refused before it is sent."""
    params = field.station.services.params
    names = have(field, vehicle, RANGED)
    if not names:
        raise NotApplicable(f"it has none of {', '.join(RANGED)}")
    job = params.fetch_info(vehicle)
    ended(field, job)
    name = next(iter(names))
    if job.error or not params.info(vehicle):
        return _huge(field, vehicle, name, job.error)
    setting = params.set(vehicle, name, 30_000.0)
    field.until(lambda: setting.over, 20.0, f"setting {name}")
    held = read(field, vehicle, name)
    if not setting.error or held != names[name]:
        raise Failed(f"{name} = 30000: {setting.error or 'taken'}, it holds {held:g}")
    return f"{name} = 30000: {setting.error}; it holds {held:g}"


def _huge(field: Field, vehicle: int, name: str, why: str) -> str:
    """Nothing is known of ranges: at least what its type cannot hold is not sent."""
    finished(field, field.station.services.params.fetch_all(vehicle))
    table = field.station.services.params.table(vehicle).params
    small = next((n for n, param in table.items() if param.type.name == "INT8"), None)
    if small is None:
        raise NotApplicable(f"it does not tell ranges ({why or 'it has no such file'}), and no type is narrow")
    before = read(field, vehicle, small)
    setting = field.station.services.params.set(vehicle, small, 300)
    field.until(lambda: setting.over, 20.0, f"setting {small}")
    held = read(field, vehicle, small)
    if not setting.error or held != before:
        raise Failed(f"{small} = 300: {setting.error or 'taken'}, it held {before:g} and holds {held:g}")
    return f"it does not tell ranges ({why}); {small} = 300: {setting.error}; it holds {held:g}"


@check("failsafes: told in words")
def failsafes(field: Field, vehicle: int) -> str:
    """What it does when something is lost is read from its parameters, none of it "not known"."""
    service, done = field.station.services.failsafes, []
    service.ask(vehicle, lambda: done.append(True))
    took_s = field.until(lambda: bool(done), 60.0, "its failsafe parameters")
    lines = service.report(field.vehicle(vehicle))
    unknown = [f"{line.when}: {line.does}" for line in lines if "not known" in line.does]
    if unknown or not lines:
        raise Failed(f"{len(lines)} lines; {'; '.join(unknown)}")
    return f"{len(lines)} in {took_s:.2f} s: {lines[0].when}: {lines[0].does}; …"
