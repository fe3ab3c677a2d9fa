"""The second line: the worst alarm and the key that answers it, and beside it what is not acknowledged yet."""

import re
from collections.abc import Mapping, Sequence

from rich.cells import cell_len
from textual.timer import Timer

from tui_gcs.core.protocol.alarms import AlarmLevel, AlarmState, action_words, id_ranges, to_answer
from tui_gcs.core.protocol.common import Alarm
from tui_gcs.feed.notices import Notice, Severity
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import CUT, Run, cut

FLASH_S = 0.5
"""Half a period: 1 Hz is what a slow link carries (docs/terminal.md D6)."""
WIDE = 100
_OR = re.compile("[,;] or ")
MIN_ACTION_CELLS = 12
"""With fewer cells, what to do cannot be read: `→ En..`."""
MIN_WORDS_CELLS = 12
"""With fewer cells beside a prompt, an alarm is shown by its tag alone."""
MAX_SOURCE_CELLS = 8
"""Cells for the vehicles of another alarm than the first."""
ALARM_SHARE = 0.45
"""Share of the line that an alarm gets at least, beside a notice."""

LEVEL_TAGS = {AlarmLevel.WARNING: "! WARN", AlarmLevel.CAUTION: "^ CAUT", AlarmLevel.ADVISORY: "i ADV "}
LEVEL_INKS = {AlarmLevel.WARNING: Ink.WARNING, AlarmLevel.CAUTION: Ink.CAUTION, AlarmLevel.ADVISORY: Ink.ADVISORY}
BRIGHT_INKS = {AlarmLevel.WARNING: Ink.ALARM, AlarmLevel.CAUTION: Ink.SELECTED_CAUTION}
SHOWN: tuple[AlarmState, ...] = ("new", "over", "acknowledged")


class AlarmLine(LinesView):
    """One line: the worst alarm, beside it a prompt or a notice. It flashes while its alarm is new."""

    DEFAULT_CSS = "AlarmLine { height: 1; }"

    _prompt = ""
    _local = Notice("")
    _notice = Notice("")
    _alarms: Sequence[Alarm] = ()
    _shelved = 0
    _keys: Mapping[str, str] = {}
    _bright = True
    _timer: Timer | None = None

    def on_mount(self) -> None:
        """Begin to flash; nothing is written while nothing is new."""
        self._timer = self.set_interval(FLASH_S, self.flash)

    def set_prompt(self, text: str) -> None:
        """Show what waits for the next key; an empty text ends it."""
        self._prompt = text
        self.update_lines()

    def set_alarms(self, alarms: Sequence[Alarm], keys: Mapping[str, str], local: Notice) -> None:
        """Show the station's alarms, worst first, with the keys of actions; `local` is what only this console knows."""
        self._alarms = [alarm for alarm in alarms if alarm.state in SHOWN]
        self._shelved = len(alarms) - len(self._alarms)
        self._keys, self._local = keys, local
        self.update_lines()

    def set_notice(self, notice: Notice) -> None:
        """Show what became of the last command; an empty text ends it."""
        self._notice = notice
        self.update_lines()

    def flash(self) -> None:
        """Change between bright and dark while the alarm shown is new."""
        # Timers of a screen that is not current go on, although nothing of it is rendered (docs/terminal.md B1).
        if not self.screen.is_current:
            return
        self._bright = not self._bright if self._is_loud() else True
        self.update_lines()

    def _is_loud(self) -> bool:
        news = to_answer(self._alarms) if not self._local.text else None
        return news is not None and news.state == "new" and news.level in BRIGHT_INKS

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        # What is typed has the line: an operator who types must see the letters. A new alarm stands before it.
        if self._prompt:
            return [self._prompt_runs(width)]
        # A silent station or a full disk of this console is not in the station's list: it would be seen nowhere else.
        if self._local.text and (self._local.level is Severity.WARNING or not (self._alarms or self._fails)):
            return [_local_runs(self._local, self._notice, width)]
        if self._alarms:
            arrow = "→" if self.glyphs.unicode else "->"
            return [alarm_runs(self._alarms, self._keys, self._notice, width, self._bright, arrow, self._shelved)]
        inks = {Severity.WARNING: Ink.WARNING, Severity.CAUTION: Ink.CAUTION}
        right = f"  {self._shelved} shelved  {self._keys.get('show_alarms', '')} list " if self._shelved else ""
        room = width - cell_len(right)
        ink = inks.get(self._notice.level, Ink.MUTED)
        return [[(cut(f" {self._notice.text}", room), ink), (right, Ink.TEXT)]]

    @property
    def _fails(self) -> bool:
        """Whether the notice says that something was not done: it is worse than that this console may not command."""
        return self._notice.level is Severity.WARNING

    def _prompt_runs(self, width: int) -> list[Run]:
        """The prompt whole; before it a new alarm, which may come while the operator types."""
        prompt = f" {self._prompt} "
        if self._local.level is Severity.WARNING and self._local.text:
            tag, ink, text = " ! WARN ", Ink.ALARM, self._local.text
        elif (news := to_answer(self._alarms)) is not None and news.state == "new":
            tag, _, ink = alarm_tag(news, self._bright)
            text = _short(news)
        else:
            return [(prompt, Ink.SELECTED)]
        room = width - cell_len(tag + prompt) - 2
        words = f" {_at_most(text, room)} " if room >= MIN_WORDS_CELLS else ""
        return [(tag, ink), (words, ink), (prompt, Ink.SELECTED)]


LOCAL_TAGS: dict[Severity, tuple[Run, Ink]] = {
    Severity.WARNING: ((" ! WARN ", Ink.ALARM), Ink.WARNING),
    Severity.CAUTION: ((" ^ CAUT ", Ink.SELECTED_CAUTION), Ink.CAUTION),
    Severity.NORMAL: ((" i ", Ink.ADVISORY), Ink.TEXT),
}
"""Mark and ink of what only this console knows. That it commands nothing is no alarm: nothing has to be done."""


def _local_runs(local: Notice, notice: Notice, width: int) -> list[Run]:
    """What only this console knows: its first parts, as many as fit beside the notice."""
    tag, ink = LOCAL_TAGS[local.level]
    tail = f"  | {notice.text}" if notice.text else ""
    text, *more = local.text.split("   ")
    room = width - cell_len(tag[0] + tail)
    for part in more:
        if cell_len(f" {text}   {part}") > room:
            break
        text = f"{text}   {part}"
    return [
        tag,
        (f" {text}", ink),
        (cut(tail, width - cell_len(tag[0] + text) - 1), Ink.TEXT),
    ]


def alarm_runs(
    alarms: Sequence[Alarm],
    keys: Mapping[str, str],
    notice: Notice,
    width: int,
    bright: bool,
    arrow: str,
    shelved: int = 0,
) -> list[Run]:
    """The worst alarm, what to do about it, what else is new, and the count. Long texts are cut, never those parts."""
    first, news = alarms[0], to_answer(alarms)
    tag, ink, tag_ink = alarm_tag(first, bright)
    right = _count(alarms, keys, width, shelved)
    action = action_words(first.action, keys)
    text = f" {first.words()}" + (f"   {arrow} {action}" if action and first.state != "over" else "")
    other: Run = ("", ink)
    if news is not None and news is not first:
        other = _news(news, bright, width - cell_len(tag + text + right))
    if notice.text:  # the operator must not miss the answer to a key either
        least = f" {_short(first)}  | {notice.text}"
        right = right if cell_len(tag + least + other[0] + right) <= width else ""
        text = f" {_beside(first, notice.text, width - cell_len(tag + other[0] + right))}  | {notice.text}"
    room = width - cell_len(tag + other[0] + right)
    if cell_len(text) > room:  # the first thing to do, rather than a part of the second
        text = _OR.split(text)[0]
    if cell_len(text) > room and action and first.state != "over" and not notice.text:
        text = _for_the_keys(first, f"   {arrow} ", _OR.split(action), room)
    return [(tag, tag_ink), (cut(text, room), ink), other, (right, Ink.TEXT)]


def _news(alarm: Alarm, bright: bool, room: int) -> Run:
    """What `a` acknowledges if that is not the worst alarm: in words, or as three letters and the vehicles."""
    _, _, ink = alarm_tag(alarm, bright)
    state = "over" if alarm.state == "over" else "NEW"
    words = f" {state} {_short(alarm)} "
    if cell_len(words) <= room:
        return words, ink
    source = ",".join([*([id_ranges(alarm.vehicles)] if alarm.vehicles else []), *alarm.names])
    return f" {state} {alarm.tag} {_at_most(source, MAX_SOURCE_CELLS)} ", ink


def _for_the_keys(alarm: Alarm, arrow: str, actions: Sequence[str], room: int) -> str:
    """What is wrong and one thing to do, rather its keys than why; details fill the room that is left."""
    whole, short, first = alarm.words(), _short(alarm), actions[0]
    keys = first.partition(": ")[2] or first
    tries = [(whole, keys), (short, first), (short, keys), *((short, other) for other in actions[1:])]
    if cell_len(f" {whole}{arrow}") <= room - MIN_ACTION_CELLS:
        tries = tries[:1]
    lines = [f" {what}{arrow}{to_do}" for what, to_do in tries]
    fits = [cell_len(line) <= room for line in lines]
    what, to_do = tries[fits.index(True) if any(fits) else min(2, len(tries) - 1)]
    details = "" if what == whole else _begun(alarm.text, room - cell_len(f" {what}  {arrow}{to_do}"))
    return f" {what}  {details}{arrow}{to_do}" if details else f" {what}{arrow}{to_do}"


def _begun(text: str, cells: int) -> str:
    """As many whole words as fit; empty if they would be too few to be understood."""
    if cell_len(text) <= cells:
        return text
    words = text.split()
    while words and cell_len(" ".join(words)) + len(CUT) > cells:
        words.pop()
    begun = " ".join(words) + CUT
    return begun if cell_len(begun) >= MIN_WORDS_CELLS else ""


def alarm_tag(alarm: Alarm, bright: bool = True) -> tuple[str, Ink, Ink]:
    """Return the mark and word of an alarm's level in eight cells, the ink of its text, and that of its tag."""
    if alarm.state == "over":
        return " o OVER ", Ink.TEXT, Ink.NORMAL
    ink = LEVEL_INKS[alarm.level]
    tag_ink = BRIGHT_INKS.get(alarm.level, ink) if bright and alarm.state == "new" else ink
    text_ink = tag_ink if alarm.state == "new" else ink
    return f" {LEVEL_TAGS[alarm.level]} ", text_ink, tag_ink


def _count(alarms: Sequence[Alarm], keys: Mapping[str, str], width: int, shelved: int) -> str:
    """The number of alarms and of shelved ones, and the keys that answer them."""
    wide = width >= WIDE
    count = f"  {len(alarms)} alarm{'s' if len(alarms) > 1 else ''}" if wide else f"  {len(alarms)} al"
    count += f" +{shelved} shelved" if shelved else ""
    answers = [("acknowledge", "ack")] if any(alarm.state in ("new", "over") for alarm in alarms) else []
    answers = [answer for answer in answers if answer[0] in keys]
    answers += [("show_alarms", "list")] if wide or not answers else []
    return count + "".join(f"  {keys[action]} {word}" for action, word in answers if action in keys) + " "


def _beside(alarm: Alarm, notice: str, room: int) -> str:
    """As much of an alarm as a notice leaves, but at least its share: some name the fault in the details only."""
    short, whole = _short(alarm), alarm.words()
    cells = max(room - cell_len(notice) - 5, int(room * ALARM_SHARE))
    return _at_most(whole, cells) if cells >= cell_len(short) + MIN_WORDS_CELLS // 2 else short


def _at_most(text: str, cells: int) -> str:
    return text if cell_len(text) <= cells else cut(text, cells)


def _short(alarm: Alarm) -> str:
    """The words of an alarm without its details."""
    whole = alarm.words()
    return whole.replace(f"  {alarm.text}", "", 1) if alarm.text else whole
