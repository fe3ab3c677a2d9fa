"""The files that `tui-gcs planner new` writes; NAME, CLASS and FILE are replaced."""

PER_TEAM = '''"""NAME: vehicles circle the middle of their zone, equally spaced. Then: tui-gcs planner check FILE."""

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

PER_VEHICLE = '''"""NAME: each vehicle circles and keeps between its neighbours. Then: tui-gcs planner check FILE."""

import numpy as np

from tui_gcs.planner.api import Annotation, Intent, Output, Param, Planner, polygon_of


class CLASS(Planner):
    name = "NAME"
    instances = "per_vehicle"  # one instance on each vehicle; [communication] in the scenario says what it hears
    params = (Param("radius_m", float, 40.0, 10.0, 80.0, "m", "radius of the circle"),)

    def configure(self, task, params, rng):  # once per task; the operator reads what a ValueError says
        super().configure(task, params, rng)
        self.middle, self.radius_m = polygon_of(task.zone.shape).representative_point(), params["radius_m"]
        self.circle = self.middle.buffer(self.radius_m)
        if not polygon_of(task.area.shape).buffer(-task.limits.geofence_margin_m).covers(self.circle):
            raise ValueError(f"a circle of {self.radius_m:g} m leaves the operating area")

    def step(self, ctx):  # `ctx.fleet` holds this vehicle (`own`) and the neighbours that it hears
        fleet, out = ctx.fleet, Output(annotations=[])
        away = fleet.position_m[:, :2] - self.middle.coords[0]
        bearing, flying = np.arctan2(away[:, 0], away[:, 1]), np.flatnonzero(fleet.active)
        for row in np.flatnonzero(fleet.active & fleet.own):
            gaps = sorted(np.mod(bearing[other] - bearing[row], 2 * np.pi) for other in flying if other != row)
            ahead, behind = (gaps[0], 2 * np.pi - gaps[-1]) if gaps else (1.0, 1.0)
            speed_m_s = (0.6 + 0.3 * (ahead - behind) / max(ahead + behind, 0.01)) * fleet.speed_m_s[row]
            place, vehicle = (*self.middle.coords[0], fleet.layer_m[row]), int(fleet.id[row])
            orbit = {"position_m": place, "radius_m": self.radius_m, "speed_m_s": speed_m_s}
            out.intents.append(Intent(vehicle, "orbit", joined=True, **orbit))
            out.annotations.append(Annotation("polygon", tuple(self.circle.exterior.coords), "NAME"))
        ctx.broadcast("I am here")  # anything that msgspec can encode; False in the central form: nobody else is there
        out.metrics["messages_heard"] = float(len(ctx.messages))
        return out
'''
