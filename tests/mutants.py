"""Mutation test of the guard: every little change of its code must make one of its tests fail.

python -m tests.mutants [MODULE[.FUNCTION]]; deterministic; exits 1 if a mutant lives that is not in `EQUIVALENT`. Each
mutant runs the guard's unit tests in a process forked from this one, so that nothing is imported twice.
"""

import ast
import copy
import os
import resource
import sys
import types
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULES = ("course_samples", "motion_prediction", "lost_link_paths", "flight_region", "separation_check", "guard")
"""In the order in which they import each other."""
TESTS = (
    "test_course_samples.py",
    "test_motion_prediction.py",
    "test_lost_link_paths.py",
    "test_flight_region.py",
    "test_separation_check.py",
    "test_rules.py",
    "test_guard.py",
)
"""Those without a simulator; of a mutant's module those of the same name come first."""
PLUGINS = ("cacheprovider", "hypothesispytest", "xdist", "unraisableexception", "threadexception", "asyncio")
"""Which these tests do not need: without them, and plain assertions, a run takes a third of the time."""
MAX_CPU_S = 20
SWAPPED: dict[type, type] = {
    ast.Lt: ast.GtE,
    ast.LtE: ast.Gt,
    ast.Gt: ast.LtE,
    ast.GtE: ast.Lt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.Pow: ast.Mult,
    ast.And: ast.Or,
    ast.Or: ast.And,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
}
EDGES: dict[type, type] = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}
NAMES = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "any": "all", "all": "any"}

FILTER = "whom the boxes let through is judged exactly"
SIGN = "a quotient is negative where the product is"
ON_LINE = "an end that lies on the other straight is 0 m away from it anyway"
SLOWER = "without the short cut the same is found, slower"
EDGE = "no distance is exactly that"
SMALL = "only against dividing by nothing; a thousandth is nothing"
REST = "to reshape any negative number is the rest"
ONE = "ACCEL_Z_M_S2 is 1"
AT_LIMIT = "exactly at the limit and its tolerance either will do"
EQUIVALENT: dict[str, str] = {
    "guard.judge: True -> False": "both are as long",
    "guard._rate: batch.now - last_s < MIN_SETPOINT_GAP_S -> batch.now - last_s <= MIN_SETPOINT_GAP_S": AT_LIMIT,
    "guard._speed: most_up > CLIMB_M_S * SPEED_TOLERANCE -> most_up >= CLIMB_M_S * SPEED_TOLERANCE": AT_LIMIT,
    "guard._speed: least_up < -DESCENT_M_S * SPEED_TOLERANCE -> least_up <= -DESCENT_M_S * SPEED_TOLERANCE": AT_LIMIT,
    "guard._course: accel > allowed * ACCEL_TOLERANCE -> accel >= allowed * ACCEL_TOLERANCE": AT_LIMIT,
    "guard._course: steps.worst(steps.mismatch_m_s()) > MATCH_M_S"
    " -> steps.worst(steps.mismatch_m_s()) >= MATCH_M_S": AT_LIMIT,
    "guard._asked_region: asked > BAND_TOLERANCE_M -> asked >= BAND_TOLERANCE_M": AT_LIMIT,
    "guard._asked_region: 1 -> 2": REST,
    "guard._ways: 1 -> 2": REST,
    "guard._braking_region: 1 -> 2": "where braking now ends changes nothing of what is worse",
    "guard._braking_region: miss > BAND_TOLERANCE_M + BAND_OVERSHOOT_M"
    " -> miss >= BAND_TOLERANCE_M + BAND_OVERSHOOT_M": AT_LIMIT,
    "guard._jump: away_m > CATCH_UP_M -> away_m >= CATCH_UP_M": AT_LIMIT,
    "guard._jump: change > within_s * self._each(batch, rows, 'accel_m_s2')"
    " -> change >= within_s * self._each(batch, rows, 'accel_m_s2')": AT_LIMIT,
    "guard._jump: length_of(velocity) > BRAKES_BELOW_M_S -> length_of(velocity) >= BRAKES_BELOW_M_S": AT_LIMIT,
    "flight_region.__init__: self.free.convex_hull.area - self.free.area < SAME_M ** 2"
    " -> self.free.convex_hull.area - self.free.area <= SAME_M ** 2": EDGE,
    "flight_region.__init__: self.free.convex_hull.area - self.free.area"
    " -> self.free.convex_hull.area + self.free.area": SLOWER,
    "flight_region.__init__: SAME_M ** 2 -> SAME_M * 2": "for rounding: either is nothing",
    "flight_region.__init__: 2 -> 3": "for rounding: either is nothing",
    "flight_region.outside_m: error > 0 -> error >= 0": SLOWER,
    "flight_region._outside_m: 0.0 -> 0.001": "who is outside is farther outside",
    "course_samples.FAR_M: 1000000.0 -> 1500000.001": "anything is far",
    "course_samples._steps: 0.0 -> 0.001": "rounded down to the same sample",
    "motion_prediction.towards: 1e-09 -> 0.0010000015": SMALL,
    "motion_prediction.limit: 1e-09 -> 0.0010000015": SMALL,
    "motion_prediction._braked: 1e-09 -> 0.0010000015": SMALL,
    "motion_prediction.__init__: 2 * BRAKE_SHARE * ACCEL_Z_M_S2 -> 2 * BRAKE_SHARE / ACCEL_Z_M_S2": ONE,
    "motion_prediction._weakly: BRAKE_SHARE * ACCEL_Z_M_S2 -> BRAKE_SHARE / ACCEL_Z_M_S2": ONE,
    "motion_prediction._array: 1 -> 2": REST,
    "motion_prediction.lost_link_reach: 1e-09 -> 0.0010000015": SMALL,
    "lost_link_paths.to_height: 0.0 -> 0.001": SMALL,
    "lost_link_paths._way_home: 0.0 -> 0.001": SMALL,
    "lost_link_paths._ways: 1 -> 2": "a second moment that nobody looks at",
    "lost_link_paths._parts: begins_s - ahead_s <= from_here.age_s <= over_s"
    " -> begins_s - ahead_s < from_here.age_s <= over_s": AT_LIMIT,
    "guard._farthest_outside_m: 1 -> 2": REST,
    "guard._batch_of: 1 -> 2": REST,
    "flight_region.are_clear: shapely.length(lines) <= SAME_M -> shapely.length(lines) < SAME_M": AT_LIMIT,
    "flight_region.are_clear: 2 -> 3": "heights of lines are not looked at on the ground plan",
    "separation_check.SAME: 1e-06 -> 0.0010015": "for rounding; a thousandth of a limit is nothing",
    "separation_check.FUTURES: 3 -> 4": "a number of a future and a sample is still one of each",
    "separation_check.separation_conflicts: 3 -> 4": "a row of none that nobody looks at",
    "separation_check._pairs: 1 -> 2": "-2 is no row either; for an axis: " + FILTER,
    "separation_check._pairs: 0 -> 1": FILTER,
    "separation_check._pairs: near &= low[:, axis] < judged.high_m[:, axis, None] + reach"
    " -> near |= low[:, axis] < judged.high_m[:, axis, None] + reach": FILTER,
    "separation_check._pairs: low[:, axis] < judged.high_m[:, axis, None] + reach"
    " -> low[:, axis] <= judged.high_m[:, axis, None] + reach": FILTER,
    "separation_check._pairs: near &= high[:, axis] > judged.low_m[:, axis, None] - reach"
    " -> near |= high[:, axis] > judged.low_m[:, axis, None] - reach": FILTER,
    "separation_check._pairs: high[:, axis] > judged.low_m[:, axis, None] - reach"
    " -> high[:, axis] >= judged.low_m[:, axis, None] - reach": FILTER,
    "separation_check._pairs: near &= judged.ids[:, None] != others.ids[None, :]"
    " -> near |= judged.ids[:, None] != others.ids[None, :]": "oneself is excused: as near from the first sample on",
    "separation_check._pairs: True -> False": "both are as long",
    "separation_check._pairs: before[theirs] < mine -> before[theirs] <= mine": "equal is only oneself",
    "separation_check.is_exact: return self.short_m is self.far_m -> return None": SLOWER,
    "separation_check._may_be_close: _both(level / pairs.wide_m, upright / high_m) < 1.0"
    " -> _both(level / pairs.wide_m, upright / high_m) <= 1.0": FILTER,
    "separation_check._level_m: way[..., 0] + 1j * way[..., 1] -> way[..., 0] - 1j * way[..., 1]": "seen in a mirror",
    "separation_check._level_m: _side(a, b, c) * _side(a, b, d) -> _side(a, b, c) / _side(a, b, d)": SIGN,
    "separation_check._level_m: _side(c, d, a) * _side(c, d, b) -> _side(c, d, a) / _side(c, d, b)": SIGN,
    "separation_check._level_m: _side(a, b, c) * _side(a, b, d) < 0 -> _side(a, b, c) * _side(a, b, d) <= 0": ON_LINE,
    "separation_check._level_m: _side(c, d, a) * _side(c, d, b) < 0 -> _side(c, d, a) * _side(c, d, b) <= 0": ON_LINE,
    "separation_check._first: True -> False": "both are as long",
    "separation_check._first: apart >= hardest - SAME -> apart > hardest - SAME": EDGE,
    "separation_check._may_be_close: 1.0 -> 1.501": FILTER,
    "separation_check._to_line: 1e-12 -> 0.0010000000015": SMALL,
    "separation_check._first: apart < 1.0 -> apart <= 1.0": EDGE,
    "separation_check._first: braking.min(axis=1) < 1.0 -> braking.min(axis=1) <= 1.0": EDGE,
    "separation_check._is_no_worse: gained > BETTER -> gained >= BETTER": EDGE,
    "separation_check._is_no_worse: gained >= -SAME -> gained > -SAME": EDGE,
    "separation_check._is_no_worse: more >= -SAME -> more > -SAME": EDGE,
}
"""Mutants that no test can tell from the original, and why."""


@dataclass(frozen=True)
class Mutant:
    """One changed module."""

    module: str
    where: str
    before: str
    after: str
    tree: ast.Module

    @property
    def name(self) -> str:
        """Stable: it has no line numbers."""
        return f"{self.module}.{self.where}: {self.before} -> {self.after}"


def mutants(module: str) -> Iterator[Mutant]:
    """All mutants of one module, in the order of its lines."""
    tree = ast.parse((ROOT / "tui_gcs" / "core" / "guard" / f"{module}.py").read_text())
    places = _places(tree)
    for number, node in enumerate(_code(tree)):
        for change in range(_changes(node)):
            other = copy.deepcopy(tree)
            changed = list(_code(other))[number]
            before = ast.unparse(_shown(changed))
            _change(changed, change)
            where = places.get(number, "module")
            yield Mutant(module, where, before, ast.unparse(_shown(changed)), ast.fix_missing_locations(other))


def _shown(node: ast.AST) -> ast.AST:
    return node.value if isinstance(node, ast.Expr) else node


def _code(tree: ast.AST) -> Iterator[ast.AST]:
    """Nodes that do something: no docstrings, annotations, decorators, texts."""
    for field, value in ast.iter_fields(tree):
        if field in ("annotation", "returns", "decorator_list", "names"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and not _is_text(child):
                yield child
                yield from _code(child)


def _is_text(node: ast.AST) -> bool:
    docstring = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    return docstring or isinstance(node, ast.JoinedStr)


def _places(tree: ast.Module) -> dict[int, str]:
    """Function, or constant of the module, that each node belongs to, by its number in `_code`."""
    numbers = {id(node): number for number, node in enumerate(_code(tree))}
    places: dict[int, str] = {}
    for part in ast.walk(tree):
        if isinstance(part, ast.FunctionDef):
            name = part.name
        elif isinstance(part, ast.Assign) and part in tree.body:
            name = ast.unparse(part.targets[0])
        else:
            continue
        for node in ast.walk(part):
            if id(node) in numbers:
                places[numbers[id(node)]] = name
    return places


def _changes(node: ast.AST) -> int:
    """How many ways there are to change it."""
    match node:
        case ast.Compare(ops=[op, *_]):
            return len(node.ops) * (2 if type(op) in EDGES else 1)
        case ast.BinOp(op=op) | ast.AugAssign(op=op) | ast.BoolOp(op=op):
            return int(type(op) in SWAPPED)
        case ast.UnaryOp(op=ast.Not() | ast.USub() | ast.Invert()):
            return 1
        case ast.Constant(value=bool() | int() | float()):
            return 1
        case ast.Return(value=ast.expr() as value):
            return int(not (isinstance(value, ast.Constant) and value.value is None))
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return int(name in NAMES)
    return 0


def _change(node: ast.AST, number: int) -> None:
    match node:
        case ast.Compare(ops=ops):
            place, edge = divmod(number, 2) if type(ops[0]) in EDGES else (number, 0)
            table = EDGES if edge else SWAPPED
            ops[place] = table[type(ops[place])]()
        case ast.BinOp(op=op) | ast.AugAssign(op=op) | ast.BoolOp(op=op):
            node.op = SWAPPED[type(op)]()
        case ast.UnaryOp(op=op):
            node.op = ast.UAdd() if isinstance(op, ast.USub) else node.op
            if not isinstance(op, ast.USub):
                node.operand = ast.UnaryOp(op=type(op)(), operand=node.operand)
        case ast.Constant(value=bool() as value):
            node.value = not value
        case ast.Constant(value=value):
            node.value = value + 1 if isinstance(value, int) else value * 1.5 + 1e-3
        case ast.Return():
            node.value = ast.Constant(value=None)
        case ast.Name(id=name):
            node.id = NAMES[name]
        case ast.Attribute(attr=name):
            node.attr = NAMES[name]


def lives(mutant: Mutant) -> bool:
    """Whether the tests pass in spite of it."""
    child = os.fork()
    if child == 0:
        os._exit(_judge(mutant))
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def _judge(mutant: Mutant) -> int:
    """In the forked process: the exit code of its tests."""
    resource.setrlimit(resource.RLIMIT_CPU, (MAX_CPU_S, MAX_CPU_S))
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    try:
        for module in MODULES:
            _install(module, mutant.tree if module == mutant.module else None)
    except Exception:  # noqa: BLE001 - a module that cannot even be imported is as dead as can be
        return 1
    return _tests(mutant.module)


def _install(module: str, tree: ast.Module | None) -> None:
    """Run a module anew, changed or not, in place of the one that was imported."""
    name = f"tui_gcs.core.guard.{module}"
    path = ROOT / "tui_gcs" / "core" / "guard" / f"{module}.py"
    fresh = types.ModuleType(name)
    fresh.__file__ = str(path)
    sys.modules[name] = fresh
    exec(compile(tree or path.read_text(), str(path), "exec"), fresh.__dict__)


def _tests(first: str) -> int:
    files = [str(ROOT / "tests" / "core" / "guard" / name) for name in sorted(TESTS, key=f"test_{first}.py".__ne__)]
    plugins = [option for name in PLUGINS for option in ("-p", f"no:{name}")]
    options = ["-x", "--assert=plain", "--noconftest", "-o", "addopts=--import-mode=importlib", "-k", "not whoever"]
    return int(pytest.main([*options, *plugins, *files]))


def main(chosen: list[str]) -> int:
    """Try all mutants of the chosen modules, all by default; 1 if one lives."""
    import hypothesis.strategies  # noqa: F401 - imported once, here, and not in every child
    import shapely  # noqa: F401

    import tui_gcs.core.guard.guard  # noqa: F401

    if os.fork() == 0:
        os._exit(_tests(MODULES[0]))
    if os.waitstatus_to_exitcode(os.wait()[1]) != 0:
        print("the guard's tests fail without any mutant", file=sys.stderr)
        return 2
    total, alive = 0, []
    for module, _, part in (name.partition(".") for name in chosen or MODULES):
        for mutant in mutants(module):
            if part and mutant.where != part:
                continue
            total += 1
            if total % 50 == 0:
                print(f"{total} tried", flush=True)
            if lives(mutant):
                alive.append(mutant.name)
                reason = EQUIVALENT.get(mutant.name, "")
                print(f"lives: {mutant.name}" + (f"  ({reason})" if reason else ""), flush=True)
    unknown = [name for name in alive if name not in EQUIVALENT]
    print(
        f"{total - len(alive)} of {total} mutants killed, {len(alive) - len(unknown)} equivalent, {len(unknown)} live"
    )
    return 1 if unknown else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
