"""`tui-gcs planner new NAME`: writes a small planner that flies and passes every check, as a beginning."""

import argparse
import keyword
import re
import sys
from pathlib import Path

from tui_gcs.cli.exit_codes import OK, CommandError
from tui_gcs.planner import api
from tui_gcs.planner.runtime import registry

NAME = re.compile(r"[a-z][a-z0-9_-]{0,31}")
SOURCE = '''"""NAME: vehicles circle the middle of their zone, equally spaced. Then: tui-gcs planner check FILE."""

import numpy as np

from tui_gcs.planner.api import Annotation, Intent, Output, Param, Planner, polygon_of


class CLASS(Planner):
    name = "NAME"
    params = (Param("radius_m", float, 40.0, 10.0, 80.0, "m", "radius of the circle"),)

    def configure(self, task, params, rng):  # once per task; the operator reads what a ValueError says
        super().configure(task, params, rng)
        self.middle = polygon_of(task.zone.shape).representative_point()
        self.radius_m, self.rad_s = params["radius_m"], 0.6 * task.limits.speed_m_s / params["radius_m"]
        self.circle = self.middle.buffer(self.radius_m)
        if not polygon_of(task.area.shape).buffer(-task.limits.geofence_margin_m).covers(self.circle):
            raise ValueError(f"a circle of {self.radius_m:g} m leaves the operating area")

    def step(self, ctx):  # several times a second: what each active vehicle is to do, from `ctx` alone
        fleet, rows = ctx.fleet, np.flatnonzero(ctx.fleet.active)
        away = fleet.position_m[:, :2] - self.middle.coords[0]
        ahead = np.mod(np.arctan2(away[:, 1], away[:, 0]) - self.rad_s * ctx.t_s, 2 * np.pi)
        drawing = Annotation("polygon", tuple(self.circle.exterior.coords), "NAME")
        out = Output(annotations=[drawing], metrics={"period_s": 2 * np.pi / self.rad_s})
        for k, row in enumerate(sorted(rows, key=lambda row: ahead[row])):  # by bearing: ids mean nothing
            angle = (k + 0.5) / len(rows) * 2 * np.pi + self.rad_s * (ctx.t_s + 0.5 * np.arange(7))
            unit, height = np.stack([np.cos(angle), np.sin(angle)], axis=1), float(fleet.layer_m[row])
            path = [(x, y, height) for x, y in (self.middle.coords[0] + self.radius_m * unit).tolist()]
            speed = [(-y, x, 0.0) for x, y in (self.radius_m * self.rad_s * unit).tolist()]
            vehicle, near = int(fleet.id[row]), np.hypot(*(away[row] - self.radius_m * unit[0])) < 10.0
            turn_m_s = np.hypot(*(fleet.velocity_m_s[row, :2] - speed[0][:2]))  # what it must still turn and gather
            if near and turn_m_s < self.task.limits.accel_m_s2:
                timed = {"t0_s": ctx.t_s, "dt_s": 0.5, "positions_m": tuple(path), "velocities_m_s": tuple(speed)}
                out.intents.append(Intent(vehicle, "trajectory", joined=True, **timed))
            else:
                out.intents.append(Intent(vehicle, "goto", position_m=path[0]))
        return out
'''


def run(arguments: argparse.Namespace) -> int:
    """Write the file; an existing file is not touched."""
    path = write(arguments.name, Path(arguments.dir))
    lines = len(path.read_text().splitlines())
    sys.stdout.write(
        f"{path}: {lines} lines that fly. Next:\n"
        f"  tui-gcs planner check {path}\n"
        f"  tui-gcs planner watch {path}      flies on with every version you save\n"
        f"What a planner is given and may ask for: the top of {api.__file__}\n"
    )
    return OK


def write(name: str, folder: Path) -> Path:
    """Write the new file and return its path.

    Raises `CommandError` for an impossible name, a file that exists, or a folder that does not.
    """
    stem = name.replace("-", "_")
    if not NAME.fullmatch(name):
        text = "a planner's name is lower-case letters, digits, - and _, beginning with a letter, at most 32"
        raise CommandError(f"{name!r}: {text}")
    if name in registry.names() or keyword.iskeyword(stem) or stem in sys.stdlib_module_names:
        raise CommandError(f"{name!r}: is taken (a known planner, or a word of Python): choose another")
    path = folder / f"{stem}.py"
    source = SOURCE.replace("NAME", name).replace("CLASS", stem.title().replace("_", "")).replace("FILE", path.name)
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(source)
    except FileExistsError:
        raise CommandError(f"{path}: is there already, and is not overwritten") from None
    except OSError as error:
        raise CommandError(f"{path}: cannot be written ({error.strerror})") from None
    return path
