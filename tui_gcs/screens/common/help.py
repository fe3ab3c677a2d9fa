"""Help: all keys of a screen, what each does, and why a greyed one can do nothing now."""

from collections.abc import Sequence
from dataclasses import replace
from textwrap import wrap

from tui_gcs.actions import ActionContext, ConsoleAction, refusal
from tui_gcs.actions.action import ALARMS, COMMAND, SCREENS, SELECT, VIEW
from tui_gcs.screens.common.text_dialog import LINE_CELLS, ScrolledDialog
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.palette import Ink

EVERYWHERE = (COMMAND, SELECT, ALARMS, SCREENS, VIEW)
"""Groups that most screens have, in the order in which a new operator needs them."""
HERE = "Here"
"""Heading of what a screen without a map does itself."""
KEY_CELLS = 18
"""Cells for the group and the key, before the text of an action."""


class HelpDialog(ScrolledDialog):
    """All keys of a screen, from the action tables."""

    LEAVE_KEYS = (*ScrolledDialog.LEAVE_KEYS, "question_mark")
    title_text = "keys"

    def __init__(
        self,
        actions: Sequence[ConsoleAction],
        situation: ActionContext,
        glyphs: GlyphSet,
        own: Sequence[ConsoleAction] = (),
    ) -> None:
        """List `actions` by group, as they are in `situation`; before them those of a screen without a map, `own`."""
        super().__init__(glyphs)
        # What such a screen asks of the station, or shows, is neither flight nor map.
        here = [replace(action, group=HERE if action.group in (COMMAND, VIEW) else action.group) for action in own]
        self._actions = list(zip((*here, *actions), (*own, *actions), strict=True))
        self._situation = situation

    def all_lines(self) -> list[Line]:
        """Return the actions by group, those of this screen first; those that can do nothing now are grey, with why."""
        lines: list[Line] = []
        groups = dict.fromkeys(listed.group for listed, _ in self._actions)
        # Groups of this screen alone are not in EVERYWHERE: -1 puts them first.
        for group in sorted(groups, key=lambda group: EVERYWHERE.index(group) if group in EVERYWHERE else -1):
            described = [action for listed, action in self._actions if listed.group == group and action.help]
            for index, action in enumerate(described):
                name = (f"{group if index == 0 else '':<9}", Ink.ADVISORY)
                why = refusal(action, self._situation)
                inks = (Ink.MUTED, Ink.MUTED) if why else (Ink.BOLD, Ink.TEXT)
                first, *more = wrap(described_words(action), LINE_CELLS - KEY_CELLS)
                lines.append([name, (f"{action.shown:<8} ", inks[0]), (first, inks[1])])
                lines += [[(" " * KEY_CELLS + text, inks[1])] for text in more]
                if why:
                    lines += [
                        [(" " * KEY_CELLS + text, Ink.CAUTION)]
                        for text in wrap(f"not now: {why}", LINE_CELLS - KEY_CELLS)
                    ]
        return [*lines, *legend(self.glyphs)]


def described_words(action: ConsoleAction) -> str:
    """Return what an action does: the word of the footer, which is often its verb, and the text of the table."""
    text = action.help
    if not action.label or text.casefold().startswith(action.label.casefold()):
        return text
    return f"{action.label}: {text}"


def legend(glyphs: GlyphSet) -> list[Line]:
    """Return what the signs and abbreviations on the screens mean."""
    meanings = (
        (
            f"{glyphs.headings[0]} {glyphs.armed_on_ground} {glyphs.disarmed} {glyphs.lost}",
            "in the air, its nose forward; armed on the ground; disarmed; not heard",
        ),
        (f"{glyphs.place} {glyphs.marker}", "on the map: a take-off place; where a vehicle is sent"),
        ("^ ! x i", "caution; warning; not heard; to be known"),
        ("OVER", "an alarm that is over and was not acknowledged"),
        ("8/8", "vehicles heard, of all that are known"),
        ("ctl", "who gave the last order, from this console or another"),
        ("ALT", "metres above its own take-off place"),
        ("slot off", "its place in the team; metres from where it should be now"),
        (
            "26s 1.3x",
            "of a zone: the longest that a place was not seen, in the last minute; as a multiple of the best possible",
        ),
        ("cov 4/4", "percent of the zone seen since the round began; vehicles on their slots"),
        ("sep out", "nearest two in the air; farthest outside the operating area"),
        ("veto", "set-points that the guard did not let through: the vehicle brakes and holds"),
    )
    lines: list[Line] = []
    for sign, meaning in meanings:
        first, *more = wrap(meaning, LINE_CELLS - KEY_CELLS)
        lines.append([(f"{'' if lines else 'Signs':<9}", Ink.ADVISORY), (f"{sign:<8} ", Ink.BOLD), (first, Ink.TEXT)])
        lines += [[(" " * KEY_CELLS + text, Ink.TEXT)] for text in more]
    return lines
