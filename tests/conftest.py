"""What all tests share.

Property tests draw the same examples in every run, so that CI does not depend on luck.

`HYPOTHESIS_PROFILE=explore pytest` draws new ones.
"""

import gc
import os
import sys
from pathlib import Path

import pytest
from hypothesis import settings

os.environ["TUI_GCS_CONFIG"] = ""  # the settings of whoever runs the tests are none of theirs

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.register_profile("explore", deadline=None, max_examples=2000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeatable"))


MAKES_WAY = 5
"""Niceness of a worker whose tests use as much of a core as they get: a third of what one at 1x may have."""
GC_THRESHOLD = 200_000
"""New objects that Python looks through for garbage within a test. By itself it does so with every 700."""
MIN_COLLECTED = 5_000
"""New objects that are worth a look for garbage when a test has ended."""
COLLECTED = pytest.StashKey[list[pytest.Item]]()
"""Every test of the collected files, also those that the run's marks leave out. Read by test_marks.py."""


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """A run of one mark alone, as `make flights`, imports only the files that have it.

    They are one in eight. Importing all of them takes several seconds of each of its processes.
    """
    only = config.option.markexpr
    if only not in ("long", "endurance", "by_keys") or not collection_path.match("test_*.py"):
        return None
    return True if f"mark.{only}" not in collection_path.read_text(encoding="utf-8") else None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Tests that run at 1x mostly wait: they come first and on one worker, so that the others fill the time.

    Those of the group "operator" have another worker: each of the two takes about six minutes of `make flights`.
    Whole missions come next: one of them takes minutes, and begun last it would be waited for alone.
    """
    config.stash[COLLECTED] = list(items)
    tests = Path(__file__).parent
    whole = [tests / "system", tests / "rehearsal"]
    items.sort(key=lambda item: (item.get_closest_marker("process") is None, item.path.parent not in whole))
    for item in items:
        if item.get_closest_marker("process") is not None and item.get_closest_marker("xdist_group") is None:
            item.add_marker(pytest.mark.xdist_group("process"))


def pytest_collectstart() -> None:
    """Nothing is garbage while tests are collected: looking for it took 1.0 of 8.5 s of CPU in each process."""
    gc.disable()


def pytest_collection_finish() -> None:
    """What was imported and collected is never garbage: looking through it again and again took a fifth of the time."""
    gc.enable()
    gc.collect()
    gc.freeze()
    gc.set_threshold(GC_THRESHOLD)
    sys.dont_write_bytecode = True  # what is imported later: some tests watch which files are written


def pytest_runtest_logfinish() -> None:
    """What a test made is garbage now, and still young: it goes without a look at anything older.

    Otherwise it is left in the oldest generation: 260 tests of screens left 1.3 million objects, and a full collection
    among later tests took seconds.
    """
    if gc.get_count()[0] > MIN_COLLECTED:
        gc.collect(0)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Those that run at 1x get a core when they need it: a worker's first other test makes way from then on."""
    if "PYTEST_XDIST_WORKER" in os.environ and item.get_closest_marker("process") is None:
        os.setpriority(os.PRIO_PROCESS, 0, max(MAKES_WAY, os.getpriority(os.PRIO_PROCESS, 0)))


@pytest.fixture(scope="session", autouse=True)
def shared_folder(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Name the folder that all processes of this run use for what takes long to make (core/rigs/designs.py)."""
    if "PYTEST_XDIST_WORKER" in os.environ:
        os.environ["TESTS_SHARED_FOLDER"] = str(tmp_path_factory.getbasetemp().parent)
