"""`tui-gcs sim`: the simulated vehicles of a scenario alone."""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tui_gcs.commands.common import read_scenario, simulable

if TYPE_CHECKING:
    from tui_gcs.core.scenario import Scenario


def spec_of(scenario: "Scenario", seed: int | None = None) -> dict[str, Any]:
    """What `sitl.launch` needs: one vehicle per take-off place that a team uses."""
    from tui_gcs.core.places import simulated_places

    vehicles = [
        {"system_id": system, "lat_deg": lat_deg, "lon_deg": lon_deg, "ground_amsl_m": scenario.origin.ground_amsl_m}
        for system, lat_deg, lon_deg in simulated_places(scenario)
    ]
    return {"seed": scenario.seed if seed is None else seed, "vehicles": vehicles}


def run(arguments: argparse.Namespace) -> int:
    """Run until interrupted."""
    scenario, _, _ = read_scenario(arguments.scenario)
    with tempfile.TemporaryDirectory() as folder:
        spec = Path(folder) / "spec.json"
        spec.write_text(json.dumps(spec_of(simulable(scenario)) | {"token": ""}))
        command = [sys.executable, "-m", "sitl.launch", "--spec", str(spec), "--target", arguments.target]
        command += ["--parent", str(os.getpid())]
        try:
            return subprocess.call(command)
        except KeyboardInterrupt:
            return 0
