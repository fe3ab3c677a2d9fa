"""What autopilots say of a failsafe of theirs, and which part of it tells an operator why. Pure; texts as measured.

ArduPilot: "EKF variance", then "EKF Failsafe: changed to LAND Mode"; of a fence but a notice, "Circle fence breached".
PX4: "Failsafe activated: entering Hold for 5 seconds", which says nothing of why, and in the EVENT after it "Manual
control loss: switching to RTL in 5 seconds", or "Failsafe activated: Autopilot disengaged, switching to Descend". Why
of a fence comes first: "Geofence: exceeding maximum distance to Home", "Failsafe activated: switching to RTL in 5
seconds".
"""

import re
from collections.abc import Sequence

_OF_ONE = re.compile(r"failsafe|: switching to |fences? breached", re.IGNORECASE)
_SAYS_WHY = re.compile(
    r"^(?:Failsafe activated: )?(?!entering |Failsafe activated)(.+?)(: switching to .*|, switching to .*)$"
)
_GENERAL = re.compile(r"^Failsafe activated(: (entering|switching to) .*)?$")


def is_of_failsafe(text: str) -> bool:
    """Whether a vehicle says by `text` that it acts by itself, or why."""
    return _OF_ONE.search(text) is not None


def is_news(words: str) -> bool:
    """Whether these words of a failsafe are another one's, of a vehicle that is in one already."""
    return bool(words) and not _GENERAL.match(words) and not words.endswith("leared")


def failsafe_words(said: Sequence[str]) -> str:
    """Why, in the vehicle's own words, of what it `said`, oldest first; "" if it said nothing of a failsafe."""
    at = next((i for i, text in enumerate(said) if is_of_failsafe(text)), None)
    if at is None:
        return ""
    for text in said[at:]:
        if why := _SAYS_WHY.match(text):
            descends = why[2] if why[2].startswith(",") else ""  # its mode does not tell it: LAND
            return why[1] + descends
    if "breached" in said[at]:
        return said[at]
    words = said[max(0, at - 1) : at + 1]
    telling = [text for text in words if not _GENERAL.match(text)]
    return "; ".join(telling or words)
