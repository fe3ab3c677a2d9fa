"""The tests of the screens share a station made of paper (`fake_station`) and a console on it (`console`)."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
