"""One condition that a flight must meet, and how its value is rounded: a failure is never rounded to a pass."""

import math

import msgspec


class ResultCheck(msgspec.Struct):
    """One condition that a flight must meet."""

    name: str
    ok: bool
    value: float | None
    limit: float | None
    why: str = ""
    """Why there is no value; of planner faults and guard vetoes: what was reported of the first one."""


def at_most(name: str, value: float | None, limit: float, why: str = "") -> ResultCheck:
    """Return the check that `value` is at most `limit`; `why` there is no value, which fails."""
    if value is None:
        return ResultCheck(name, False, None, limit, why)
    ok = value <= limit + 1e-9
    return ResultCheck(name, ok, round(value, 2) if ok else math.ceil(round(value * 100, 6)) / 100, limit)


def at_least(name: str, value: float | None, limit: float, why: str = "") -> ResultCheck:
    """Return the check that `value` is at least `limit`; `why` there is no value, which fails."""
    if value is None:
        return ResultCheck(name, False, None, limit, why)
    ok = value >= limit - 1e-9
    return ResultCheck(name, ok, round(value, 2) if ok else math.floor(round(value * 100, 6)) / 100, limit)
