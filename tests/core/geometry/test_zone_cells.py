"""The cells that count are those that a footprint can reach from where vehicles may fly; the rest is listed."""

import math

import pytest

from tui_gcs.core.geometry.idleness_grid import IdlenessGrid, PositionInterpolator
from tui_gcs.core.geometry.zone_cells import cell_size_m, permitted_region, reachable_cells
from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Role, Zone

AREA = Rectangle((300.0, 200.0), 600.0, 400.0)
FIELD = Rectangle((300.0, 200.0), 160.0, 120.0)


def closed(shape: Circle | Rectangle | Polygon, name: str = "mast") -> Zone:
    return Zone(name, Role.NO_FLY, shape)


def test_in_the_open_every_cell_counts() -> None:
    cells = reachable_cells(FIELD, AREA, (), 5.0, 15.0)
    assert (cells.count, cells.cell_m) == (64 * 48, 2.5)
    assert (cells.reachable_m2, cells.unreachable, cells.unreachable_text()) == (19_200.0, (), "")


def test_the_middle_of_a_no_fly_zone_is_listed_and_does_not_count() -> None:
    cells = reachable_cells(FIELD, AREA, (closed(Circle((300.0, 200.0), 20.0)),), 5.0, 15.0)
    # 25.5 m are kept clear, of which a footprint of 15 m, less 2 m for straying, sees the outer 13 m.
    assert 19_200.0 - cells.reachable_m2 == pytest.approx(math.pi * 12.5**2, rel=0.05)
    (part,) = cells.unreachable
    assert part.why == "in no-fly zone mast" and part.area_m2 == pytest.approx(19_200.0 - cells.reachable_m2, abs=1.0)
    assert cells.ideal_s(4, 8.0, 15.0) == pytest.approx(cells.reachable_m2 / (4 * 8 * 30))


def test_a_zone_beyond_the_edge_counts_as_far_as_it_can_be_seen() -> None:
    cells = reachable_cells(Rectangle((600.0, 200.0), 100.0, 50.0), AREA, (), 5.0, 15.0)
    assert [part.why for part in cells.unreachable] == ["beyond the edge of the operating area and its margin"]
    assert cells.centres_m()[:, 0].max() < 600.0 - 5.5 + 13.0


def test_what_a_wall_cuts_off_is_no_place_to_fly() -> None:
    wall = closed(Rectangle((280.0, 200.0), 10.0, 400.0), "wall")
    region = permitted_region(AREA, (wall,), 5.0, FIELD)
    assert region.bounds[0] > 280.0, "the larger part of the zone lies east of it"
    cells = reachable_cells(FIELD, AREA, (wall,), 5.0, 15.0)
    assert [part.why for part in cells.unreachable] == ["in no-fly zone wall", "cut off by margins and no-fly zones"]


def test_without_any_room_no_cell_counts() -> None:
    cells = reachable_cells(FIELD, FIELD, (closed(FIELD, "all"),), 5.0, 15.0)
    assert (cells.count, cells.reachable_m2, cells.bound_s(4, 8.0, 15.0)) == (0, 0.0, 0.0)
    assert IdlenessGrid(cells, 15.0).coverage == 0.0


@pytest.mark.parametrize(
    ("side_m", "footprint_m", "cell_m"),
    [(100.0, 15.0, 2.5), (100.0, 4.0, 1.0), (1000.0, 15.0, 2.5), (5000.0, 15.0, 10.0)],
)
def test_one_rule_for_the_size_of_cells(side_m: float, footprint_m: float, cell_m: float) -> None:
    assert cell_size_m(Rectangle((0.0, 0.0), side_m, side_m), footprint_m) == pytest.approx(cell_m)


def test_positions_between_pictures_are_interpolated() -> None:
    fill = PositionInterpolator()
    assert [t_s for t_s, _ in fill.take(0.0, {1: (0.0, 0.0)})] == [0.0]
    taken = list(fill.take(0.5, {1: (4.0, 0.0), 2: (9.0, 9.0)}))
    assert [round(t_s, 3) for t_s, _ in taken] == [0.1, 0.2, 0.3, 0.4, 0.5]
    assert taken[1][1].tolist() == [[1.6, 0.0]], "the second vehicle was not in the picture before"
    assert len(list(fill.take(20.0, {1: (90.0, 0.0)}))) == 1, "nobody knows where it was in so long a gap"


def test_a_cell_at_the_edge_of_a_swath_is_not_skipped_between_pictures() -> None:
    grid, fill = IdlenessGrid(Rectangle((0.0, 14.9), 1.0, 1.0), 15.0), PositionInterpolator()
    for k, x in enumerate((-6.0, -2.0, 2.0, 6.0)):
        for t_s, xy_m in fill.take(0.5 * k, {1: (x, 0.0)}):
            grid.update(t_s, xy_m)
    assert grid.coverage == 1.0, "it is in sight for 0.4 s, between the second and the third picture"


def test_cells_that_stay_unseen_count_from_the_beginning() -> None:
    grid = IdlenessGrid(Rectangle((0.0, 0.0), 500.0, 2.0), 1000.0, 2.5)
    few = IdlenessGrid(Rectangle((0.0, 0.0), 500.0, 2.0), 240.0, 2.5)
    for t_s in range(60):
        for each in (grid, few):
            each.update(float(t_s), [(0.0, 0.0)])
            if t_s == 30:
                each.begin_window(30.0, 10.0)
    assert (grid.worst_idleness_s, grid.unseen) == (1.0, 0), "seen once a second"
    assert few.unseen == 8 and few.worst_idleness_s == 49.0, "8 of 200 cells unseen for 49 s"
    assert few.p99_idleness_s == 49.0 and math.isfinite(few.average_idleness_s)
