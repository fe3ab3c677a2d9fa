"""Parameters of several vehicles side by side: groups of equal values, the search, groups of names."""

import math

from hypothesis import given
from hypothesis import strategies as st

from tui_gcs.core.protocol.services import ParamRow
from tui_gcs.feed.fleet_parameters import FleetParameters, ParameterFilter, group_of

VALUES = st.sampled_from([0, 1, 2.5, math.nan, -3])
FLEETS = st.dictionaries(st.integers(1, 9), st.dictionaries(st.sampled_from("ABCD"), VALUES), min_size=1)


def parameters_of(fleet: dict[int, dict[str, float]]) -> FleetParameters:
    """A table that knows these values."""
    known = FleetParameters()
    for vehicle, values in fleet.items():
        known.take(vehicle, [ParamRow(name, value, "real32") for name, value in values.items()], complete=True)
    return known


def same(a: float | None, b: float | None) -> bool:
    """Equal, NaN included."""
    return a == b or (a is not None and b is not None and math.isnan(a) and math.isnan(b))


@given(FLEETS)
def test_every_vehicle_stands_in_the_group_of_its_value_and_the_largest_group_comes_first(
    fleet: dict[int, dict[str, float]],
) -> None:
    table = parameters_of(fleet).table(tuple(fleet))
    assert [each.name for each in table] == sorted({name for values in fleet.values() for name in values})
    for each in table:
        for vehicle, values in fleet.items():
            assert same(each.value_of(vehicle), values.get(each.name))
            assert (vehicle in each.lacking) == (each.name not in values)
        sizes = [len(group.vehicles) for group in each.groups]
        assert sizes == sorted(sizes, reverse=True)
        held = [values[each.name] for values in fleet.values() if each.name in values]
        assert each.differs == any(not same(value, held[0]) for value in held)


def test_the_search_wants_all_words_and_puts_names_that_begin_with_them_first() -> None:
    known = FleetParameters()
    rows = [
        ParamRow("ARMING_CHECK", 1, "int8", 1, "Checks before arming, fence too"),
        ParamRow("FENCE_ENABLE", 1, "int8", 0, "Fence enable"),
    ]
    known.take(1, rows, complete=True)
    table = known.table((1,))
    assert [each.name for each in ParameterFilter("fence").matching(table)] == ["FENCE_ENABLE", "ARMING_CHECK"]
    assert [each.name for each in ParameterFilter("FENCE arming").matching(table)] == ["ARMING_CHECK"]
    assert [each.name for each in ParameterFilter(only_changed=True).matching(table)] == ["FENCE_ENABLE"]
    assert ParameterFilter(only_differing=True).matching(table) == []


def test_new_values_of_a_vehicle_replace_its_former_ones() -> None:
    known = parameters_of({1: {"A": 1}, 2: {"A": 1}})
    assert not known.table((1, 2))[0].differs
    known.take(2, [ParamRow("A", 2, "real32")], complete=False)
    assert known.table((1, 2))[0].differs
    assert not known.is_complete(2)


def test_groups_of_names() -> None:
    assert [group_of(name) for name in ("WPNAV_SPEED", "BATT2_CAPACITY", "SYSID_THISMAV", "ACRO")] == [
        "WPNAV",
        "BATT",
        "SYSID",
        "ACRO",
    ]
