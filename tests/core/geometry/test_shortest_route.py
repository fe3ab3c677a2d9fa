"""Ways that stay inside."""

import math

import shapely
from hypothesis import given
from hypothesis import strategies as st

from tui_gcs.core.geometry.shortest_route import route

NOTCHED = shapely.Polygon([(0, 0), (100, 0), (100, 100), (60, 100), (60, 40), (40, 40), (40, 100), (0, 100)])
WITH_HOLE = shapely.box(0, 0, 100, 100).difference(shapely.box(30, 30, 70, 70))


def test_the_straight_way_is_taken_where_it_is_inside():
    assert route(NOTCHED, (10, 10), (90, 10)) == [(90, 10)]


def test_around_a_notch():
    way = route(NOTCHED, (20, 90), (80, 90))
    assert way[-1] == (80, 90)
    assert len(way) == 3
    assert all(y < 40 for _, y in way[:-1])


def test_no_way_at_all_is_the_straight_one():
    two = shapely.union_all([shapely.box(0, 0, 10, 10), shapely.box(50, 0, 60, 10)])
    assert route(two, (5, 5), (55, 5)) == [(55, 5)]


@given(*[st.floats(1, 99, allow_nan=False) for _ in range(4)])
def test_every_way_around_a_no_fly_zone_is_inside_and_not_much_longer_than_it_must_be(x1, y1, x2, y2):
    here, there = (x1, y1), (x2, y2)
    if not (WITH_HOLE.covers(shapely.Point(here)) and WITH_HOLE.covers(shapely.Point(there))):
        return
    line = shapely.LineString([here, *route(WITH_HOLE, here, there)]) if here != there else shapely.Point(here)
    assert WITH_HOLE.covers(line)
    assert line.length <= math.dist(here, there) + 130
