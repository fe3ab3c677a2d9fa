"""What other stations may ask for, in short: questions to `core/forward/command_rules`, and its answers."""

import math
from typing import Any

from tests.core.rigs.forward_rig import LOCAL, guard, vehicle
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.forward.command_rules import judge
from tui_gcs.core.forward.foreign_missions import ForeignCommand, ForeignMission, MissionStep
from tui_gcs.core.forward.request_checks import ForeignRequest
from tui_gcs.core.mavlink.dialect import MavlinkMessage

NAN = math.nan
ARDUCOPTER, PX4 = 3, 12
HERE_INT = 2**31 - 1
EVERYTHING = {"target_system": 1, "target_component": 1, "mission_type": 0, "seq": 1, "current": 0, "frame": 6}


def flying(autopilot: int = ARDUCOPTER) -> Vehicle:
    return vehicle(1, autopilot, (50.0, 50.0, 30.0))


def landed(autopilot: int = ARDUCOPTER) -> Vehicle:
    return vehicle(1, autopilot, (50.0, 50.0, 0.0), armed=False)


def ask(
    name: str,
    who: Vehicle,
    *others: Vehicle,
    plan: ForeignMission | None = None,
    upload: ForeignMission | None = None,
    **fields: Any,
) -> ForeignRequest:
    message = MavlinkMessage(name, 0, 252, 190, EVERYTHING | fields)
    return ForeignRequest(message, who, guard(), LOCAL, (who, *others), 0.0, plan or ForeignMission(), upload)


def plan_of(*places: tuple[float, float] | None, accepted: bool = True) -> ForeignMission:
    """A whole mission of the station that asks."""
    steps = [MissionStep(ForeignCommand(16, (0.0,) * 7, 6), place) for place in places]
    return ForeignMission((252, 190), len(steps), steps, accepted)


def upload(done: int, count: int = 10) -> ForeignMission:
    """An upload of which `done` items, that lead nowhere, have come."""
    return ForeignMission((252, 190), count, [MissionStep(ForeignCommand(20, (0.0,) * 7, 6))] * done)


def said(asked: ForeignRequest) -> str:
    """The guard's word for it, or the reason of the refusal behind "no: "."""
    ruling = judge(asked)
    assert bool(ruling.what) != bool(ruling.why_not)
    return ruling.what or f"no: {ruling.why_not}"


def long(who: Vehicle, command: int, *params: float, plan: ForeignMission | None = None) -> ForeignRequest:
    values = (*params, *[0.0] * 7)[:7]
    return ask("COMMAND_LONG", who, plan=plan, command=command, **{f"param{i}": v for i, v in enumerate(values, 1)})


def placed(who: Vehicle, command: int, x: float, y: float, z: float, *others: Vehicle, **more: Any) -> ForeignRequest:
    """A COMMAND_INT to an ENU place, height above home unless `frame` says otherwise."""
    lat, lon = LOCAL.to_geodetic(x, y)
    params = {"param1": -1.0, "param2": 1.0, "param3": 0.0, "param4": NAN}
    place = {"x": round(lat * 1e7), "y": round(lon * 1e7), "z": z}
    return ask("COMMAND_INT", who, *others, command=command, **(params | place | more))


def item(command: int, x: float, y: float, z: float, who: Vehicle | None = None, **more: Any) -> ForeignRequest:
    """A MISSION_ITEM_INT at an ENU place, height above home unless `frame` says otherwise."""
    lat, lon = LOCAL.to_geodetic(x, y)
    params = {f"param{i}": 0.0 for i in range(1, 5)}
    place = {"x": round(lat * 1e7), "y": round(lon * 1e7), "z": z}
    collected = upload(more.get("seq", 1))
    return ask("MISSION_ITEM_INT", who or flying(), upload=collected, command=command, **(params | place | more))
