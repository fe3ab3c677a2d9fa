"""Small planners that are wrong in one way each, as text of files."""

HEAD = '''"""A planner of a test."""
import numpy as np
from tui_gcs.planner.api import Intent, Output, Param, Planner
{imports}

class Mine(Planner):
    name = "mine"
    params = ({params})
    {extra}

    def configure(self, task, params, rng):
        super().configure(task, params, rng)
        self.gain = params.get("gain", 1.0)
        self.count = 0
        self.kept = []

    def step(self, ctx):
        fleet = ctx.fleet
        out = Output()
        rows = np.flatnonzero(fleet.active)
        for k, i in enumerate(rows):
            x, y, z = fleet.position_m[i]
            vehicle, shift = int(fleet.id[i]), 0.0
            {body}
            out.intents.append(Intent(vehicle, "goto", position_m=(200.0 + shift, 150.0 + y / 9, fleet.layer_m[i])))
        {after}
        return out
'''


def source(
    body: str = "pass", after: str = "pass", imports: str = "", params: str = "", extra: str = "version = '1'"
) -> str:
    """A planner that flies all vehicles to the middle of things, with what a test puts in."""
    return HEAD.format(body=body, after=after, imports=imports, params=params, extra=extra)


GOOD = source()
BY_CHANCE = source(imports="import random", body="shift = random.random()")
BY_SET_ORDER = source(body="shift = sum('abcdefgh'.index(c) / 8**j for j, c in enumerate({*'abcdefgh'}))")
BY_TIME = source(imports="import time", body="shift = time.perf_counter() % 7")
BY_ID = source(body="shift = 9.0 * vehicle")
BY_ROW = source(body="shift = 9.0 * k")
FORGETFUL = source(after="self.count += 1", body="shift = 0.1 * self.count")
SLOW = source(after="__import__('time').sleep(0.15)")
LEAKING = source(after="self.kept.append(fleet.position_m.copy())")
KEEPS_A_TRAIL = source(after="self.kept = [*self.kept, fleet.position_m.copy()][-600:]")
"""Its trail is full after 600 steps, later than a quick check of memory ends."""
NAN = source(body="shift = fleet.velocity_m_s[i, 0]")
ALONE = source(after="1 / (len(rows) - 1)")
LOSES = source(after="assert len(rows) >= self.count, 'somebody is missing'; self.count = len(rows)")
DEAF = source(after="out.intents += [Intent(int(v), 'hold') for v in fleet.id[~fleet.active]]")
OUTSIDE = source(body="shift = 500.0")
FAST = source(after="out.intents = [Intent(int(v), 'velocity', velocity_m_s=(20.0, 0.0, 0.0)) for v in fleet.id[rows]]")
RAISES = source(after="{}['no such key']")
HANGS = source(after="\n        while self.gain: pass")
EXITS = source(after="__import__('os')._exit(3)")
CRASHES = source(after="__import__('ctypes').string_at(0)")
SEES = source(after="out.intents += [Intent(1, 'chase') for _ in ctx.tracks.id]")
CHASES = source(body="shift = 9.0 * len(ctx.tracks.id) * (self.count > 60)", after="self.count += 1")
FOLLOWS = source(  # what is nearest, wherever it goes
    after="""
        for k, i in enumerate(rows):
            ways = [place[:2] - fleet.position_m[i, :2] for place in ctx.tracks.position_m]
            if ways:
                east, north = np.clip(min(ways, key=lambda way: np.hypot(*way)), -5.5, 5.5)
                out.intents[k] = Intent(int(fleet.id[i]), "velocity", velocity_m_s=(east, north, 0.0), valid_s=0.4)"""
)
FLIES_OUT = source(  # to its zone, wherever that is
    after="""
        x, y = self.task.zone.shape.centre_m if hasattr(self.task.zone.shape, 'centre_m') else (200.0, 200.0)
        for k, i in enumerate(rows):
            east, north = np.clip((x - fleet.position_m[i, 0], y - fleet.position_m[i, 1]), -5.5, 5.5)
            out.intents[k] = Intent(int(fleet.id[i]), "velocity", velocity_m_s=(east, north, 0.0), valid_s=0.4)"""
)
PURSUES = source(
    body="x, y = ctx.tracks.position_m[-1, :2] if len(ctx.tracks.id) else (300, 9); shift, y = x-200, (y-150)*9"
)
PARAM = source(params="Param('gain', float, 1.0, 0.0, 5.0), ", after="1 / self.gain")
REMEMBERS = source(
    body="shift = 0.1 * self.count",
    after="self.count += 1",
    extra="""version = '1'
    def snapshot(self): return str(self.count).encode()
    def restore(self, data): self.count = int(data)""",
)

ROUNDS = source(
    body="shift = self.count",
    after="self.count += 0.1",
    extra="""version = '1'
    def snapshot(self): return np.float32(self.count).tobytes()
    def restore(self, data): self.count = float(np.frombuffer(data, np.float32)[0])""",
)

# Each of these breaks one promise, and keeps all others: what it does wrong is done where only one check looks.
SOMETIMES_BY_CHANCE = source(imports="import random", body="shift = random.random() * (120.0 < ctx.t_s < 124.0)")
NEEDS_A_TEAM = source(after="1 / len(self.task.members)")
FOR_FEW = source(after="assert len(rows) <= 8, 'too many'")
NEEDS_SOMEBODY = source(
    after="assert len(rows) or not len(fleet.id) or len(ctx.tracks.id) or ctx.points.name, 'nobody is left'"
)
KNOWS_NO_OTHERS = source(
    after="self.kept = self.kept or fleet.id[rows].tolist(); assert {*fleet.id[rows]} <= {*self.kept}, 'who is that'"
)
WANTS_NEWS = source(after="assert not (fleet.age_s > 30.0).any(), 'too old'")
ALWAYS_ON_TIME = source(
    after="assert ctx.t_s - self.before < 30.0; self.before = ctx.t_s", extra="before = float('inf')"
)
SLOW_WITH_EIGHT = source(after="__import__('time').sleep(0.051 * (len(rows) in (7, 8)))", extra="rate_hz = 20.0")
GOES_TO_THE_ZONE = source(body="shift = getattr(self.task.zone.shape, 'centre_m', (250.0, 0.0))[0] - 250.0")
SURE_OF_TARGETS = source(after="assert ctx.tracks.confirmed.all(), 'what is that'")
NO_LOW_GAIN = source(params="Param('gain', float, 1.0, 0.0, 5.0), ", after="1 / self.gain")
BOASTS = source(extra="version = 2")

# Only vehicles that fly show what is wrong with these.
FLIES = "out.intents = [Intent(int(v), {}) for v in fleet.id[rows]]"
DRIFTS_AWAY = source(after=FLIES.format("'velocity', velocity_m_s=(7.5, 0.0, 0.0), valid_s=2.0"))
ALL_IN_ONE_PLACE = source(after=FLIES.format("'goto', position_m=(300.0, 200.0, 40.0)"))
