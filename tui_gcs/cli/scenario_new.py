"""`tui-gcs scenario new FILE.toml`: a small scenario that flies, to be changed on the plan screen."""

import argparse
import shlex
import sys
from pathlib import Path

from tui_gcs.cli.command_report import CommandReport, finish
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.core.base.text import clean
from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.scenario.load import ScenarioError, parse
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.core.scenario.template import MAX_ROUNDS, MAX_TEAMS, MAX_VEHICLES, new_scenario

DEMO = Origin(52.0720, -0.6280, 110.0)
NAME_CELLS = 64
USUAL_CEILING_M = 120.0
"""The greatest height above ground that most countries allow (EU open category: 120 m; FAA part 107: 400 ft)."""


def run(arguments: argparse.Namespace) -> int:
    """Write the file; an existing file is not touched."""
    path, vehicles = Path(arguments.file), arguments.vehicles
    if path.suffix.lower() != ".toml":
        raise CommandError(f"{clean(str(path), 200)}: a scenario's name ends in .toml")
    if not 1 <= vehicles <= MAX_VEHICLES:
        raise CommandError(f"--vehicles {vehicles}: must be 1 to {MAX_VEHICLES}")
    teams, rounds = arguments.teams, arguments.rounds
    if teams is not None and not 1 <= teams <= min(MAX_TEAMS, vehicles):
        raise CommandError(f"--teams {teams}: must be 1 to {min(MAX_TEAMS, vehicles)}")
    if not 1 <= rounds <= MAX_ROUNDS:
        raise CommandError(f"--rounds {rounds}: must be 1 to {MAX_ROUNDS}")
    origin = _origin(arguments.origin)
    text = new_scenario(clean(path.stem, NAME_CELLS), origin, vehicles, teams, rounds)
    try:
        scenario = parse(text, path.name)
    except ScenarioError as error:
        raise CommandError(error.problems[0]) from None
    _write(path, text)
    name = shlex.quote(str(path))
    text = f"{clean(str(path), 200)}: {_what(scenario)}"
    if not arguments.json:
        sys.stdout.write(
            f"{text}. {_where(arguments.origin, origin)}\n"
            f"  tui-gcs demo --scenario {name}     p shows the plan screen: g settings, + zone, R round, ^S saves\n"
            f"  tui-gcs check {name}\n"
            f"  tui-gcs rehearse {name}\n"
        )
    return finish(arguments, CommandReport(True, text=text, data={"file": str(path)}))


def _what(scenario: Scenario) -> str:
    """Say what the scenario holds: rounds, zones, vehicles, layers."""
    vehicles, teams, rounds = scenario.vehicle_count, len(scenario.teams), len(scenario.rounds)
    who = "vehicle 1" if vehicles == 1 else f"vehicles 1-{vehicles}"
    who += f" in {teams} teams" if teams > 1 else ""
    counted = f"{'one round' if rounds == 1 else f'{rounds} rounds'}, {'one zone' if teams == 1 else f'{teams} zones'}"
    layers_m = sorted({place.layer_m for place in scenario.places})
    heights = f"{len(layers_m)} layer{'s' * (len(layers_m) > 1)} up to {layers_m[-1]:g} m"
    if layers_m[-1] > USUAL_CEILING_M:
        heights += f" (above the {USUAL_CEILING_M:g} m of most countries: more --teams need fewer)"
    return f"{counted}, {who}, {heights}"


def _where(given: str | None, origin: Origin) -> str:
    if given is None:
        return "It lies where the demo does: set the origin (g). Next:"
    if given.count(",") == 1:
        return "The ground is taken to be at 0 m above mean sea level: set it (g). Next:"
    return f"The ground is {origin.ground_amsl_m:g} m above mean sea level. Next:"


def _origin(text: str | None) -> Origin:
    """Return the origin that was given, or that of the shipped scenario. Raises `CommandError`."""
    if text is None:
        return DEMO
    try:
        lat_deg, lon_deg, *amsl_m = (float(part) for part in text.split(","))
        (ground_amsl_m,) = amsl_m or [0.0]
    except ValueError:
        raise CommandError(
            f"--origin {clean(text, 40)}: must be LAT,LON or LAT,LON,AMSL in degrees and metres, like 52.07,-0.63,110"
        ) from None
    return Origin(lat_deg, lon_deg, ground_amsl_m)


def _write(path: Path, text: str) -> None:
    where = clean(str(path), 200)
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise CommandError(f"{where}: exists already and is left as it is; give another name") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise CommandError(f"{where}: cannot be written: {reason}") from None
