"""Decentralised pursuit: vehicles share what their sensors see, and each works out who goes for which target.

Every instance assigns all vehicles that it knows to all targets that it knows, by the time to meet them, and flies its
own part. Instances that know the same come to the same assignment without a word about it; where they do not, two may
fly to one target until they hear each other. `instances = "per_team"` flies the same file centrally.
"""

import numpy as np
import shapely
from shapely.ops import nearest_points

from tui_gcs.planner.api import Annotation, Intent, Metric, Output, Param, Planner, area_m2, polygon_of

FORGET_S = 4.0
SHARED = 8  # targets in a message: a radio carries little


class Pursuit(Planner):
    name = "pursuit"
    instances = "per_vehicle"
    judged_by = "intruders"
    params = (Param("ring_share", float, 1.2, 0.2, 3.0, "", "radius of the ring where vehicles wait, of the zone's"),)
    metrics = (Metric("targets_known", "", better="higher", of="mean", help="mean of all instances"),)

    def configure(self, task, params, rng):
        super().configure(task, params, rng)
        # Goals move while vehicles fly to them at full speed: one that turns away must still come to rest inside.
        keep_m = task.limits.geofence_margin_m + task.limits.speed_m_s**2 / task.limits.accel_m_s2
        self.free = polygon_of(task.area.shape).buffer(-keep_m)
        for zone in task.no_fly:
            self.free = self.free.difference(polygon_of(zone.shape).buffer(keep_m))
        if self.free.is_empty:
            raise ValueError("there is no room to brake inside the operating area")
        self.middle = np.array(polygon_of(task.zone.shape).centroid.coords[0])
        self.radius_m = params["ring_share"] * (area_m2(task.zone.shape) / np.pi) ** 0.5
        self.known = {}  # target -> [time, x, y, east m/s, north m/s]

    def step(self, ctx):
        self.learn(ctx)
        fleet, out = ctx.fleet, Output(annotations=[], metrics={"targets_known": float(len(self.known))})
        rows, goal = np.flatnonzero(fleet.active), {}
        targets = np.array(
            [(x + u * (ctx.t_s - t), y + v * (ctx.t_s - t), u, v) for t, x, y, u, v in self.known.values()]
        )
        if len(rows) and len(targets):
            goal = self.assigned(fleet.position_m[rows, :2], fleet.speed_m_s[rows], targets, rows)
        waiting = [row for row in rows if row not in goal]
        for row in np.flatnonzero(fleet.active & fleet.own):
            chases, vehicle = row in goal, int(fleet.id[row])
            x, y = self.flyable(goal[row] if chases else self.on_ring(fleet.position_m[:, :2], row, waiting))
            out.intents.append(Intent(vehicle, "goto", position_m=(x, y, fleet.layer_m[row]), joined=True))
            if chases:
                out.annotations.append(Annotation("marker", ((x, y),), f"{vehicle} meets"))
        return out

    def learn(self, ctx):
        """Take what the own sensors and the neighbours see, and tell the neighbours what the own sensors see."""
        tracks, seen = ctx.tracks, {}
        for k in np.flatnonzero(tracks.confirmed):
            seen[int(tracks.id[k])] = [
                ctx.t_s,
                *tracks.position_m[k, :2].tolist(),
                *tracks.velocity_m_s[k, :2].tolist(),
            ]
        for message in ctx.messages:
            for target, state in message.payload.items():
                if state[0] > self.known.get(target, [-np.inf])[0]:
                    self.known[target] = state
        self.known.update(seen)
        self.known = {target: s for target, s in sorted(self.known.items()) if ctx.t_s - s[0] < FORGET_S}
        if seen:
            ctx.broadcast(dict(list(seen.items())[:SHARED]))

    def assigned(self, places, speeds, targets, rows):
        """Return where each vehicle that goes for a target meets it: the pair that meets first is fixed first."""
        after_s = np.array(
            [[meeting_s(place, speed, t) for t in targets] for place, speed in zip(places, 0.8 * speeds)]
        )
        goal = {}
        for _ in range(min(after_s.shape)):
            i, k = np.unravel_index(np.argmin(after_s), after_s.shape)
            goal[rows[i]] = targets[k, :2] + targets[k, 2:] * after_s[i, k]
            after_s[i, :], after_s[:, k] = np.inf, np.inf
        return goal

    def on_ring(self, places, row, waiting):
        """Return a place on the ring, halfway between those who wait to the left and to the right."""
        bearing = np.arctan2(*(places - self.middle).T)
        others = sorted(np.mod(bearing[other] - bearing[row], 2 * np.pi) for other in waiting if other != row)
        turn = (others[0] + others[-1] - 2 * np.pi) / 2 if others else 0.0
        angle = bearing[row] + np.clip(turn, -0.5, 0.5)
        return self.middle + self.radius_m * np.array([np.sin(angle), np.cos(angle)])

    def flyable(self, place):
        """Return the nearest place that may be flown."""
        return nearest_points(self.free, shapely.Point(place))[0].coords[0]


def meeting_s(place, speed_m_s, target):
    """Return after how long a vehicle can be where the target is then; a minute if it never can."""
    way, velocity = target[:2] - place, target[2:]
    a, b, c = velocity @ velocity - speed_m_s**2, 2 * way @ velocity, way @ way
    roots = np.roots([a, b, c]) if abs(a) > 1e-9 else np.array([-c / b if b else np.inf])
    times = [root.real for root in np.atleast_1d(roots) if abs(root.imag) < 1e-9 and root.real >= 0.0]
    return min([*times, 60.0])
