"""The architecture page: its floors are those of the tree, its walks name code that is there."""

import ast
import importlib.util
import re
from functools import cache
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]
ARCHITECTURE = ROOT / "docs/architecture.md"
STEP = re.compile(r"^\| [^|]*\| `([\w/]+\.py)` \| `([\w.]+)` \|", re.MULTILINE)


def generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_floors", ROOT / "docs/make_floors.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@cache
def names_in(path: str) -> set[str]:
    """Classes, functions, methods (`Class.method`) and constants at the top of a file."""
    found: set[str] = set()
    for node in ast.parse((ROOT / path).read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            found.add(node.name)
        if isinstance(node, ast.ClassDef):
            found |= {
                f"{node.name}.{n.name}" for n in node.body if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef)
            }
        targets = getattr(node, "targets", [getattr(node, "target", None)])
        found |= {target.id for target in targets if isinstance(target, ast.Name)}
    return found


def test_the_floors_are_those_of_the_tree() -> None:
    floors = generator()
    _, written, _ = floors.parted(ARCHITECTURE.read_text(encoding="utf-8"))
    assert written == floors.section(), "run: python docs/make_floors.py --write"


@pytest.mark.parametrize("title", ["Walk 1:", "Walk 2:", "Where is it?"])
def test_each_step_of_a_walk_and_each_answer_is_in_the_code(title: str) -> None:
    section = re.split(r"^## ", ARCHITECTURE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    text = next(part for part in section if part.startswith(title))
    steps = STEP.findall(text)
    assert len(steps) > 10
    assert [step for step in steps if step[1] not in names_in(step[0])] == []
