"""Dialogs: start, choose a round, results, help. Plain text lines in a box; Esc always leaves."""

from collections.abc import Sequence
from textwrap import wrap
from typing import TypeVar

from textual import events
from textual.app import ComposeResult
from textual.screen import ModalScreen

from tui_gcs.actions import Action
from tui_gcs.core.clock import Clock, MonotonicClock
from tui_gcs.core.messages import Kind, VehicleResult
from tui_gcs.core.scenario import LinkLoss
from tui_gcs.feed import Feed
from tui_gcs.screens.start_plan import StartPlan, fingerprint
from tui_gcs.widgets.glyphs import GlyphSet
from tui_gcs.widgets.lines import Line, LinesView
from tui_gcs.widgets.palette import Ink
from tui_gcs.widgets.titles import set_title
from tui_gcs.widgets.words import ids

T = TypeVar("T")
DIALOG_WIDTH = 76
MOST_CELLS = 72
"""What a line may be long at 80 columns."""
MOST_REASONS = 5
CANCEL_AFTER_S = 10.0
CHECK_S = 0.5


class DialogBox(LinesView):
    """The box with the text."""

    DEFAULT_CSS = """
    DialogBox { border: heavy #d8dee4; border-title-color: #d8dee4; border-title-style: bold; padding: 0 1; }
    DialogBox.-ascii { border: ascii #d8dee4; }
    """

    _text: Sequence[Line] = ()

    def show(self, title: str, text: Sequence[Line]) -> None:
        """Show these lines, in a box as high as they need."""
        self._text = text
        set_title(self, title)
        screen = self.screen.size
        self.styles.width = min(DIALOG_WIDTH, screen.width - 2)
        self.styles.height = min(len(text) + 2, screen.height - 2)
        self.update_lines()

    def lines(self, width: int, height: int) -> Sequence[Line]:
        """See `LinesView.lines`."""
        return self._text


class TextDialog(ModalScreen[T]):
    """Base of the dialogs: lines in a box, keys handled by the subclass."""

    DEFAULT_CSS = "TextDialog { align: center middle; }"

    title_text = ""

    def __init__(self, glyphs: GlyphSet) -> None:
        """With these characters."""
        super().__init__()
        self.glyphs = glyphs
        self.box = DialogBox(glyphs=glyphs)

    def compose(self) -> ComposeResult:
        """One box."""
        yield self.box

    def on_mount(self) -> None:
        """First text."""
        self.redraw()

    def on_resize(self) -> None:
        """The box follows the terminal."""
        self.redraw()

    def body(self) -> list[Line]:
        """The text now."""
        raise NotImplementedError

    def redraw(self) -> None:
        """Show `body` again."""
        self.box.show(self.title_text, self.body())

    def text(self) -> str:
        """The text without colours."""
        return "\n".join("".join(text for text, _ in line) for line in self.body())


class StartDialog(TextDialog[bool]):
    """Names, count and ids of what will fly. SIM: Enter starts; LIVE: type the count, then Enter.

    Cancel is what happens by itself: on Esc, after ten seconds without a key, and when fleet, links or round change.
    """

    def __init__(
        self, plan: StartPlan, kind: Kind, loss: LinkLoss, feed: Feed, glyphs: GlyphSet, clock: Clock | None = None
    ) -> None:
        """Ask about `plan`."""
        super().__init__(glyphs)
        self.title_text = f"start {plan.round_name}?"
        self._plan = plan
        self._kind = kind
        self._loss = loss
        self._feed = feed
        self._clock = clock or MonotonicClock()
        self._seen = fingerprint(feed)
        self._deadline_s = self._clock.now() + CANCEL_AFTER_S
        self._typed = ""
        self._problem = ""

    def on_mount(self) -> None:
        """Watch the time and the fleet while open."""
        super().on_mount()
        self.set_interval(CHECK_S, self.tick)

    def tick(self) -> None:
        """Cancel when time is up or what was shown is no longer so."""
        if self._clock.now() >= self._deadline_s or fingerprint(self._feed) != self._seen:
            self.dismiss(False)
        else:
            self.redraw()

    def on_key(self, event: events.Key) -> None:
        """Enter, Esc, and in LIVE digits."""
        event.stop()
        self._deadline_s = self._clock.now() + CANCEL_AFTER_S
        if event.key == "escape":
            self.dismiss(False)
            return
        if event.key == "enter":
            self._confirm()
            return
        if self._kind is Kind.LIVE and event.character is not None and event.character.isdigit():
            self._typed = (self._typed + event.character)[-4:]
        elif event.key == "backspace":
            self._typed = self._typed[:-1]
        self._problem = ""
        self.redraw()

    def _confirm(self) -> None:
        count = len(self._plan.vehicles)
        if count == 0:
            self._problem = "no vehicle of these teams is heard and ready"
        elif self._kind is Kind.LIVE and self._typed != str(count):
            self._problem = f"type {count}, the number of vehicles, then Enter"
        else:
            self.dismiss(fingerprint(self._feed) == self._seen)
            return
        self.redraw()

    def body(self) -> list[Line]:
        """Teams, what happens on loss, and what the keys do."""
        count = len(self._plan.vehicles)
        what = {Kind.SIM: "SIMULATED", Kind.LIVE: "REAL"}.get(self._kind, str(self._kind))
        lines: list[Line] = [
            [
                (f"{what} vehicles arm, take off and fly: ", Ink.TEXT),
                (f"{count}  ({ids(self._plan.vehicles)})", Ink.BOLD),
            ],
            [],
        ]
        for team in self._plan.teams:
            known = [vehicle for vehicle in team.missing if vehicle]
            absent = f"   not heard: {ids(known) if known else len(team.missing)}" if team.missing else ""
            ink = Ink.ATTACK if team.role == "attack" else Ink.DEFEND
            lines.append(
                [
                    (f"  {team.name[:12]:<12} ", Ink.BOLD),
                    (f"{len(team.vehicles)}: {ids(team.vehicles) or 'none':<10} ", Ink.TEXT),
                    (f"{team.role.upper()} {team.zone[:16]}", ink),
                    (f"   {team.planner}", Ink.MUTED),
                    (absent, Ink.CAUTION),
                ]
            )
        lines += self._file_lines()
        lines += self._left_out_lines()
        lines += [[], *self._loss_lines(), [], self._key_line()]
        return [*lines, [(self._problem, Ink.CAUTION)]] if self._problem else lines

    def _file_lines(self) -> list[Line]:
        """Planners that come from files of their own: which, and as they were at the start."""
        files = self._feed.status.planner_files if self._feed.status is not None else {}
        used = {team.planner for team in self._plan.teams}
        return [
            [(line, Ink.CAUTION)]
            for name, file in sorted(files.items())
            if name in used
            for line in wrap(f"{name} is {file}", MOST_CELLS, initial_indent="  ", subsequent_indent="    ")
        ]

    def _left_out_lines(self) -> list[Line]:
        """Heard, but not ready: who, and the vehicle's or the station's reason."""
        left_out = [item for team in self._plan.teams for item in team.not_ready]
        lines: list[Line] = [
            [(f"  left out: {vehicle}  {why}", Ink.CAUTION)] for vehicle, why in left_out[:MOST_REASONS]
        ]
        if len(left_out) > MOST_REASONS:
            lines.append([(f"  and {len(left_out) - MOST_REASONS} more", Ink.CAUTION)])
        return lines

    def _loss_lines(self) -> list[Line]:
        resume = "goes on by itself when it is back" if self._loss.resume else "until you resume"
        return [
            [(f"planner late or dead   its vehicles: {self._loss.planner}", Ink.MUTED)],
            [(f"a vehicle is lost      the others of its team: {self._loss.vehicle}", Ink.MUTED)],
            [(f"the station is gone    {resume}:", Ink.MUTED)],
            *(
                [(line, Ink.MUTED)]
                for does, vehicles in self._if_silent()
                for line in wrap(f"{ids(vehicles)}  {does}", MOST_CELLS, initial_indent="  ", subsequent_indent="    ")
            ),
        ]

    def _if_silent(self) -> list[tuple[str, list[int]]]:
        """What vehicles do when nobody speaks to them any more, by their own settings."""
        said = self._feed.status.if_silent if self._feed.status is not None else {}
        groups: dict[str, list[int]] = {}
        for vehicle in self._plan.vehicles:
            groups.setdefault(said.get(vehicle, "nobody knows what it does"), []).append(vehicle)
        return list(groups.items())

    def _key_line(self) -> Line:
        left_s = max(0, round(self._deadline_s - self._clock.now()))
        cancel = (f" Esc = cancel ({left_s} s) ", Ink.SELECTED)
        if self._kind is Kind.LIVE:
            count = len(self._plan.vehicles)
            ask = f"type {count} and Enter = start: [{self._typed:_<3}]"
            return [cancel, ("   ", Ink.TEXT), (ask, Ink.BOLD)]
        return [cancel, ("   ", Ink.TEXT), ("Enter = start", Ink.BOLD)]


class RoundDialog(TextDialog[int | None]):
    """Choose a round by number or arrows; Enter makes it the present one."""

    title_text = "round"

    def __init__(self, rounds: Sequence[str], current: int, flying: bool, glyphs: GlyphSet) -> None:
        """Offer `rounds`; the next one is marked first."""
        super().__init__(glyphs)
        self._rounds = rounds
        self._current = current
        self._flying = flying
        self._marked = (current + 1) % len(rounds)

    def on_key(self, event: events.Key) -> None:
        """Digits, arrows, Enter, Esc."""
        event.stop()
        if event.key == "escape":
            self.dismiss(None)
        elif event.key == "enter":
            self.dismiss(self._marked)
        elif event.key in ("down", "j", "o"):
            self._mark(self._marked + 1)
        elif event.key in ("up", "k"):
            self._mark(self._marked - 1)
        elif (
            event.character is not None and event.character.isdigit() and 0 < int(event.character) <= len(self._rounds)
        ):
            self._mark(int(event.character) - 1)

    def _mark(self, index: int) -> None:
        self._marked = index % len(self._rounds)
        self.redraw()

    def body(self) -> list[Line]:
        """The rounds and the keys."""
        lines: list[Line] = []
        for index, name in enumerate(self._rounds):
            mark = self.glyphs.selected if index == self._marked else " "
            now = "   now" if index == self._current else ""
            ink = Ink.BOLD if index == self._marked else Ink.TEXT
            lines.append([(f"{mark} {index + 1}  {name}{now}", ink)])
        where = "vehicles fly there at once" if self._flying else "nothing flies"
        return [*lines, [], [(" Esc = cancel ", Ink.SELECTED), (f"   Enter = switch ({where})", Ink.BOLD)]]


class ResultDialog(TextDialog[None]):
    """What became of a request, vehicle by vehicle; refused ones first."""

    def __init__(self, title: str, text: str, results: Sequence[VehicleResult], glyphs: GlyphSet) -> None:
        """Show `results`."""
        super().__init__(glyphs)
        self.title_text = title
        self._text = text
        self._results = results

    def on_key(self, event: events.Key) -> None:
        """Esc, Enter or Space leaves."""
        event.stop()
        if event.key in ("escape", "enter", "space"):
            self.dismiss(None)

    def body(self) -> list[Line]:
        """One line each."""
        lines: list[Line] = [[(self._text, Ink.BOLD)], []] if self._text else []
        for result in sorted(self._results, key=lambda result: (result.ok, result.vehicle)):
            mark, ink = ("ok", Ink.TEXT) if result.ok else ("refused", Ink.CAUTION)
            lines.append([(f"vehicle {result.vehicle:<4} {mark:<8} ", ink), (result.text, Ink.TEXT)])
        return [*lines, [], [(" Esc or Enter = close ", Ink.SELECTED)]]


class HelpDialog(TextDialog[None]):
    """All keys, from the action tables."""

    title_text = "keys"

    def __init__(self, actions: Sequence[Action], glyphs: GlyphSet) -> None:
        """List `actions` by group."""
        super().__init__(glyphs)
        self._actions = actions
        self._first = 0

    def on_key(self, event: events.Key) -> None:
        """Arrows scroll; Esc, q or ? leaves."""
        event.stop()
        if event.key in ("escape", "q", "question_mark", "enter"):
            self.dismiss(None)
        elif event.key in ("down", "j", "pagedown", "space"):
            self._scroll(+1 if event.key in ("down", "j") else +10)
        elif event.key in ("up", "k", "pageup"):
            self._scroll(-1 if event.key in ("up", "k") else -10)

    def _scroll(self, by: int) -> None:
        self._first = max(0, min(self._first + by, len(self.all_lines()) - self._room()))
        self.redraw()

    def _room(self) -> int:
        """Lines for keys: the box less its border and the last line."""
        return max(1, self.size.height - 2 - 3)

    def body(self) -> list[Line]:
        """The keys that fit, and how to leave."""
        room, lines = self._room(), self.all_lines()
        more = "   arrows: more" if len(lines) > room else ""
        return [*lines[self._first : self._first + room], [(" Esc = close ", Ink.SELECTED), (more, Ink.MUTED)]]

    def all_lines(self) -> list[Line]:
        """All keys, by group."""
        lines: list[Line] = []
        for group in dict.fromkeys(action.group for action in self._actions):
            told = [action for action in self._actions if action.group == group and action.help]
            for index, action in enumerate(told):
                name = group if index == 0 else ""
                keys = (f"{action.shown:<8} ", Ink.BOLD)
                lines.append([(f"{name:<9}", Ink.ADVISORY), keys, (action.help, Ink.TEXT)])
        return lines
