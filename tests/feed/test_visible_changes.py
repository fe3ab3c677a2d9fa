"""What is left out of the key of a status stays on the screen as it was: so all that is shown must be in it."""

import msgspec
import pytest

from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol.common import Alarm, Check, LinkStatus, PointOfInterest, RunPhase, StationStatus, TeamStatus
from tui_gcs.core.protocol.replay import ReplayStatus
from tui_gcs.feed.visible_changes import visible_status

TEAM = TeamStatus(
    "defend", "home", "defend", "patrol", (1, 2), "running", 0.2, 5.0, 2, 2, 20.0, 9.0, 1.0, 18.0, 9.0, 1.2
)
STATUS = StationStatus(1, 10.0, 1e9, RunKind.SIM, "s", 1, RunPhase.IDLE, 0, ("one", "two"), 0.0, 2, 2, 0, "", (TEAM,))
LINK = LinkStatus("udpin:127.0.0.1:14550", True, 1, 1, 0)

OTHER_TEAM = {
    "name": "attack",
    "zone": "field",
    "role": "attack",
    "planner": "mine",
    "members": (1, 3),
    "worker": "late",
    "plan_age_s": 3.0,
    "rate_hz": 10.0,
    "on_slot": 1,
    "slots": 3,
    "worst_idleness_s": 20.1,
    "average_idleness_s": 9.1,
    "coverage": 0.5,
    "ideal_s": 18.1,
    "bound_s": 9.3,
    "ratio": 1.21,
    "metrics": {"period_s": 78.5},
    "error": "a line",
    "reserve": 1,
}
OTHER = {
    "kind": RunKind.LIVE,
    "scenario": "t",
    "revision": 2,
    "run": RunPhase.RUNNING,
    "round_index": 1,
    "rounds": ("one",),
    "mission_time_s": 1.0,
    "heard": 1,
    "vehicles": 3,
    "armed": 1,
    "in_control": "a",
    "links": (LINK,),
    "min_separation_m": 12.0,
    "outside_area_m": 3.0,
    "vetoes": {"area": 1},
    "not_ready": {1: "no fix"},
    "preflight": (Check("links", "ok", "all up"),),
    "if_silent": {1: "holds"},
    "homes": {1: (2.0, 3.0)},
    "recording": "file.tlog",
    "ending": True,
    "planner_files": {"mine": "mine.py"},
    "points": (PointOfInterest("car park", (1.0, 2.0), 1.0, "defend", 0.0, 60.0),),
    "replay": ReplayStatus(10.0, 229.0, 1.0, False),
    "alarms": (Alarm("lost", "warning", "LST", "LOST", "look", "new", 1, 10.0),),
}
NOT_SHOWN = {"seq", "t_s", "wall_s", "forward", "faults", "dropped"}
"""Of a status in a console: counters that only grow, and when it was made."""


@pytest.mark.parametrize("field", TeamStatus.__struct_fields__)
def test_whatever_changes_of_a_team_is_drawn_again(field: str) -> None:
    other = msgspec.structs.replace(TEAM, **{field: OTHER_TEAM[field]})
    assert visible_status(msgspec.structs.replace(STATUS, teams=(other,))) != visible_status(STATUS)


@pytest.mark.parametrize("field", [f for f in StationStatus.__struct_fields__ if f != "teams"])
def test_whatever_changes_of_the_station_is_drawn_again(field: str) -> None:
    if field in NOT_SHOWN:
        assert field not in OTHER
        return
    other = msgspec.structs.replace(STATUS, **{field: OTHER[field]})
    assert visible_status(other) != visible_status(STATUS)


def test_what_cannot_be_seen_is_not_drawn_again() -> None:
    later = msgspec.structs.replace(STATUS, seq=2, t_s=10.5, wall_s=1e9 + 0.5, dropped={"late": 3})
    assert visible_status(later) == visible_status(STATUS)


def test_what_is_rounded_down_or_up_on_the_screen_is_so_in_the_key() -> None:
    """Else 99 % stay there when all was seen, and 0 m when somebody was outside."""
    almost, whole = (msgspec.structs.replace(TEAM, coverage=share) for share in (0.998, 1.0))
    keys = [visible_status(msgspec.structs.replace(STATUS, teams=(team,))) for team in (almost, whole)]
    assert keys[0] != keys[1]
    inside, beside = (msgspec.structs.replace(STATUS, outside_area_m=metres) for metres in (0.0, 0.02))
    assert visible_status(inside) != visible_status(beside)
