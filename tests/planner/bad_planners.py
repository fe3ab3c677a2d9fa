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
    """A planner that flies everybody to the middle of things, with what a test puts in."""
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
PARAM = source(params="Param('gain', float, 1.0, 0.0, 5.0), ", after="1 / self.gain")
REMEMBERS = source(
    body="shift = 0.1 * self.count",
    after="self.count += 1",
    extra="""version = '1'
    def snapshot(self): return str(self.count).encode()
    def restore(self, data): self.count = int(data)""",
)
