"""The console: screens over a feed. Its only input is the bus, its only output are requests.

Losing it loses nothing: the station flies on, and another console shows the same.
"""

import asyncio
import contextlib
import math
import os
import signal
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from textual import events
from textual.await_complete import AwaitComplete
from textual.binding import BindingType
from textual.screen import ModalScreen, Screen
from textual.widgets import Input

from tui_gcs.actions import APP, APP_ACTIONS, ConsoleAction, bindings
from tui_gcs.actions.entries import Entry, entries_of, order_entries
from tui_gcs.actions.keymap import human, with_keys
from tui_gcs.console.commanding import FOLLOW_S, CommandingApp, action_named
from tui_gcs.console.groups import GroupFile, GroupsError
from tui_gcs.console.idle_garbage import LOOK_S, IdleGarbage
from tui_gcs.console.key_chord import PREFIX_S, KeyChord
from tui_gcs.console.key_guard import KeyGuard
from tui_gcs.console.line_entry import LineEntry
from tui_gcs.console.preload import AFTER_S, read_ahead
from tui_gcs.core.base.clock import Clock, MonotonicClock
from tui_gcs.core.formats.overlays import Overlay
from tui_gcs.core.protocol.alarms import to_answer
from tui_gcs.core.protocol.bus import Bus
from tui_gcs.core.protocol.common import Acknowledge, Alarm, RunKind, RunPhase
from tui_gcs.feed.feed import PERIOD_S, Feed
from tui_gcs.feed.messages import DisplayLagged, StatusUpdated
from tui_gcs.feed.notices import NOTICE_S, Notice, Notices, Severity
from tui_gcs.feed.order_tracker import OrderTracker
from tui_gcs.feed.selection import SelectionError
from tui_gcs.screens.common.help import HelpDialog, PaletteDialog
from tui_gcs.screens.common.text_dialog import REACTION_S
from tui_gcs.screens.common.tiny_screen import MIN_COLUMNS, MIN_ROWS, TinyScreen
from tui_gcs.screens.fly.fly_screen import FlyScreen
from tui_gcs.screens.logs.alarms_screen import AlarmScreen
from tui_gcs.screens.preflight.preflight_screen import Operator
from tui_gcs.terminal.input_filter import InputDropped
from tui_gcs.terminal.key_queue import MAX_KEY_S, KeyHandled, KeyQueue
from tui_gcs.terminal.terminal_options import SLOW_PERIOD_S, wants_slow
from tui_gcs.widgets.basics.alarm_bell import AlarmBell
from tui_gcs.widgets.basics.glyphs import GlyphSet, glyph_set, wants_ascii
from tui_gcs.widgets.basics.number_text import ids
from tui_gcs.widgets.basics.top_lines import TopLines, use_keys

if TYPE_CHECKING:
    from tui_gcs.screens.plan.plan_screen import PlanScreen

SELECT_HELP = "3-7,9  t1  all  none  +5 -5   Enter, Esc"
MODIFIERS = frozenset(
    f"{side}_{name}" for side in ("left", "right") for name in ("shift", "control", "alt", "super", "hyper", "meta")
) | {"caps_lock", "num_lock", "scroll_lock", "iso_level3_shift", "iso_level5_shift"}
"""Keys that terminals with the kitty protocol report by themselves."""
NOTE_SEVERITIES = {Severity.NORMAL: 6, Severity.GREY: 6, Severity.CAUTION: 4, Severity.WARNING: 4}
"""MAV_SEVERITY of what is told, in the journal."""


class ConsoleApp(CommandingApp):
    """Attach to the station on `bus` and show it."""

    TITLE = "tui-gcs"
    ENABLE_COMMAND_PALETTE = False
    ALLOW_SELECT = False
    BINDINGS: ClassVar[list[BindingType]] = bindings(APP_ACTIONS, APP)
    CSS = """
    Screen { background: #101418; color: #d8dee4; layers: default results; }
    ModalScreen { background: transparent; }
    """

    def __init__(
        self,
        bus: Bus,
        principal: str = "",
        kind: RunKind = RunKind.SIM,
        *,
        replay: bool = False,
        read_only: bool = False,
        keymap: Mapping[str, str] | None = None,
        glyphs: GlyphSet | None = None,
        clock: Clock | None = None,
        overlays: Sequence[Overlay] = (),
        theme: str = "",
        groups: GroupFile | None = None,
        folder: Path | None = None,
    ) -> None:
        """A console for a station of this kind; in a replay, and with `read_only`, nothing can be commanded.

        `keymap` is as `read_keymap` gives it: checked. `overlays` go onto the map. `theme` is the one to
        begin with, of `THEMES`. Saved groups of vehicles are in `groups`; None: they are forgotten. Work in
        progress is kept in `folder`; None: nowhere.
        """
        # Without colour only Textual's ANSI mode leaves bold and reverse alone (facts/terminal.md B8).
        super().__init__(ansi_color=True if "NO_COLOR" in os.environ else None)
        if theme:
            self.display_theme = theme
        self.kind = kind
        self.glyphs = glyphs or glyph_set(wants_ascii(os.environ, getattr(sys.__stdout__, "encoding", None)))
        self.clock = clock or MonotonicClock()
        self.feed = Feed(
            bus,
            principal or f"console-{os.getpid()}",
            clock=self.clock,
            period_s=SLOW_PERIOD_S if wants_slow() else PERIOD_S,
            may_paint=lambda: not self.is_lagging,
        )
        self.operator = Operator()
        self.orders = OrderTracker(self.feed, self.clock, self.show_order)
        if replay:
            self.feed.requests.read_only = "replay: nothing is commanded from here"
        elif read_only:
            self.feed.requests.read_only = "read-only: started with --read-only"
        self.keymap = keymap or {}
        use_keys(self.keymap)
        self._replay = replay
        self._overlays = tuple(overlays)
        self._groups = groups
        self._folder = folder
        self._chord = KeyChord()
        self._turns = KeyQueue()
        self._guard = KeyGuard()
        self._garbage = IdleGarbage()
        self._entry: LineEntry | None = None
        self._notices = Notices(self.clock.now)
        self.bell_rings = AlarmBell()
        self._leaving = False
        self._alarm_shown = ""
        """The cause of the alarm that `a` acknowledges, and since when: a key may be meant for the one before."""
        self._alarm_since_s = -math.inf
        self._plan: PlanScreen | None = None
        self.add_mode("fly", self._fly_screen)
        self.add_mode("plan", self._plan_screen)
        self.add_mode("missions", self._missions_screen)
        self.add_mode("vehicles", self._vehicles_screen)
        self.add_mode("journal", self._journal_screen)

    def _fly_screen(self) -> Screen[None]:
        screen = FlyScreen(self.feed, glyphs=self.glyphs)
        screen.map_view.set_overlays(self._overlays)
        return screen

    def _vehicles_screen(self) -> Screen[None]:
        from tui_gcs.screens.vehicles.vehicles_screen import VehiclesScreen

        return VehiclesScreen(self.feed, glyphs=self.glyphs)

    def _journal_screen(self) -> Screen[None]:
        from tui_gcs.screens.logs.journal_screen import JournalScreen

        return JournalScreen(self.feed, glyphs=self.glyphs)

    def _plan_screen(self) -> Screen[None]:
        from tui_gcs.screens.plan.plan_screen import (
            PlanScreen,  # when first shown: the first frame does not wait for it
        )

        self._plan = PlanScreen(self.feed, self.clock, folder=self._folder, glyphs=self.glyphs)
        return self._plan

    @property
    def unapplied(self) -> int:
        """See `CommandingApp.unapplied`."""
        return self._plan.model.changes if self._plan is not None else 0

    def _missions_screen(self) -> Screen[None]:
        from tui_gcs.screens.missions.missions_screen import MissionsScreen  # when first shown

        return MissionsScreen(self.feed, self.clock, folder=self._folder, glyphs=self.glyphs)

    # ------------------------------------------------------------ life

    def on_mount(self) -> None:
        """Open the feed; leave in good order when the terminal or the system says so."""
        loop = asyncio.get_running_loop()
        for number in (signal.SIGTERM, signal.SIGHUP):
            with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):  # not in the main thread
                loop.add_signal_handler(number, self.exit)
        self.set_keymap(self.keymap)
        self.feed.listen(self)
        self.feed.open()
        self.set_interval(FOLLOW_S, self.follow_orders)
        self._garbage.begin(self.clock.now())
        self.set_interval(LOOK_S, lambda: self._garbage.look(self.clock.now()))
        self.set_timer(AFTER_S, read_ahead)
        self.switch_mode("fly")

    def on_unmount(self) -> None:
        """Leave the bus."""
        self._garbage.end()
        self.feed.close()

    def on_status_updated(self, message: StatusUpdated) -> None:
        """Ring for alarms; never command a station of another kind than the one this console was opened for."""
        first = self._to_answer()
        if first is not None and first.cause != self._alarm_shown:
            self._alarm_since_s = self.clock.now() if self._alarm_shown else -math.inf
        self._alarm_shown = first.cause if first is not None else ""
        if self.bell_rings.rings(message.status.alarms, self.clock.now()):
            self.bell()
        kind = message.status.kind
        if kind is not self.kind and not self.feed.requests.read_only:
            self.feed.requests.read_only = f"read-only: opened for {self.kind}, but this station is {kind}"

    def on_display_lagged(self, _message: DisplayLagged) -> None:
        """Say that the picture stood still."""
        self.notice("DISPLAY LAGGED: this terminal had stopped reading; the picture is fresh again", Severity.CAUTION)

    def on_input_dropped(self, message: InputDropped) -> None:
        """Say what was not taken: an operator pasted more than a line, or a mouse went wild."""
        self.notice(f"too much at once for keys: {message.characters} characters NOT TAKEN", Severity.CAUTION)

    def on_resize(self, event: events.Resize) -> None:
        """Below 80x24 only the essentials."""
        self.redraw()
        small = event.size.width < MIN_COLUMNS or event.size.height < MIN_ROWS
        shown = isinstance(self.screen, TinyScreen)
        if small and not shown:
            self.push_screen(TinyScreen(self.feed, glyphs=self.glyphs))
        elif not small and shown:
            self.pop_screen()
        self.call_after_refresh(self.fit_result)

    async def on_event(self, event: events.Event) -> None:
        """Keys pass the chord of last resort first: dialogs, forms and small terminals cannot swallow it."""
        if not isinstance(event, events.Key | events.Paste) or event.is_forwarded:
            await super().on_event(event)
            return
        if isinstance(event, events.Paste):
            self._turns.add((event, self.clock.now()))
            await self._take_turns()
            return
        if event.key in MODIFIERS:  # some terminals tell of Shift itself: it is part of the key that comes with it
            return
        now_s = self.clock.now()
        self._garbage.typed(now_s)
        pressed_s = now_s - max(
            0.0, time.monotonic() - event.time
        )  # a console that was busy still knows what was meant
        was_waiting = self._chord.is_waiting(pressed_s)
        action, keys = self._chord.press(event, pressed_s)
        if was_waiting or self._chord.is_waiting(now_s):
            self._prompt()
        if action:
            await self.run_action(f"app.{action}")
        for key in keys:
            self._turns.add((key, pressed_s))
        await self._take_turns()

    async def _take_turns(self) -> None:
        """What was typed, in turn, as far as the screens have come."""
        while (typed := self._turns.next()) is not None:
            event, pressed_s = typed
            if isinstance(event, events.Key) and (self._keeps_back(event, pressed_s) or self._typed(event)):
                continue
            turn, target, screen = self._turns.begin(), self.focused or self.screen, self.screen
            await super().on_event(event)
            if not target.post_message(KeyHandled(turn, target, screen)):
                self._turns.end(turn)
        if held_up := self._turns.held_up_by:
            self.set_timer(MAX_KEY_S, lambda: self.post_message(KeyHandled(held_up)))

    async def on_key_handled(self, message: KeyHandled) -> None:
        """What it made fields say comes up behind it; then the cursor goes where it shall be; then the next one."""
        if message.target is not None and message.target.post_message(KeyHandled(message.turn, None, message.screen)):
            return
        if message.screen is not None and self.screen_stack and self.screen is not message.screen:
            self.screen.call_after_refresh(self.call_later, self._end_turn, message.turn)
        else:
            self.call_later(self._end_turn, message.turn)

    async def _end_turn(self, turn: int) -> None:
        """The next one."""
        if self._turns.end(turn):
            await self._take_turns()

    def _keeps_back(self, key: events.Key, pressed_s: float) -> bool:
        """Whether the key was meant for a question that had just closed by itself; that is told."""
        if self._stops(key) or not self._guard.keeps_back(pressed_s):
            return False
        shown = key.character if key.is_printable and key.key != "space" else human(key.key)
        self.notice(f"{shown} NOT TAKEN, a question had just closed: {self._guard.why}", Severity.CAUTION)
        return True

    def pop_screen(self) -> AwaitComplete:
        """See `App`. Keys behind a question that closed by itself were still meant for it."""
        if why := getattr(self.screen, "closed_by_itself", ""):
            self._guard.begin(why, self.clock.now())
        return super().pop_screen()

    def _stops(self, key: events.Key) -> bool:
        """Whether the key holds everybody now."""
        status = self.feed.status
        if status is None or status.run is RunPhase.IDLE or isinstance(self.focused, Input) or _is_typing(self.screen):
            return False
        bound = self.screen.active_bindings.get(key.key)
        return bound is not None and bound.binding.action.removeprefix("app.") == "start_stop"

    # ------------------------------------------------------------ selection

    def action_select(self) -> None:
        """Begin to type which vehicles."""
        self._enter(LineEntry(names=True))

    def _enter(self, entry: LineEntry | None) -> None:
        self._entry = entry
        self._prompt()

    def _typed(self, key: events.Key) -> bool:
        """Whether the key went into the line that is being typed. One that cannot is a key as ever, and ends it."""
        entry = self._entry
        if isinstance(self.screen, ModalScreen) or isinstance(self.focused, Input) or _is_typing(self.screen):
            return False
        if entry is None and key.key == "escape" and self.close_result():
            return True
        if entry is None:
            return self._begins(key)
        if entry.press(key):
            self._enter(entry if entry.text or key.key != "backspace" else None)
            return True
        self._enter(None)
        if key.key == "enter" and entry.text:
            self._choose(entry.text)
        return key.key in ("enter", "escape")

    def _begins(self, key: events.Key) -> bool:
        """Whether the key begins such a line. Here and not by a binding: the next key may come before that is run."""
        if key.key in self.keymap.get("app.select", ",".join(action_named("select").keys)).split(","):
            self.action_select()
        elif getattr(self.screen, "DIGITS_SELECT", False) and (key.character or "").isdecimal():
            self._enter(LineEntry(str(key.character)))
        else:
            return False
        return True

    def _choose(self, text: str) -> None:
        selection = self.feed.selection
        fleet = self.feed.scenario.scenario.name if self.feed.scenario is not None else ""
        trouble = ""
        try:
            if self._groups is not None:
                selection.groups = self._groups.of(fleet)
        except GroupsError as error:
            trouble = f"   groups: {error}"
        try:
            choice = selection.choose(text, self.feed.known_vehicles())
            if choice.save_as and self._groups is not None:
                self._groups.keep(fleet, choice.save_as, choice.ids)
        except (SelectionError, GroupsError) as error:
            self.notice(f"not selected: {error}{trouble}", Severity.CAUTION)
            return
        saved = f"{choice.save_as} {'saved' if choice.ids else 'forgotten'}: " if choice.save_as else ""
        self.notice(
            f"{saved}selected {ids(choice.ids) or 'nobody'}{trouble}",
            Severity.CAUTION if trouble else Severity.NORMAL,
        )

    # ------------------------------------------------------------ screens

    def action_show_fly(self) -> None:
        """The fly screen."""
        self.switch_mode("fly")

    def action_show_plan(self) -> None:
        """The plan screen; a replay has no scenario to edit."""
        if self._replay:
            self.notice("a replay has no plan: this is a recording", Severity.CAUTION)
            return
        self.switch_mode("plan")

    def action_show_vehicles(self) -> None:
        """The whole fleet as a grid or a table."""
        self.switch_mode("vehicles")

    def action_show_planners(self) -> None:
        """Teams, how well they do, and all that their planners count."""
        from tui_gcs.screens.fly.planners_dialog import PlannersDialog  # when first shown

        self.push_screen(PlannersDialog(self.feed, self.glyphs))

    def action_show_journal(self) -> None:
        """What happened."""
        self.switch_mode("journal")

    def action_show_help(self) -> None:
        """All keys of this screen, and what works now."""
        everywhere = with_keys(APP_ACTIONS, APP, self.keymap)
        self.push_screen(HelpDialog((*self._own_actions(), *everywhere), self.feed.action_context(), self.glyphs))

    def action_palette(self) -> None:
        """Find an action by name, and do it."""
        self.push_screen(PaletteDialog(self._entries(), self.glyphs), self._run_chosen)

    def _own_actions(self) -> tuple[ConsoleAction, ...]:
        actions: tuple[ConsoleAction, ...] = getattr(self.screen, "ACTIONS", ())
        return with_keys(actions, self.current_mode, self.keymap)

    def _entries(self) -> list[Entry]:
        situation = self.feed.action_context()
        return [
            *order_entries(situation),
            *entries_of(with_keys(APP_ACTIONS, APP, self.keymap), APP, situation),
            *entries_of(self._own_actions(), self.current_mode, situation),
        ]

    async def _run_chosen(self, run: str | None) -> None:
        if run is not None:
            await self.run_action(run, self.screen if run.startswith("screen.") else self)

    def action_detach(self) -> None:
        """Leave; everything else goes on. Edits on the plan screen that nobody else has are asked about first."""
        plan = self._plan
        forgotten = plan is not None and self.screen is not plan and plan.model.changes and plan.model.unsaved
        if forgotten and not self._leaving:
            self._leaving = True
            self.notice("plan edits are neither applied nor saved: q again leaves without them", Severity.CAUTION)
            self.set_timer(NOTICE_S, self._stay)
            return
        self.exit()

    def _stay(self) -> None:
        self._leaving = False

    # ------------------------------------------------------------ alarms

    def action_acknowledge(self) -> None:
        """What the second line shows that nobody had seen was seen."""
        first = self._to_answer()
        if first is None:
            self.notice("nothing to acknowledge")
        elif self.clock.now() - self._alarm_since_s < REACTION_S:
            self.notice("another alarm is shown now: look at it, then a again", Severity.CAUTION)
        else:
            self.ask_quietly(Acknowledge(raised={first.cause: first.raised}), "acknowledge")

    def _to_answer(self) -> Alarm | None:
        """The alarm that `a` acknowledges."""
        return to_answer(self.feed.alarms)

    def action_show_alarms(self) -> None:
        """All alarms."""
        self.push_screen(AlarmScreen(self.feed, self.ask_quietly, self.glyphs, self.clock))

    def action_toggle_bell(self) -> None:
        """This console's bell."""
        self.bell_rings.is_on = not self.bell_rings.is_on
        self.notice("the bell is on" if self.bell_rings.is_on else "the bell is OFF: alarms are silent on this console")

    # ------------------------------------------------------------ the second line

    def notice(self, text: str, level: Severity = Severity.NORMAL, about: str = "") -> None:
        """Say something for a while, beside the alarm if there is one; the journal has it, too. See `Notices`."""
        self.feed.note(text, NOTE_SEVERITIES[level])
        self._notices.tell(Notice(text, level), about)
        self.feed.show_notice(self._notices.line())
        self.set_timer(NOTICE_S + 0.1, lambda: self.feed.show_notice(self._notices.line()))

    def _prompt(self) -> None:
        text = f"select {self._entry.text}_    {SELECT_HELP}" if self._entry is not None else ""
        if self._chord.is_waiting(self.clock.now()):
            text = "! ALL vehicles:  h HOLD   r return   l land here    (Esc: no)"
            self.set_timer(PREFIX_S + 0.1, self._prompt)
        for lines in self._top_lines():
            lines.alarm_line.set_prompt(text)
        for screen in self.screen_stack[-1:]:  # none while the console ends
            if isinstance(screen, TinyScreen):
                screen.tiny_lines.set_prompt(text)

    def _top_lines(self) -> list[TopLines]:
        return [lines for screen in self.screen_stack for lines in screen.query(TopLines)]


def _is_typing(screen: Screen[object]) -> bool:
    """Whether keys are letters of something that a screen reads itself."""
    return bool(getattr(screen, "is_typing", False))
