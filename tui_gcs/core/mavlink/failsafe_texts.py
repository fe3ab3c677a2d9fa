"""Failsafe texts: what autopilots report of a failsafe, and which part of it is the reason. Pure; texts as measured.

ArduPilot: "EKF variance", then "EKF Failsafe: changed to LAND Mode"; for a fence only a notice, "Circle fence
breached". PX4: "Failsafe activated: entering Hold for 5 seconds", without a reason, and in the EVENT after it "Manual
control loss: switching to RTL in 5 seconds", or "Failsafe activated: Autopilot disengaged, switching to Descend". For a
fence the reason comes first: "Geofence: exceeding maximum distance to Home", "Failsafe activated: switching to RTL in 5
seconds".
"""

import re
from collections.abc import Sequence

_OF_ONE = re.compile(r"failsafe|: switching to |fences? breached", re.IGNORECASE)
_SAYS_WHY = re.compile(
    r"^(?:Failsafe activated: )?(?!entering |Failsafe activated)(.+?)(: switching to .*|, switching to .*)$"
)
_OF_FENCE = re.compile(r"^Geofence: |fences? breached")
_GENERAL = re.compile(r"^Failsafe activated(: (entering|switching to) .*)?$")


def is_of_failsafe(text: str) -> bool:
    """Return whether `text` reports a failsafe or the reason of one."""
    return _OF_ONE.search(text) is not None


def is_fence_breach(text: str) -> bool:
    """Return whether `text` reports that the vehicle is outside of its own fence, or about to leave it."""
    return _OF_FENCE.search(text) is not None


def is_news(words: str) -> bool:
    """Return whether these words report another failsafe of a vehicle that is in one already."""
    return bool(words) and not _GENERAL.match(words) and not words.endswith("leared")


def failsafe_words(texts: Sequence[str]) -> str:
    """Return the reason in the vehicle's own words, from its texts, oldest first; "" if none reports a failsafe."""
    at = next((i for i, text in enumerate(texts) if is_of_failsafe(text)), None)
    if at is None:
        return ""
    for text in texts[at:]:
        if why := _SAYS_WHY.match(text):
            descends = why[2] if why[2].startswith(",") else ""  # its mode does not show it: LAND
            return why[1] + descends
    if "breached" in texts[at]:
        return texts[at]
    words = texts[max(0, at - 1) : at + 1]
    telling = [text for text in words if not _GENERAL.match(text)]
    return "; ".join(telling or words)
