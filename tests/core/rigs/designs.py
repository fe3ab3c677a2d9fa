"""Tours that tests fly: each is designed once per process. Designing one takes a second of CPU.

What is asked for is the key. How tours are designed is tested in tests/planner, and how they are searched on for in
flight there and in tests/rehearsal, without this.
"""

import pickle
from dataclasses import replace
from typing import Any

from tui_gcs.planner.patrol.tour_search import TourSearch, begin_search

SEARCHED = 10**9
_searches: dict[bytes, bytes] = {}


def once(*question: Any) -> TourSearch:
    """What `begin_search` answers, a copy for each who asks."""
    key = pickle.dumps(question)
    if key not in _searches:
        _searches[key] = pickle.dumps(begin_search(*question))
    found: TourSearch = pickle.loads(_searches[key])
    return found


def remembered(*question: Any) -> TourSearch:
    """As `once`; nothing is searched for after it."""
    return replace(once(*question), units=SEARCHED)
