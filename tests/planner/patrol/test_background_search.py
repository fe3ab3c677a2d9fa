"""Searches between two steps run on a thread of lower priority, and what they raise reaches the step."""

import os
import subprocess
import sys
import threading

import pytest

from tests.rigs.own_station import until
from tui_gcs.planner.patrol.background_search import NICE, BackgroundThread
from tui_gcs.planner.runtime import preview


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a thread has no priority of its own")
def test_a_search_gives_way_and_the_thread_of_the_steps_does_not() -> None:
    found: list[int] = []
    before = os.getpriority(os.PRIO_PROCESS, threading.get_native_id())
    search = BackgroundThread()
    search.begin(lambda: found.append(os.getpriority(os.PRIO_PROCESS, threading.get_native_id())))
    search.wait()
    assert found == [max(before, NICE)]
    assert os.getpriority(os.PRIO_PROCESS, threading.get_native_id()) == before


def test_without_the_right_to_change_priorities_it_searches_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: int) -> None:
        raise PermissionError

    monkeypatch.setattr(os, "setpriority", refused)
    done = threading.Event()
    search = BackgroundThread()
    search.begin(done.set)
    search.wait()
    assert done.is_set()


def test_an_error_of_the_search_is_raised_once_where_it_is_waited_for() -> None:
    search = BackgroundThread()
    search.begin(lambda: int("none"))
    with pytest.raises(ValueError, match="none"):
        search.wait()
    search.wait()


@pytest.mark.process
@pytest.mark.skipif(sys.platform != "linux", reason="priorities are read as Linux has them")
def test_a_preview_gives_way_to_planners_that_fly() -> None:
    command = [sys.executable, "-m", "tui_gcs.planner.runtime.preview"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL) as process:
        try:
            wanted = max(os.getpriority(os.PRIO_PROCESS, 0) + preview.NICE, preview.NICE)
            until(lambda: os.getpriority(os.PRIO_PROCESS, process.pid) >= min(wanted, 19), 20.0, "it gives way")
        finally:
            process.kill()
