"""Turns the options of `tui-gcs sim` into a specification for the simulator: which vehicles stand where."""

import argparse
import math
from typing import Any

from tui_gcs.cli.common import read_scenario, simulable
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.scenario.intruder_waves import intruder_waves
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.core.scenario.takeoff_places import AUTOPILOTS, simulated_places

MAX_ID = 250
"""The highest id of a simulated vehicle; higher ids belong to ground stations."""
SPACING_M = 12.0
"""The distance between vehicles: more than the shipped scenario's separation, which a start checks."""
MAX_SPACING_M = 1000.0
SENSOR = {
    "range": ("range_m", 1.0, 2000.0),
    "rate": ("rate_hz", 0.1, 20.0),
    "p": ("probability", 0.0, 1.0),
    "false": ("false_per_min", 0.0, 600.0),
    "sigma": ("sigma_m", 0.0, 100.0),
}
"""The keys of `--sensor`: the simulator's name for each, and its smallest and largest value."""


def spec_of(scenario: Scenario, seed: int | None = None, autopilots: str = "ardupilot") -> dict[str, Any]:
    """Return the simulator's specification of one vehicle per take-off place that a team uses."""
    ground_m = scenario.origin.ground_amsl_m
    vehicles = [_vehicle(*place, ground_m, 0.0) for place in simulated_places(scenario)]
    return {"seed": scenario.seed if seed is None else seed, "vehicles": _manned(vehicles, autopilots)}


def spec_of_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return the specification that the command line describes, with a scenario or without.

    Raises:
        CommandError: options that are impossible, alone or together; one line.
    """
    if arguments.scenario is not None:
        for name in ("count", "home", "spacing", "first"):
            if getattr(arguments, name) is not None:
                raise CommandError(f"--{name}: the scenario gives the take-off places; leave it out")
        scenario, _, _ = read_scenario(arguments.scenario)
        return spec_of_scenario(scenario, arguments)
    if arguments.intruders is not None:
        raise CommandError("--intruders come to a scenario's defended zone: name a SCENARIO.toml")
    if arguments.count is None:
        raise CommandError("name a SCENARIO.toml, or say how many vehicles: tui-gcs sim --count 8")
    spec = {"seed": arguments.seed or 0, "vehicles": _manned(_grid(arguments), arguments.autopilot or "ardupilot")}
    if arguments.sensor is not None:
        raise CommandError("--sensor finds --intruders, and they need a SCENARIO.toml")
    return spec | weather_of(arguments)


def spec_of_scenario(scenario: Scenario, arguments: argparse.Namespace) -> dict[str, Any]:
    """Return the specification of a scenario's vehicles, with the world and weather of the arguments.

    Raises `CommandError`.
    """
    spec = spec_of(simulable(scenario), arguments.seed, arguments.autopilot or "ardupilot")
    spec |= world_of(scenario, arguments.intruders, arguments.sensor, spec["seed"])
    return spec | weather_of(arguments)


def world_of(scenario: Scenario, intruders: int | None, sensor: str | None, seed: int) -> dict[str, Any]:
    """Return `--intruders` and `--sensor` as parts of a specification.

    Raises:
        CommandError: options that are impossible, alone or together; one line.
    """
    if intruders is None:
        if sensor is not None:
            raise CommandError("--sensor finds --intruders: say how many of them come, e.g. --intruders 4")
        return {}
    try:
        return {"intruders": intruder_waves(scenario, intruders, seed), "sensor": sensor_of(sensor or "")}
    except ValueError as error:
        raise CommandError(f"--intruders {intruders}: {error}") from None


def sensor_of(text: str) -> dict[str, float]:
    """Return `range=60,rate=5,p=0.9,false=0,sigma=2` (any of them) as fields of the simulator's `SensorSpec`."""
    found: dict[str, float] = {}
    for part in filter(None, text.split(",")):
        name, _, number = part.partition("=")
        values = numbers_of(number)
        if name not in SENSOR or len(values) != 1 or not SENSOR[name][1] <= values[0] <= SENSOR[name][2]:
            allowed = ", ".join(f"{n}={low:g}…{high:g}" for n, (_, low, high) in SENSOR.items())
            raise CommandError(f"--sensor {text}: {part!r} is none of {allowed}")
        found[SENSOR[name][0]] = values[0]
    return found


def _vehicle(system: int, lat_deg: float, lon_deg: float, ground_m: float, heading_deg: float) -> dict[str, Any]:
    return {
        "system_id": system,
        "lat_deg": lat_deg,
        "lon_deg": lon_deg,
        "ground_amsl_m": ground_m,
        "heading_deg": heading_deg,
    }


def _manned(vehicles: list[dict[str, Any]], autopilots: str) -> list[dict[str, Any]]:
    kinds = AUTOPILOTS[autopilots]
    return [vehicle | {"autopilot": kinds[index % len(kinds)]} for index, vehicle in enumerate(vehicles)]


def _grid(arguments: argparse.Namespace) -> list[dict[str, Any]]:
    """Return vehicles in rows from west to east, the first at home, as near to a square as their number allows."""
    first = 1 if arguments.first is None else arguments.first
    if not (arguments.count >= 1 and first >= 1 and first + arguments.count - 1 <= MAX_ID):
        raise CommandError(f"--count {arguments.count}: ids {first} and following must be within 1 to {MAX_ID}")
    spacing_m = SPACING_M if arguments.spacing is None else arguments.spacing
    if not 1.0 <= spacing_m <= MAX_SPACING_M:
        raise CommandError(f"--spacing {spacing_m:g}: must be 1 to {MAX_SPACING_M:g} m")
    origin, heading_deg = home_of(arguments.home)
    frame, columns = LocalFrame(origin), math.ceil(math.sqrt(arguments.count))
    vehicles = []
    for index in range(arguments.count):
        lat_deg, lon_deg = frame.to_geodetic(index % columns * spacing_m, index // columns * spacing_m)
        vehicles.append(_vehicle(first + index, lat_deg, lon_deg, origin.ground_amsl_m, heading_deg))
    return vehicles


def home_of(text: str | None) -> tuple[Origin, float]:
    """Return (place, heading) of LAT,LON,AMSL[,HEADING].

    None gives the shipped scenario's origin. Raises `CommandError`.
    """
    if text is None:
        return read_scenario(None)[0].origin, 0.0
    numbers = numbers_of(text)
    if len(numbers) not in (3, 4) or abs(numbers[0]) > 85.0 or abs(numbers[1]) > 180.0 or abs(numbers[2]) > 9000.0:
        raise CommandError(f"--home {text}: must be LAT,LON,AMSL[,HEADING], for example 52.0720,-0.6280,110,90")
    return Origin(*numbers[:3]), (numbers[3] if len(numbers) == 4 else 0.0) % 360.0


def numbers_of(text: str) -> list[float]:
    """Return the numbers between commas; an empty list if one of them is not a number."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        return []
    # `float` takes `nan` and `inf`, too.
    return numbers if all(math.isfinite(number) for number in numbers) else []


def weather_of(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return `--wind` and `--gps-noise` as parts of a specification. Raises `CommandError`."""
    weather: dict[str, Any] = {}
    if arguments.wind is not None:
        wind = numbers_of(arguments.wind)
        if len(wind) != 2 or math.hypot(*wind) > 25.0:
            raise CommandError(f"--wind {arguments.wind}: must be EAST,NORTH in m/s, together 25 at most, e.g. 3,-1")
        weather["wind_m_s"] = wind
    if arguments.gps_noise is not None:
        if not 0.0 <= arguments.gps_noise <= 20.0:
            raise CommandError(f"--gps-noise {arguments.gps_noise:g}: must be 0 to 20 m")
        weather["gps_noise_m"] = arguments.gps_noise
    return weather
