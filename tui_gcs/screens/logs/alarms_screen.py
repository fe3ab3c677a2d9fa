"""The list of alarms: all of them with what to do, acknowledging, shelving, and the history."""

import math
from collections.abc import Callable

from textual import events

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.protocol.alarms import action_words
from tui_gcs.core.protocol.common import Acknowledge, Alarm, EventClass, Request, Shelve, Unshelve
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import EventRaised, StatusUpdated
from tui_gcs.screens.common.row_copies import copy_rows
from tui_gcs.screens.common.text_dialog import REACTION_S, TextDialog
from tui_gcs.widgets.basics.alarm_line import LEVEL_INKS, LEVEL_TAGS
from tui_gcs.widgets.basics.copied_rows import Record
from tui_gcs.widgets.basics.event_lines import event_line
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.shown_keys import KEYS
from tui_gcs.widgets.basics.strips import Run

SHELVE_MIN = 5.0
"""The time an alarm is shelved for: every alarm level allows it."""
HISTORY_LINES = 8
SHELVED = " shelved"
STATE_WORDS = {"new": "NEW", "acknowledged": "seen", "over": "over", "shelved": "shelved"}


class AlarmScreen(TextDialog[None]):
    """A dialog over any screen. Arrows mark an alarm; keys act on the marked one; Esc closes."""

    title_text = "alarms"

    def __init__(self, feed: Feed, ask: Callable[[Request, str], None], glyphs: GlyphSet, clock: Clock) -> None:
        """`ask` sends a request to the station and reports what became of it."""
        super().__init__(glyphs)
        self._feed = feed
        self._ask = ask
        self._clock = clock
        self._marked = ""
        self._moved_s = -math.inf
        """When the mark went to another alarm by itself."""
        self._hint = ""

    def on_mount(self) -> None:
        """Begin to receive the feed's messages, and mark the first alarm."""
        super().on_mount()
        self._feed.listen(self)
        first = self.marked()
        self._marked = _key(first) if first is not None else ""

    def on_status_updated(self, _message: StatusUpdated) -> None:
        """Show the alarms; the mark stays with its alarm, and moves only when that is gone."""
        self._follow()
        self.redraw()

    def _follow(self) -> None:
        marked = self.marked()
        if marked is None or (key := _key(marked)) == self._marked:
            return
        if _cause(key) != _cause(self._marked):  # put aside or shown again it is the same alarm
            self._moved_s = self._clock.now()
        self._marked = key

    def on_event_raised(self, _message: EventRaised) -> None:
        """Show the event in the history, if it is about an alarm."""
        self.redraw()

    def on_key(self, event: events.Key) -> None:
        """Mark by arrows; acknowledge, shelve or select by the letters of the last line."""
        event.stop()
        self._hint = ""
        self._follow()  # a status may have arrived that is not drawn yet
        marked = self.marked()
        if event.key in ("escape", "q", "enter", "A"):
            self.finish(None)
            return
        elif event.key in ("down", "j", "up", "k"):
            self._mark(1 if event.key in ("down", "j") else -1)
        elif event.key == "x":
            self._acknowledge([alarm for alarm in self.alarms() if alarm.state in ("new", "over")])
        elif event.key in ("y", "Y"):
            copied = self.alarms() if event.key == "Y" else [marked] if marked is not None else []
            self._hint, _ = copy_rows(self.app, [alarm_record(alarm) for alarm in copied])
        elif marked is None or event.key not in ("a", "v", "s"):
            pass
        # The key was probably meant for the alarm that was marked before.
        elif self._clock.now() - self._moved_s < REACTION_S:
            self._hint = "another alarm is marked now: look at it, then the key again"
        elif event.key == "a":
            self._acknowledge([marked])
        elif event.key == "v" and marked.vehicles:
            self._feed.selection.set(marked.vehicles)
            self.finish(None)
            return
        elif event.key == "s" and marked.state == "over":
            self._hint = "it is over, there is nothing to put aside: a forgets it"
        elif event.key == "s" and marked.state != "shelved":
            self._ask(Shelve(raised={marked.cause: marked.raised}, minutes=SHELVE_MIN), "shelve")
        elif event.key == "s":
            self._ask(Unshelve(causes=(marked.cause,)), "unshelve")
        self.redraw()

    def _acknowledge(self, alarms: list[Alarm]) -> None:
        if alarms:
            # `raised` names which occurrence was seen: one that was raised again since stays unacknowledged.
            self._ask(Acknowledge(raised={alarm.cause: alarm.raised for alarm in alarms}), "acknowledge")

    def alarms(self) -> tuple[Alarm, ...]:
        """Return the station's alarms; none while it is silent."""
        status = self._feed.status
        return status.alarms if status is not None and not self._feed.station_lost else ()

    def marked(self) -> Alarm | None:
        """Return the alarm that keys act on: it stays marked while others come and go."""
        alarms = self.alarms()
        exact = [alarm for alarm in alarms if _key(alarm) == self._marked]
        # An alarm that was shelved meanwhile has another key, but is the same alarm.
        same = [alarm for alarm in alarms if alarm.cause == _cause(self._marked)]
        return next(iter([*exact, *same, *alarms]), None)

    def _mark(self, by: int) -> None:
        alarms, marked = self.alarms(), self.marked()
        if marked is not None:
            self._marked = _key(alarms[(alarms.index(marked) + by) % len(alarms)])
            self._moved_s = -math.inf

    def body(self) -> list[Line]:
        """Return as many alarms as there is room for, the marked one among them, the history, and the keys."""
        alarms, marked = self.alarms(), self.marked()
        room = self.room - 2
        lines: list[Line] = []
        # Two lines for each alarm; without room for all, half of the room is left to the history.
        most = len(alarms) if 2 * len(alarms) <= room else max(1, (room - 1) // 2)
        at = alarms.index(marked) if marked is not None else 0
        first = max(0, min(at - most + 1, len(alarms) - most))
        for alarm in alarms[first : first + most]:
            lines += self._alarm_lines(alarm)
        if most < len(alarms):
            lines.append(
                [(f"  {first + 1}-{first + most} of {len(alarms)} alarms: arrows show the others", Ink.CAUTION)]
            )
        if not alarms:
            silent = "the station is silent: nothing is known" if self._feed.station_lost else "no alarm"
            lines.append([(silent, Ink.MUTED)])
        lines += self._history_lines(room - len(lines))
        return [*lines, [(self._hint, Ink.CAUTION)] if self._hint else [], self._key_line()]

    def _alarm_lines(self, alarm: Alarm) -> list[Line]:
        status = self._feed.status
        age_s = max(0.0, (status.t_s if status is not None else alarm.since_s) - alarm.since_s)
        is_marked = alarm is self.marked()
        mark = self.glyphs.selected if is_marked else " "
        quiet = alarm.state in ("over", "shelved")
        ink = Ink.MUTED if quiet else LEVEL_INKS[alarm.level]
        state: Run = (f"{STATE_WORDS[alarm.state]:<8}", Ink.BOLD if alarm.state == "new" else Ink.MUTED)
        what: list[Run] = [(f"{mark}{LEVEL_TAGS[alarm.level]}  ", ink), state, (alarm.words(), ink)]
        details = [_age(age_s)]
        if alarm.state == "shelved" and status is not None:
            details.append(f"for {_age(max(0.0, alarm.shelved_until_s - status.t_s))} more")
        if alarm.by and alarm.state in ("acknowledged", "shelved"):
            details.append("by you" if alarm.by == self._feed.requests.principal else f"by {alarm.by}")
        details.append("a forgets it" if alarm.state == "over" else action_words(alarm.action, KEYS))
        return [what, [(" " * 9 + "  ".join(details), Ink.TEXT if is_marked else Ink.MUTED)]]

    def _history_lines(self, room: int) -> list[Line]:
        """Return the newest events about alarms; the journal has all of them."""
        events_ = [event for event in self._feed.events.kept if event.cls is EventClass.ALARM]
        shown = events_[-max(0, min(room - 2, HISTORY_LINES)) :][::-1] if room > 2 else []
        return (
            [[], *(event_line(event, 70, float("nan"), self._feed.requests.principal) for event in shown)]
            if shown
            else []
        )

    def _key_line(self) -> Line:
        marked = self.marked()
        if marked is None:
            return [(" Esc = close ", Ink.SELECTED)]
        keys = ["x all", "arrows"] if len(self.alarms()) > 1 else ["x all"]
        if marked.state != "over":
            keys.append("s unshelve" if marked.state == "shelved" else f"s shelve {SHELVE_MIN:.0f} min")
        if marked.vehicles:
            keys.append("v select")
        return [(" a = acknowledge ", Ink.SELECTED), (f"  {'  '.join([*keys, 'y copy'])}  Esc", Ink.BOLD)]


def _key(alarm: Alarm) -> str:
    """Return what identifies the marked alarm: the same cause may exist shelved and not shelved."""
    return f"{alarm.cause}{SHELVED}" if alarm.state == "shelved" else alarm.cause


def alarm_record(alarm: Alarm) -> Record:
    """Return an alarm for the clipboard."""
    about: dict[str, object] = {
        "alarm": alarm.title,
        "level": alarm.level,
        "state": alarm.state,
        "vehicles": alarm.vehicles,
    }
    more: dict[str, object] = {
        "names": alarm.names,
        "details": alarm.text,
        "what_to_do": action_words(alarm.action, KEYS),
    }
    return {**about, **more, "by": alarm.by, "since_s": alarm.since_s}


def _cause(key: str) -> str:
    return key.removesuffix(SHELVED)


def _age(seconds: float) -> str:
    """Format a time as `12 s`, `3 min` or `2 h`."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.0f} h"
