"""Tours that tests fly: each is designed once in a run of tests, whatever its processes. It takes a second of CPU.

What is asked for is the key. How tours are designed is tested in tests/planner, and how they are searched on for in
flight there and in tests/rehearsal, without this.
"""

import os
import pickle
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from tui_gcs.planner.patrol.tour_search import TourSearch, begin_search

SEARCHED = 10**9
_searches: dict[bytes, bytes] = {}


def once(*question: Any) -> TourSearch:
    """What `begin_search` answers, a copy for each who asks."""
    key = pickle.dumps(question)
    if key not in _searches:
        _searches[key] = _of_any_process(key, question)
    found: TourSearch = pickle.loads(_searches[key])
    return found


def _of_any_process(key: bytes, question: tuple[Any, ...]) -> bytes:
    """The answer, pickled: from the folder that the processes of this run share, or made and put there."""
    folder = os.environ.get("TESTS_SHARED_FOLDER")
    if folder is None:
        return pickle.dumps(begin_search(*question))
    file = Path(folder) / f"tour-{sha256(key).hexdigest()}"
    if not file.exists():
        new = file.with_suffix(f".{os.getpid()}")
        new.write_bytes(pickle.dumps(begin_search(*question)))
        new.replace(file)  # another process finds all of it or nothing
    return file.read_bytes()


def remembered(*question: Any) -> TourSearch:
    """As `once`; nothing is searched for after it."""
    return replace(once(*question), units=SEARCHED)
