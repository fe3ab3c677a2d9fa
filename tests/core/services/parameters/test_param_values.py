"""Values on the wire and for people; byte ranges and checksums of what is kept."""

import math
import os
import struct
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui_gcs.core.base.float32 import shown, to_float32
from tui_gcs.core.base.safe_files import SafeFolder
from tui_gcs.core.base.text import SafeText
from tui_gcs.core.firmware.parameter_transport import Encoding
from tui_gcs.core.services.parameters.param_cache import MAX_FILES, CacheKey, ParamCache
from tui_gcs.core.services.parameters.param_values import (
    Parameter,
    ParamType,
    ParamValueError,
    read_value,
    same,
    wire_value,
)

LIMITS = {ParamType.INT8: (-128, 127), ParamType.UINT16: (0, 65535), ParamType.INT32: (-(2**31), 2**31 - 1)}


@given(st.sampled_from(sorted(LIMITS)), st.integers(-(2**33), 2**33), st.sampled_from(list(Encoding)))
def test_whole_numbers_are_exact_or_refused(kind: ParamType, value: int, encoding: Encoding) -> None:
    least, most = LIMITS[kind]
    try:
        wire = wire_value(kind, value, encoding)
    except ParamValueError:
        assert not least <= value <= most or abs(value) > 1 << 22
    else:
        assert read_value(kind, struct.pack("<f", wire), encoding) == value


@pytest.mark.parametrize(
    ("kind", "least", "most"),
    [
        (ParamType.UINT8, 0, 255),
        (ParamType.INT8, -128, 127),
        (ParamType.UINT16, 0, 65_535),
        (ParamType.INT16, -32_768, 32_767),
        (ParamType.UINT32, 0, 4_294_967_295),
        (ParamType.INT32, -2_147_483_648, 2_147_483_647),
    ],
)
def test_what_does_not_fit_its_type_is_refused_and_the_last_that_fits_is_not(
    kind: ParamType, least: int, most: int
) -> None:
    for value in (least - 1, most + 1):
        with pytest.raises(ParamValueError, match=f"^must be a whole number {least} to {most}$"):
            wire_value(kind, value, Encoding.C_CAST)
    assert wire_value(kind, least, Encoding.C_CAST) == least
    if most < 1 << 24:
        assert wire_value(kind, most, Encoding.C_CAST) == most
    else:
        with pytest.raises(ParamValueError, match="24 bits"):
            wire_value(kind, most, Encoding.C_CAST)


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_reals_are_shown_as_short_as_they_are_exact(value: float) -> None:
    assert to_float32(float(shown(value))) == value
    assert wire_value(ParamType.REAL32, value, Encoding.C_CAST) == value


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.1, "0.1"),
        (to_float32(0.1), "0.1"),
        (5.0, "5"),
        (7, "7"),
        (math.nan, "NaN"),
        (-math.inf, "-inf"),
        (math.inf, "inf"),
        (999_999_936.0, "999999940"),
        (2e9, "2e+09"),
        (1e-7, "1e-07"),
    ],
)
def test_numbers_for_people(value: float, text: str) -> None:
    assert shown(value) == text


def test_what_is_held_is_compared_as_its_type_can_tell() -> None:
    assert same(to_float32(0.1), 0.1, ParamType.REAL32)
    assert not same(0.2, 0.1, ParamType.REAL32)
    assert same(7, 7.0, ParamType.INT8) and not same(127, 300, ParamType.INT8)


# ---------------------------------------------------------------- what is kept

KEY = CacheKey(12, "1.16.1", "00" * 9)
PARAMS = [
    Parameter(SafeText("WHOLE"), -7, ParamType.INT32),
    Parameter(SafeText("REAL"), to_float32(0.1), ParamType.REAL32, 0.0),
    Parameter(SafeText("ODD"), math.inf, ParamType.REAL32),
]


def test_what_was_kept_comes_back_for_the_same_checksum_only(tmp_path: Path) -> None:
    cache = ParamCache(SafeFolder(tmp_path / "cache"))
    assert cache.load(KEY, 5) is None
    cache.save(KEY, 5, PARAMS)
    assert cache.load(KEY, 5) == PARAMS
    assert cache.load(KEY, 6) is None
    assert cache.load(CacheKey(3, "1.16.1", KEY.uid), 5) is None
    assert cache.load(CacheKey(12, "1.16.2", KEY.uid), 5) is None
    assert [oct(path.stat().st_mode & 0o777) for path in (tmp_path / "cache").iterdir()] == ["0o600"]


@pytest.mark.parametrize("harm", ["cut", "flip", "empty", "link", "long"])
def test_a_broken_cache_is_none(tmp_path: Path, harm: str) -> None:
    cache = ParamCache(SafeFolder(tmp_path / "cache"))
    cache.save(KEY, 5, PARAMS)
    (path,) = (tmp_path / "cache").iterdir()
    data = path.read_bytes()
    if harm == "link":
        (tmp_path / "elsewhere").write_bytes(data)
        path.unlink()
        path.symlink_to(tmp_path / "elsewhere")
    else:
        changed = {
            "cut": data[:-1],
            "flip": data[:9] + bytes([data[9] ^ 1]) + data[10:],
            "empty": b"",
            "long": bytes(1 << 20),
        }
        path.write_bytes(changed[harm])
    assert cache.load(KEY, 5) is None
    cache.save(KEY, 5, PARAMS)
    assert cache.load(KEY, 5) == PARAMS


def test_names_of_files_never_come_from_a_vehicle(tmp_path: Path) -> None:
    evil = CacheKey(12, "../../x", "../../../etc/passwd")
    ParamCache(SafeFolder(tmp_path / "cache")).save(evil, 1, PARAMS)
    (path,) = (tmp_path / "cache").iterdir()
    assert path.name == evil.file_name and path.name.removeprefix("params-").isalnum()


def test_the_oldest_go_when_there_are_too_many(tmp_path: Path) -> None:
    cache = ParamCache(SafeFolder(tmp_path / "cache"))
    keys = [CacheKey(12, "v", f"{number:04x}") for number in range(MAX_FILES + 3)]
    for number, key in enumerate(keys):
        cache.save(key, 1, PARAMS[:1])
        os.utime(tmp_path / "cache" / key.file_name, (number, number))
    assert len(list((tmp_path / "cache").iterdir())) <= MAX_FILES
    assert cache.load(keys[-1], 1) and not cache.load(keys[0], 1)
