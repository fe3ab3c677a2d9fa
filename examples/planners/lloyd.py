"""Lloyd coverage of a moving density: every vehicle flies to the centre of what is nearest to it.

Cortes, Martinez, Karatas, Bullo: Coverage control for mobile sensing networks (2004). The zone is divided among the
vehicles: each place belongs to the nearest one (Voronoi cells). A vehicle needs to know its neighbours only, so this
runs on each vehicle by itself; `instances = "per_team"` in the scenario's [[team]] flies the same file centrally.
"""

import numpy as np
import shapely

from tui_gcs.planner.api import (
    Annotation,
    Intent,
    Metric,
    Output,
    Param,
    Planner,
    area_m2,
    cell_centres_m,
    polygon_of,
)

MAX_CELLS = 800


class Lloyd(Planner):
    name = "lloyd"
    instances = "per_vehicle"
    rate_hz = 2.0
    params = (Param("cell_m", float, 5.0, 1.0, 50.0, "m", "size of the cells that the zone is divided into"),)
    metrics = (
        Metric(
            "mean_distance_m", "m", better="lower", of="mean", help="from a place to the nearest vehicle, by density"
        ),
    )

    def configure(self, task, params, rng):
        super().configure(task, params, rng)
        free = polygon_of(task.area.shape).buffer(-task.limits.geofence_margin_m - 1.0)
        for zone in task.no_fly:
            free = free.difference(polygon_of(zone.shape).buffer(task.limits.geofence_margin_m + 1.0))
        cell_m = max(params["cell_m"], (area_m2(task.zone.shape) / MAX_CELLS) ** 0.5)
        cells = cell_centres_m(task.zone.shape, cell_m)
        self.cells = cells[shapely.contains_xy(free, cells[:, 0], cells[:, 1])]
        # Vehicles fly straight to centres, which lie in the convex hull of the cells.
        if not len(self.cells) or not free.covers(shapely.MultiPoint(self.cells).convex_hull):
            raise ValueError("it flies straight lines in the zone, and here some of them may not be flown")

    def step(self, ctx):
        fleet, out = ctx.fleet, Output(annotations=[])
        rows = np.flatnonzero(fleet.active)
        if not len(rows):
            return out
        apart_m = np.hypot(*(self.cells[:, None] - fleet.position_m[rows, :2]).T)  # (vehicles, cells)
        nearest = rows[np.argmin(apart_m, axis=0)]
        density = ctx.density(self.cells) + 1e-9  # never 0 everywhere: a centre needs some weight
        own_cost_m = 0.0
        for row in np.flatnonzero(fleet.active & fleet.own):
            mine, vehicle = nearest == row, int(fleet.id[row])
            if not mine.any():
                out.intents.append(Intent(vehicle, "hold", joined=True, reason="others are nearer to everything"))
                continue
            x, y = np.average(self.cells[mine], axis=0, weights=density[mine])
            own_cost_m += float((apart_m.min(axis=0) * density)[mine].sum() / density.sum())
            out.intents.append(Intent(vehicle, "goto", position_m=(x, y, fleet.layer_m[row]), joined=True))
            out.annotations.append(Annotation("marker", ((x, y),), f"centre {vehicle}"))
        # Each instance knows the cost of its own cell. The host publishes the mean of all instances: the team's cost.
        out.metrics["mean_distance_m"] = own_cost_m * (len(self.task.members) if self.task.vehicle else 1)
        return out
