"""The tests of planners share `flights.py`."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from flights import swarm

__all__ = ["swarm"]
