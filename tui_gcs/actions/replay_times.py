"""Times of a replay as an operator types them.

95  1:35  1:02:03    since the beginning of the recording
+30  -1:30           from the moment that is shown
12:41:07Z            the time of day (UTC) at which it was recorded
50 %                 of the whole recording
"""

import math
import re

from tui_gcs.core.protocol.common import StationStatus

HELP = "1:35 since the beginning, +30, -1:30, 12:41:07Z, 50 %"
DAY_S = 86_400.0
_CLOCK = re.compile(r"(?:([0-9]{1,4}):)?(?:([0-9]{1,5}):)?([0-9]{1,6}(?:\.[0-9]+)?)")


class ReplayTimeError(ValueError):
    """What was typed is no time of this recording; the text is one line for the operator."""


def played_time_s(text: str, status: StationStatus) -> float:
    """Return the played seconds since the beginning that `text` means, never below 0.

    Raises:
        ReplayTimeError: `text` is no time, or it needs the length of the recording, which is not known yet.
    """
    text = text.strip().replace(" ", "")
    replay = status.replay
    if replay is None:
        raise ReplayTimeError("no recording is played")
    if text.endswith("%"):
        share = since_beginning_s(text[:-1])
        if math.isnan(replay.length_s):
            raise ReplayTimeError("the length of the recording is not known yet: try again in a moment")
        return min(1.0, share / 100.0) * replay.length_s
    if text[:1] in ("+", "-"):
        by_s = since_beginning_s(text[1:])
        return max(0.0, replay.at_s + (by_s if text[0] == "+" else -by_s))
    if text[-1:] in ("Z", "z"):
        # The nearest such time of day: a recording may pass midnight. Gaps that were cut short are not known here.
        ahead_s = (since_beginning_s(text[:-1]) - status.wall_s + DAY_S / 2) % DAY_S - DAY_S / 2
        return max(0.0, replay.at_s + ahead_s)
    return since_beginning_s(text)


def since_beginning_s(text: str) -> float:
    """Return the seconds of `95`, `1:35` or `1:02:03`. Raises `ReplayTimeError`."""
    match = _CLOCK.fullmatch(text)
    if match is None:
        raise ReplayTimeError(f"no time: {HELP}")
    first, second, seconds = match.groups()
    # With one colon the first group holds the minutes.
    hours, minutes = (first, second) if second is not None else (None, first)
    return int(hours or 0) * 3600.0 + int(minutes or 0) * 60.0 + float(seconds)
