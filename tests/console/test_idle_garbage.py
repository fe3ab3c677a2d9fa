"""Full garbage collections wait until nobody types, but not for ever; and Python does them again afterwards."""

import gc
import weakref
from collections.abc import Iterator

import pytest

from tui_gcs.console.idle_garbage import MAX_PERIOD_S, MIN_PERIOD_S, QUIET_S, IdleGarbage


class Circle:
    """Garbage that only a collection finds."""

    def __init__(self) -> None:
        self.itself = self


@pytest.fixture
def garbage() -> Iterator[IdleGarbage]:
    """Begun at 0 s."""
    idle = IdleGarbage()
    idle.begin(0.0)
    yield idle
    idle.end()


def old_circle() -> "weakref.ref[Circle]":
    """One that has outlived the collections of young objects."""
    circle = Circle()
    gc.collect(0)
    gc.collect(1)
    return weakref.ref(circle)


def test_it_waits_for_a_pause_between_keys(garbage: IdleGarbage) -> None:
    circle = old_circle()
    garbage.note_key(MIN_PERIOD_S)
    assert not garbage.look(MIN_PERIOD_S + QUIET_S / 2)
    assert circle() is not None
    assert garbage.look(MIN_PERIOD_S + QUIET_S)
    assert circle() is None
    assert not garbage.look(MIN_PERIOD_S + 2 * QUIET_S), "not again so soon"


def test_who_never_pauses_is_interrupted_at_last(garbage: IdleGarbage) -> None:
    circle = old_circle()
    garbage.note_key(MAX_PERIOD_S - 0.1)
    assert not garbage.look(MAX_PERIOD_S - 0.1)
    garbage.note_key(MAX_PERIOD_S)
    assert garbage.look(MAX_PERIOD_S)
    assert circle() is None


def test_python_collects_by_itself_before_and_after() -> None:
    usual = gc.get_threshold()
    idle = IdleGarbage()
    idle.begin(0.0)
    assert gc.isenabled() and gc.get_threshold()[:2] == usual[:2] and gc.get_threshold()[2] > 1000 * usual[2]
    idle.end()
    assert gc.get_threshold() == usual
