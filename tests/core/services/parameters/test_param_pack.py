"""`param.pck`: ArduPilot's own file, broken ones, and anything at all."""

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.core.rigs.param_peer import INT8, INT16, INT32, REAL32, ParamServer
from tests.core.rigs.service_rig import Peer
from tui_gcs.core.services.parameters.param_pack import MAGIC, ParamPackError, parse_pack

NAMES = st.text("ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_", min_size=1, max_size=16)
VALUES = st.one_of(
    st.tuples(st.just(INT8), st.integers(-128, 127)),
    st.tuples(st.just(INT16), st.integers(-(2**15), 2**15 - 1)),
    st.tuples(st.just(INT32), st.integers(-(2**31), 2**31 - 1)),
    st.tuples(st.just(REAL32), st.floats(width=32, allow_nan=False)),
)


def packed(params: dict[str, tuple[int, float]], block: int) -> bytes:
    return ParamServer(Peer(1), params).packed(block)


@settings(max_examples=60, deadline=None)
@given(st.dictionaries(NAMES, VALUES, max_size=40), st.sampled_from([239, 110, 80]))
def test_what_was_packed_is_read_whatever_the_padding(params: dict[str, tuple[int, float]], block: int) -> None:
    pack = parse_pack(packed(params, block))
    assert {p.name: (int(p.type), p.value) for p in pack.params} == params
    assert pack.total == len(params)


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=400), st.integers(0, 65535))
def test_anything_is_read_or_refused(data: bytes, count: int) -> None:
    for raw in (data, struct.pack("<HHH", MAGIC, count, count) + data):
        try:
            pack = parse_pack(raw)
        except ParamPackError as error:
            assert str(error)
        else:
            assert all(0 < len(p.name) <= 64 for p in pack.params)


@pytest.mark.parametrize("cut", [1, 5, 100])
def test_a_file_that_is_cut_short_is_refused(cut: int) -> None:
    data = packed({f"NAME_{i}": (REAL32, float(i)) for i in range(50)}, 239)
    with pytest.raises(ParamPackError):
        parse_pack(data[:-cut])


def test_defaults_are_those_that_differ_and_else_the_value() -> None:
    header = struct.pack("<HHH", 0x671C, 2, 2)
    first = bytes([INT_TYPE | 0x10, 0x00]) + b"A" + bytes([5, 3])
    second = bytes([INT_TYPE, 0x10 | 1]) + b"BC" + bytes([7])
    a, abc = parse_pack(header + first + bytes(4) + second).params
    assert (a.name, a.value, a.default) == ("A", 5, 3)
    assert (abc.name, abc.value, abc.default) == ("ABC", 7, 7)


INT_TYPE = 1
