"""The keys of a replay: they control the player on every screen, where a screen has no other use for the key."""

from typing import Any

from tui_gcs.actions.action import ConsoleAction, action
from tui_gcs.actions.action_context import ActionContext
from tui_gcs.core.protocol.replay import ReplayAct

REPLAY, REPLAY_SCOPE = "Replay", "replay"
"""Group of the help, and scope in a keymap file."""
STEP_S = 10
"""Played seconds of one step forward or back."""


def _pause_label(context: ActionContext) -> str:
    replay = context.status.replay if context.status is not None else None
    return "play" if replay is not None and replay.paused else "pause"


def _replay(
    name: str, keys: str, label: str, text: str, act: ReplayAct, weight: int = 0, *, seconds: int = 0, **more: Any
) -> ConsoleAction:
    return action(name, keys, label, text, REPLAY, weight, do=f"replay('{act.name}', {seconds})", **more)


REPLAY_ACTIONS = (
    _replay("pause", "space", "pause", "stand still, and go on", ReplayAct.PAUSE, 12, label_now=_pause_label),
    _replay(
        "forward",
        "full_stop",
        f"{STEP_S} s",
        f"{STEP_S} s back and forward",
        ReplayAct.MOVE,
        11,
        seconds=STEP_S,
        shown=", .",
    ),
    _replay("back", "comma", "", "", ReplayAct.MOVE, seconds=-STEP_S),
    _replay(
        "faster",
        "right_curly_bracket",
        "speed",
        "half and double speed",
        ReplayAct.FASTER,
        10,
        shown="{ }",
    ),
    _replay("slower", "left_curly_bracket", "", "", ReplayAct.SLOWER),
    _replay(
        "next_event",
        "right_parenthesis",
        "event",
        "previous and next event; what sensors report is passed over",
        ReplayAct.NEXT_EVENT,
        9,
        shown="( )",
    ),
    _replay("previous_event", "left_parenthesis", "", "", ReplayAct.PREVIOUS_EVENT),
    _replay(
        "next_alarm",
        "greater_than_sign",
        "alarm",
        "previous and next alarm or critical event",
        ReplayAct.NEXT_ALARM,
        9,
        shown="< >",
    ),
    _replay("previous_alarm", "less_than_sign", "", "", ReplayAct.PREVIOUS_ALARM),
    action("go_to_time", "G", "time", "go to a time: 2:13, 12:41:07Z, +30, -30, 50 %", REPLAY, 9),
)
