"""CBBA, an auction without an auctioneer: vehicles bid for points of interest and agree by comparing what they heard.

Choi, Brunet, How: Consensus-based decentralized auctions for robust task allocation (2009). Each vehicle builds a path
of points that are worth more to it than to whoever holds them (bundle), and tells its neighbours who holds what and for
how much (consensus). Here a holder confirms its points in every step: one that falls silent loses them after EXPIRE_S,
which replaces the paper's table of 17 rules. `instances = "per_team"` flies the same file centrally.
The points are the peaks of the round's density map, worth their weights.
"""

import math
from dataclasses import dataclass, field

from tui_gcs.planner.api import Annotation, Intent, Metric, Output, Param, Planner

EXPIRE_S = 3.0


@dataclass
class Agent:
    """What one vehicle wants, and what it believes."""

    vehicle: int
    path: list = field(default_factory=list)  # points, in the order in which it will visit them
    bundle: list = field(default_factory=list)  # the same, in the order in which it bid for them
    held: dict = field(default_factory=dict)  # point -> [bid, holder, when the holder confirmed it last]
    done: set = field(default_factory=set)

    def hear(self, held, done):
        """Consensus: the newer word of one holder counts, and of two holders the higher bid."""
        self.done |= set(done)
        for point, (bid, holder, at_s) in held.items():
            mine = self.held.get(point)
            if mine is None or (at_s > mine[2] if holder == mine[1] else (bid, -holder) > (mine[0], -mine[1])):
                self.held[point] = [bid, holder, at_s]

    def bid(self, t_s, here, speed_m_s, points, depth, fade_s):
        """Bundle: let go what others hold now, and add what is worth more to this vehicle than to its holder."""
        self.held = {
            p: h for p, h in self.held.items() if p not in self.done and (t_s - h[2] < EXPIRE_S or h[1] == self.vehicle)
        }
        lost = next((k for k, p in enumerate(self.bundle) if self.held.get(p, [0, 0])[1] != self.vehicle), None)
        if lost is not None:  # later bids were made on the way from the lost point: they go, too
            for point in self.bundle[lost:]:
                if self.held.get(point, [0, 0])[1] == self.vehicle:
                    del self.held[point]
            self.bundle = self.bundle[:lost]
            self.path = [p for p in self.path if p in self.bundle]
        while len(self.bundle) < depth:
            now, best = worth(self.path, here, speed_m_s, points, fade_s), None
            for point in set(points) - set(self.bundle) - self.done:
                for k in range(len(self.path) + 1):
                    path = [*self.path[:k], point, *self.path[k:]]
                    gain = worth(path, here, speed_m_s, points, fade_s) - now
                    holder = self.held.get(point, [0.0, 0])
                    if (gain, -self.vehicle) > (holder[0], -holder[1]) and (best is None or gain > best[0]):
                        best = (gain, point, path)
            if best is None:
                break
            gain, point, self.path = best
            self.bundle.append(point)
            self.held[point] = [gain, self.vehicle, t_s]
        for point in self.bundle:
            self.held[point][2] = t_s


def worth(path, here, speed_m_s, points, fade_s):
    """Return the worth of a path: that of each point fades until it is reached."""
    total, after_s = 0.0, 0.0
    for point in path:
        place, weight = points[point]
        after_s += math.dist(here, place) / speed_m_s
        total, here = total + weight * math.exp(-after_s / fade_s), place
    return total


class Cbba(Planner):
    name = "cbba"
    instances = "per_vehicle"
    rate_hz = 2.0
    params = (
        Param("depth", int, 3, 1, 10, "", "how many points a vehicle holds at once"),
        Param("reach_m", float, 4.0, 1.0, 50.0, "m", "a point is visited from this near"),
        Param("fade_s", float, 60.0, 5.0, 3600.0, "s", "after this time a point is worth 37 % of its weight"),
    )
    metrics = (Metric("reward", "", better="higher", of="last", help="weights of the points visited, faded by time"),)

    def configure(self, task, params, rng):
        super().configure(task, params, rng)
        if not task.density:
            raise ValueError("it needs points to visit: [[round.density]] in the scenario")
        self.depth, self.reach_m, self.fade_s = params["depth"], params["reach_m"], params["fade_s"]
        self.agents, self.reward, self.begin_s = {}, 0.0, None

    def start(self, t_s, fleet):
        self.begin_s = t_s

    def step(self, ctx):
        fleet, out = ctx.fleet, Output(annotations=[])
        points = {k: (peak.loop.at(ctx.t_s)[0], peak.weight) for k, peak in enumerate(self.task.density)}
        flying = [row for row in range(len(fleet.id)) if fleet.active[row] and fleet.own[row]]
        self.agents = {int(fleet.id[row]): self.agents.get(int(fleet.id[row])) for row in flying}
        self.agents = {v: agent or Agent(v) for v, agent in self.agents.items()}
        for agent in self.agents.values():
            for message in ctx.messages:
                agent.hear(message.payload["held"], message.payload["done"])
        # One vehicle bids once a step and waits for the others' word. A central planner lets all talk until they agree.
        for _ in range(1 if self.task.vehicle else 2 * len(points)):
            for row in flying:
                self.visit(
                    ctx, self.agents[int(fleet.id[row])], tuple(fleet.position_m[row, :2]), fleet.speed_m_s[row], points
                )
            for agent in self.agents.values():
                for other in self.agents.values():
                    agent.hear(other.held, other.done)
        for row in flying:
            agent, (x, y, _) = self.agents[int(fleet.id[row])], fleet.position_m[row]
            ctx.broadcast({"held": agent.held, "done": sorted(agent.done)})
            way = [points[p][0] for p in agent.path]
            intent = Intent(agent.vehicle, "hold", joined=True, reason="no point is left for it")
            if way:
                intent = Intent(agent.vehicle, "goto", position_m=(*way[0], fleet.layer_m[row]), joined=True)
                out.annotations.append(Annotation("polyline", ((x, y), *way), f"way {agent.vehicle}"))
            out.intents.append(intent)
        # The host publishes the mean of all instances; each gives its own share times the number of vehicles.
        out.metrics["reward"] = self.reward * (len(self.task.members) if self.task.vehicle else 1)
        return out

    def visit(self, ctx, agent, here, speed_m_s, points):
        """Note a point that is reached, then bid from here."""
        for point in [p for p in agent.path if math.dist(here, points[p][0]) <= self.reach_m]:
            agent.done.add(point)
            agent.path.remove(point)
            agent.bundle.remove(point)
            self.reward += points[point][1] * math.exp(-(ctx.t_s - self.begin_s) / self.fade_s)
        agent.bid(ctx.t_s, here, float(speed_m_s), points, self.depth, self.fade_s)
