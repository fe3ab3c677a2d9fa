"""Share of intruders that the guardian planner meets, with its ceilings and with simpler planners beside it."""

from collections.abc import Iterator
from pathlib import Path

from tests.bench.guardian import EPISODES, GOALS, Simple, make, patrol_tour, ring_tour, waves
from tests.bench.planning.guardian_ceiling import ceilings
from tests.bench.row import Row

SIZES = tuple((n, k) for k in (1, 4, 8) for n in (4, 6, 8))
"""Numbers of vehicles and of intruders."""


def guardian(_: Path) -> Iterator[Row]:
    """The planner, the ceilings that no planner can pass, and simpler planners for comparison."""
    for n, k in SIZES:
        if (n, k) in GOALS:
            found = ceilings(make("guardian", n), n, k, EPISODES)
            met, doubt = found.met, found.doubt
        else:
            flown = waves(lambda n=n: make("guardian", n), n, k, EPISODES)
            met, doubt = flown.percent, flown.doubt
        yield Row(f"intruders met: guardian, {n} v {k} (± {doubt:.1f})", met, "%", GOALS.get((n, k)), at_least=True)
        if (n, k) in GOALS:
            yield Row(f"  ceiling, {n} v {k}: somebody could meet it when it came in sight", found.from_sight, "%")
            yield Row(f"  ceiling, {n} v {k}: all arrivals known from the start", found.all_known, "%")
    for name, tour, chases in (
        ("ring and assignment", ring_tour(), True),
        ("patrol and assignment", patrol_tour(), True),
        ("ring only", ring_tour(), False),
        ("patrol only", patrol_tour(), False),
    ):
        for n, k in ((4, 4), (4, 8)):
            found = waves(lambda t=tour, c=chases: Simple(t, c), n, k, EPISODES)
            yield Row(f"intruders met: {name}, {n} v {k} (± {found.doubt:.1f})", found.percent, "%")
