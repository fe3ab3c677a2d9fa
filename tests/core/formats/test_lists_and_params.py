"""Parameters and the older lists of fences and rally points: each program's dialect, out and back."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.core.rigs.plan_designs import LAT, LON, RALLIES
from tests.core.rigs.plan_peers import circle, fence, square
from tui_gcs.core.formats.content import FormatError, ParamLine
from tui_gcs.core.formats.fence_rally_lists import write_fence, write_rally
from tui_gcs.core.formats.file_types import read_file
from tui_gcs.core.formats.params import write_mavproxy, write_mission_planner, write_qgc_params
from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind, float32

QGC = """# Onboard parameters for Vehicle 3
#
# Stack: PX4 Pro
# Vehicle: Multi-Rotor
#
# Vehicle-Id Component-Id Name Value Type
3\t1\tBAT1_N_CELLS\t4\t6
3\t1\tMPC_XY_VEL_MAX\t12.000000000000000000\t9
3\t1\tSYS_AUTOSTART\t16777217\t6
"""
NAMES = st.from_regex(r"[A-Z][A-Z0-9_]{0,15}", fullmatch=True)
WHOLE = st.integers(-(2**31), 2**31 - 1)
REAL = st.floats(-1e6, 1e6, width=32)


def test_each_dialect_is_read() -> None:
    qgc = read_file(QGC.encode()).params
    assert qgc[0] == ParamLine("BAT1_N_CELLS", 4, 6, 3, 1) and qgc[1].value == 12.0
    assert qgc[2].value == 16_777_217, "a whole number that a float32 could not hold"
    planner = read_file(b"\xef\xbb\xbf#NOTE: 1/1/2026\r\nRTL_ALT,3000\r\nACRO_RP_EXPO,0.300000012\r\n").params
    assert planner == (ParamLine("RTL_ALT", 3000), ParamLine("ACRO_RP_EXPO", 0.300000012))
    assert read_file(b"SERIAL1_BAUD     0x39\n# x\nRTL_ALT          -5 # low\n").params == (
        ParamLine("SERIAL1_BAUD", 57),
        ParamLine("RTL_ALT", -5),
    )


def test_a_name_given_twice_counts_as_in_its_last_line() -> None:
    """ArduPilot and the tools that set line after line do so; the line that does not count is reported."""
    read = read_file(b"ATC_RAT_PIT_D,0.03\nRTL_ALT,30\nATC_RAT_PIT_D,0.003\nRTL_ALT,30\n")
    assert read.params == (ParamLine("ATC_RAT_PIT_D", 0.003), ParamLine("RTL_ALT", 30))
    assert read.left_out == ("line 1: ATC_RAT_PIT_D 0.03: line 3 says 0.003, the last counts",)
    assert read.notes == ("1 line repeated with the same value",)
    many = read_file("".join(f"A{i % 20} {i}\n" for i in range(40)).encode())
    assert len(many.params) == 20 and many.left_out[-1] == "and 10 more lines"


def test_defaults_of_ardupilot_are_read() -> None:
    read = read_file(b"SERVO1_FUNCTION = 78\nBATT_MONITOR=8\nDID_ENABLE 1 @READONLY\n")
    values = {line.name: line.value for line in read.params}
    assert values == {"SERVO1_FUNCTION": 78, "BATT_MONITOR": 8, "DID_ENABLE": 1}
    assert read.notes == ("@READONLY of 1 line is not kept",)


def test_an_included_file_stands_where_it_is_named(tmp_path: Path) -> None:
    (tmp_path / "board").mkdir()
    (tmp_path / "board/defaults.parm").write_text("A 1\nB 2\n")
    (tmp_path / "variant").mkdir()
    path = tmp_path / "variant/defaults.parm"
    read = read_file(b"@include ../board/defaults.parm\nB 3\n", path=path)
    assert {line.name: line.value for line in read.params} == {"A": 1, "B": 3}
    assert read.notes == ("@include ../board/defaults.parm is included (2 parameters)",) and read.left_out == ()


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("RTL_ALT 1 2 3", "none of the formats"),
        ("RTL_ALT 30\nX 1 2", "line 2: 3 fields"),
        ("RTL_ALT nan", "line 1: 'nan' is no value"),
        ("RTL_ALT 1e999", "is no value"),
        ("RTL_ALT 1_0", "is no value"),
        ("RTL_ALT " + "9" * 5000, "is no value"),
        ("RTL_ALT_OF_A_NAME_THAT_IS_LONG 1", "line 1: not a parameter's name"),
        ("@include other.parm", "line 1: @include other.parm: other files are not read here"),
        ("@define A 1", "line 1: @define A 1: not known"),
        ("A 1\nB", "line 2: 1 field instead of a name and a value"),
        ("1\t1\tA\t300\t1", "line 1: A: must be a whole number 0 to 255"),
        ("1\t1\tA\t1\t10", "type 10 is not known"),
        ("1\t1\tA\t1.5\t6", "must be a whole number"),
        ("one\t1\tA\t1\t6", "'one' is no number"),
        ("".join(f"A{i} 1\n" for i in range(8200)), "more than 8192 parameters"),
    ],
    ids=lambda text: text[:20],
)
def test_errors_name_their_line(text: str, why: str) -> None:
    with pytest.raises(FormatError, match=why):
        read_file(text.encode())


@settings(max_examples=30, deadline=None)
@given(st.dictionaries(NAMES, WHOLE | REAL, min_size=1, max_size=8))
def test_values_come_back_exactly(values: dict[str, int | float]) -> None:
    lines = tuple(ParamLine(name, value) for name, value in values.items())
    for write in (write_mission_planner, write_mavproxy):
        assert same(read_file(write(lines).data).params, lines)
    typed = tuple(ParamLine(n, v, 6 if isinstance(v, int) else 9, 3, 1) for n, v in values.items())
    assert same(read_file(write_qgc_params(typed).data).params, typed)


def same(a: tuple[ParamLine, ...], b: tuple[ParamLine, ...]) -> bool:
    """As vehicles hold them: whole numbers to the last digit, others in 32 bits."""

    whole = all(x.value == y.value for x, y in zip(a, b, strict=True) if isinstance(y.value, int))
    return whole and [(x.name, x.type, float32(x.value)) for x in a] == [(y.name, y.type, float32(y.value)) for y in b]


def test_what_a_format_cannot_hold_is_reported() -> None:
    two = (ParamLine("A", 1, 6, 3, 1), ParamLine("B", 2.0, 9, 4, 1))
    out = write_mission_planner(two)
    assert out.data == b"A,1\n" and out.left_out == ("1 parameter of other vehicles or components than 3/1",)
    untyped = write_qgc_params((ParamLine("A", 1), ParamLine("B", 2.5)))
    assert untyped.data.endswith(b"1\t1\tA\t1\t6\n1\t1\tB\t2.5\t9\n") and "2 parameters" in untyped.left_out[0]


# ---------------------------------------------------------------- fences, rally points


def test_an_old_fence_has_a_return_point_and_a_closed_polygon() -> None:
    read = read_file(b"-35.363720\t149.163651\n-35.358795 149.164734\n-35.359211 149.160767\n"
                     b"-35.368622 149.162750\n-35.358795 149.164734\n").fence  # fmt: skip
    assert read is not None and [item.command for item in read.items] == [5001, 5001, 5001, 5000]
    assert read.items[0].params[0] == 3.0 and read.items[3].x == -353_637_200
    assert read_file(write_fence(read).data).fence == read


def test_what_an_old_fence_cannot_hold_is_reported() -> None:
    out = write_fence(fence(*square(), circle(50.0), *square(command=5002)))
    assert [text.split(":")[0] for text in out.left_out] == ["exclusion circle", "exclusion polygon of 4 points"]
    assert "no return point" in out.notes[0] and len(out.data.splitlines()) == 6
    with pytest.raises(FormatError, match="has none"):
        write_fence(fence(circle(50.0)))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("47 8\n47 9\n48 9", "3 lines: a return point and three corners"),
        ("47 8\n47 9\n48 9\n48 191", "line 4: 48, 191 is no place on earth"),
        ("47 8\n47 9\n48 9\n48 8 7", "line 4: 3 fields"),
        ("47 8\n47 9\n48 nan\n48 8", "line 3: not a number"),
        ("47 8\n" * 2001, "more than 2000 points"),
        ("RALLY 47", "line 1: not 'RALLY"),
        ("RALLY 47 8 x", "line 1: not a number"),
        ("RALLY 47 8 20\n47 8", "line 2: not 'RALLY"),
    ],
    ids=lambda text: text[:20],
)
def test_errors_of_a_list_name_their_line(text: str, why: str) -> None:
    with pytest.raises(FormatError, match=why):
        read_file(text.encode())


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(LAT, LON), min_size=3, max_size=8, unique=True), st.tuples(LAT, LON), RALLIES)
def test_any_list_comes_back_as_it_was(corners: list[tuple[int, int]], back: tuple[int, int], rally_: Plan) -> None:
    vertices = [PlanItem(5001, 0, (float(len(corners)), 0.0, 0.0, 0.0), x, y) for x, y in corners]
    plan = Plan(PlanKind.FENCE, (*vertices, PlanItem(5000, 0, x=back[0], y=back[1])))
    assert read_file(write_fence(plan).data).fence == plan
    if rally_.items:
        assert read_file(write_rally(rally_).data).rally.fingerprint == rally_.fingerprint


def test_a_rally_list_of_an_aeroplane_reports_what_is_not_kept() -> None:
    read = read_file(b"RALLY 40.071553\t-105.229401\t20.000000\t40.000000\t0.000000\t0\n")
    assert read.rally == Plan(PlanKind.RALLY, (PlanItem(5100, 3, x=400_715_530, y=-1_052_294_010, z=20.0),))
    assert "break height" in read.left_out[0]
