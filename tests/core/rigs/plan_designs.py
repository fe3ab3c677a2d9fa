"""Any plan that may be sent, for hypothesis: places on earth, numbers as vehicles hold them."""

import math

from hypothesis import strategies as st

from tui_gcs.core.formats.content import Home
from tui_gcs.core.plans.model import JUMP, Plan, PlanItem, PlanKind, float32

LAT = st.integers(-890_000_000, 890_000_000).filter(bool)
LON = st.integers(-1_799_999_999, 1_799_999_999)
HEIGHTS = st.integers(-400_000, 8_000_000).map(lambda mm: float32(mm / 1000))
"""To the millimetre: formats write decimals."""
NUMBERS = st.floats(-1e6, 1e6, width=32) | st.just(math.nan)
PARAMS = st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS)
HOMES = st.builds(
    Home, LAT.map(lambda v: v / 1e7), LON.map(lambda v: v / 1e7), st.floats(-400, 8000).map(lambda v: round(v, 3))
)
PLACES = st.builds(
    PlanItem,
    st.sampled_from([16, 17, 18, 19, 21, 22, 31, 82, 189, 201]),
    st.sampled_from([0, 3, 10]),
    PARAMS,
    LAT,
    LON,
    HEIGHTS,
    st.booleans(),
)
ACTS = st.builds(PlanItem, st.sampled_from([20, 93, 112, 178, 206, 2000]), st.just(2), PARAMS)


@st.composite
def missions(draw: st.DrawFn) -> Plan:
    """Places, acts, and jumps to items that are there."""
    items = draw(st.lists(PLACES | ACTS, max_size=12))
    if items and draw(st.booleans()):
        target = draw(st.integers(0, len(items) - 1))
        items.append(PlanItem(JUMP, 2, (float(target), 3.0, 0.0, 0.0)))
    return Plan(PlanKind.MISSION, tuple(items))


@st.composite
def fences(draw: st.DrawFn) -> Plan:
    """Small polygons and circles, and perhaps a return point."""
    items: list[PlanItem] = []
    for _ in range(draw(st.integers(1, 3))):
        lat, lon = draw(st.integers(-800_000_000, 800_000_000)), draw(st.integers(-1_700_000_000, 1_700_000_000))
        count, size = draw(st.integers(3, 9)), draw(st.integers(2_000, 50_000))
        turns = [math.tau * i / count for i in range(count)]
        corners = [(lat + round(size * math.cos(a)), lon + round(size * math.sin(a))) for a in turns]
        kind = draw(st.sampled_from([5001, 5002]))
        items += [PlanItem(kind, 0, (float(count), 0.0, 0.0, 0.0), x, y) for x, y in corners]
        if draw(st.booleans()):
            radius_m = float32(draw(st.floats(1, 5000)))
            items.append(PlanItem(draw(st.sampled_from([5003, 5004])), 0, (radius_m, 0.0, 0.0, 0.0), lat, lon))
    return Plan(PlanKind.FENCE, tuple(items))


RALLIES = st.lists(st.builds(PlanItem, st.just(5100), st.just(3), x=LAT, y=LON, z=HEIGHTS), max_size=6).map(
    lambda items: Plan(PlanKind.RALLY, tuple(items))
)
