"""The console: screens over a feed. Its only input is the bus, its only output are requests.

Losing it loses nothing: the station flies on, and another console shows the same.
"""

import asyncio
import contextlib
import os
import signal
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

from textual import events
from textual.binding import BindingType
from textual.screen import Screen

from tui_gcs import slow
from tui_gcs.actions import APP_ACTIONS, bindings
from tui_gcs.core.bus import Bus
from tui_gcs.core.clock import Clock, MonotonicClock
from tui_gcs.core.messages import Acknowledge, Hold, Kind, Reply, Request, Resume, Return, RunPhase, Start, SwitchRound
from tui_gcs.core.overlays import Overlay
from tui_gcs.feed import PERIOD_S, DisplayLagged, Feed, StatusUpdated
from tui_gcs.hold_chord import PREFIX_S, HoldChord
from tui_gcs.screens.alarms import AlarmScreen
from tui_gcs.screens.dialogs import HelpDialog, ResultDialog, RoundDialog, StartDialog
from tui_gcs.screens.fly import FlyScreen
from tui_gcs.screens.start_plan import start_plan
from tui_gcs.screens.tiny import MIN_COLUMNS, MIN_ROWS, TinyScreen
from tui_gcs.thin_app import ThinApp
from tui_gcs.widgets.alarm_bell import AlarmBell
from tui_gcs.widgets.alarm_line import Notice
from tui_gcs.widgets.driver import lagging
from tui_gcs.widgets.glyphs import GlyphSet, glyph_set, wants_ascii
from tui_gcs.widgets.levels import Level
from tui_gcs.widgets.top_lines import TopLines
from tui_gcs.widgets.words import ids

if TYPE_CHECKING:
    from tui_gcs.screens.plan import PlanScreen

NOTICE_S = 8.0
HOLD_TRIES = 3
NOTE_SEVERITIES = {Level.NORMAL: 6, Level.GREY: 6, Level.CAUTION: 4, Level.WARNING: 4}
"""MAV_SEVERITY of what is told, in the journal."""


class ConsoleApp(ThinApp):
    """Attach to the station on `bus` and show it."""

    TITLE = "tui-gcs"
    ENABLE_COMMAND_PALETTE = False
    ALLOW_SELECT = False
    BINDINGS: ClassVar[list[BindingType]] = bindings(APP_ACTIONS)
    CSS = """
    Screen { background: #101418; color: #d8dee4; }
    ModalScreen { background: #101418 40%; }
    """

    def __init__(
        self,
        bus: Bus,
        principal: str = "",
        kind: Kind = Kind.SIM,
        *,
        replay: bool = False,
        glyphs: GlyphSet | None = None,
        clock: Clock | None = None,
        overlays: Sequence[Overlay] = (),
    ) -> None:
        """A console for a station of this kind; in a replay nothing can be commanded. `overlays` go onto the map."""
        # Without colour only Textual's ANSI mode leaves bold and reverse alone (facts/terminal.md B8).
        super().__init__(ansi_color=True if "NO_COLOR" in os.environ else None)
        self.kind = kind
        self.glyphs = glyphs or glyph_set(wants_ascii(os.environ, getattr(sys.__stdout__, "encoding", None)))
        self._clock = clock or MonotonicClock()
        self.feed = Feed(
            bus,
            principal or f"console-{os.getpid()}",
            clock=self._clock,
            period_s=slow.PERIOD_S if slow.wants_slow() else PERIOD_S,
            may_paint=lambda: not lagging(self._driver),
        )
        if replay:
            self.feed.read_only = "replay: nothing is commanded from here"
        self._replay = replay
        self._overlays = tuple(overlays)
        self._chord = HoldChord()
        self._notices = 0
        self.bell_rings = AlarmBell()
        self._leaving = False
        self._plan: PlanScreen | None = None
        self.add_mode("fly", self._fly_screen)
        self.add_mode("plan", self._plan_screen)

    def _fly_screen(self) -> Screen[None]:
        screen = FlyScreen(self.feed, glyphs=self.glyphs)
        screen.map_view.set_overlays(self._overlays)
        return screen

    def _plan_screen(self) -> Screen[None]:
        from tui_gcs.screens.plan import PlanScreen  # when first shown: the first frame does not wait for it

        self._plan = PlanScreen(self.feed, glyphs=self.glyphs)
        return self._plan

    # ------------------------------------------------------------ life

    def on_mount(self) -> None:
        """Open the feed; leave in good order when the terminal or the system says so."""
        loop = asyncio.get_running_loop()
        for number in (signal.SIGTERM, signal.SIGHUP):
            with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):  # not in the main thread
                loop.add_signal_handler(number, self.exit)
        self.feed.listen(self)
        self.feed.open()
        self.switch_mode("fly")

    def on_unmount(self) -> None:
        """Leave the bus."""
        self.feed.close()

    def on_status_updated(self, message: StatusUpdated) -> None:
        """Ring for alarms; never command a station of another kind than the one this console was opened for."""
        if self.bell_rings.rings(message.status.alarms, self._clock.now()):
            self.bell()
        kind = message.status.kind
        if kind is not self.kind and not self.feed.read_only:
            self.feed.read_only = f"read-only: opened for {self.kind}, but this station is {kind}"

    def on_display_lagged(self, _message: DisplayLagged) -> None:
        """Say that the picture stood still."""
        self.notice("DISPLAY LAGGED: this terminal had stopped reading; the picture is fresh again", Level.CAUTION)

    def on_resize(self, event: events.Resize) -> None:
        """Below 80x24 only the essentials."""
        self.redraw()
        small = event.size.width < MIN_COLUMNS or event.size.height < MIN_ROWS
        shown = isinstance(self.screen, TinyScreen)
        if small and not shown:
            self.push_screen(TinyScreen(self.feed, glyphs=self.glyphs))
        elif not small and shown:
            self.pop_screen()

    async def on_event(self, event: events.Event) -> None:
        """Keys pass the HOLD ALL chord first: dialogs, forms and small terminals cannot swallow it."""
        if not isinstance(event, events.Key) or event.is_forwarded:
            await super().on_event(event)
            return
        was_waiting = self._chord.waiting
        hold, keys = self._chord.press(event, self._clock.now())
        if was_waiting or self._chord.waiting:
            self._prompt()
        if hold:
            self.action_hold_all()
        for key in keys:
            await super().on_event(key)

    # ------------------------------------------------------------ screens

    def action_show_fly(self) -> None:
        """The fly screen."""
        self.switch_mode("fly")

    def action_show_plan(self) -> None:
        """The plan screen; a replay has no scenario to edit."""
        if self._replay:
            self.notice("a replay has no plan: this is a recording", Level.CAUTION)
            return
        self.switch_mode("plan")

    def action_show_help(self) -> None:
        """All keys of this screen."""
        own = getattr(self.screen, "ACTIONS", ())
        self.push_screen(HelpDialog((*APP_ACTIONS, *own), self.glyphs))

    def action_detach(self) -> None:
        """Leave; everything else goes on. Edits on the plan screen that nobody else has are asked about first."""
        plan = self._plan
        forgotten = plan is not None and self.screen is not plan and plan.model.changes and plan.model.unsaved
        if forgotten and not self._leaving:
            self._leaving = True
            self.notice("plan edits are neither applied nor saved: q again leaves without them", Level.CAUTION)
            self.set_timer(NOTICE_S, self._stay)
            return
        self.exit()

    def _stay(self) -> None:
        self._leaving = False

    # ------------------------------------------------------------ commands

    def action_start_stop(self) -> None:
        """Start on the ground (asks), HOLD in flight (does not ask)."""
        status = self.feed.status
        if status is None or self.feed.station_lost:
            self.notice("the station is not heard: nothing sent.  !h tries HOLD ALL", Level.CAUTION)
        elif status.run is RunPhase.HOLD:
            self.notice("holding.  Enter: resume   r: return and land")
        elif status.run is not RunPhase.IDLE:
            self._send(Hold(), "HOLD", tries=HOLD_TRIES)
        else:
            self._ask_start()

    def action_hold_all(self) -> None:
        """HOLD everything now, whatever is on the screen."""
        self._send(Hold(), "HOLD ALL", tries=HOLD_TRIES)

    def action_return_and_land(self) -> None:
        """Return and land, from flight or hold."""
        status = self.feed.status
        if status is not None and status.run is RunPhase.IDLE and not status.armed:
            self.notice("nothing is armed: nothing to return")
            return
        self._send(Return(), "return and land", tries=HOLD_TRIES)

    def on_fly_screen_resumed(self) -> None:
        """Enter in hold: the planner goes on."""
        status = self.feed.status
        if status is not None and status.run is RunPhase.HOLD and not self.feed.station_lost:
            self._send(Resume(), "resume")

    def on_fly_screen_typing(self, message: FlyScreen.Typing) -> None:
        """Show the digits of a vehicle number."""
        self._prompt(f"vehicle {message.digits}_   Enter selects, Esc forgets" if message.digits else "")

    def action_choose_round(self) -> None:
        """Ask which round."""
        status = self.feed.status
        if status is None or not status.rounds:
            self.notice("no rounds: the station is not heard", Level.CAUTION)
            return
        flying = status.run is not RunPhase.IDLE
        dialog = RoundDialog(status.rounds, status.round_index, flying, self.glyphs)
        self.push_screen(dialog, self._switch_round)

    def _switch_round(self, index: int | None) -> None:
        if index is not None:
            self._send(SwitchRound(index=index), f"round {index + 1}")

    def _ask_start(self) -> None:
        feed = self.feed
        if feed.read_only:
            self.notice(feed.read_only, Level.CAUTION)
            return
        if feed.scenario is None or feed.status is None or feed.frame is None:
            self.notice("no scenario or no fleet yet: nothing to start", Level.CAUTION)
            return
        scenario = feed.scenario.scenario
        plan = start_plan(scenario, feed.status, feed.frame)

        def answered(yes: bool | None) -> None:
            if yes:
                self._send(Start(vehicles=plan.vehicles), f"start {ids(plan.vehicles)}")
            else:
                self.notice("start cancelled: nothing sent")

        self.push_screen(
            StartDialog(plan, feed.status.kind, scenario.link_loss, feed, self.glyphs, self._clock), answered
        )

    def _send(self, request: Request, title: str, *, tries: int = 1) -> None:
        self.run_worker(self._ask(request, title, tries), group="requests", exit_on_error=False)

    async def _ask(self, request: Request, title: str, tries: int) -> None:
        self.notice(f"{title}: sent")
        self._report(title, await self.feed.request(request, tries=tries))

    def _report(self, title: str, reply: Reply) -> None:
        """Partial success is never shown as success: a refusal opens the list of vehicles."""
        refused = [result.vehicle for result in reply.results if not result.ok]
        if refused:
            self.push_screen(
                ResultDialog(f"{title}: refused for {ids(refused)}", reply.text, reply.results, self.glyphs)
            )
            self.notice(f"{title}: refused for {ids(refused)}", Level.CAUTION)
        elif reply.ok:
            count = f" for {len(reply.results)} vehicles" if reply.results else ""
            self.notice(f"{title}: accepted{count}" + (f"  {reply.text}" if reply.text else ""))
        else:
            self.notice(f"{title} NOT DONE: {reply.text}", Level.WARNING)

    # ------------------------------------------------------------ alarms

    def action_acknowledge(self) -> None:
        """The alarm on the second line was seen."""
        status = self.feed.status
        first = next((a for a in status.alarms if a.state in ("new", "over")), None) if status is not None else None
        if first is None or self.feed.station_lost:
            self.notice("nothing to acknowledge")
        else:
            self.ask_about_alarms(Acknowledge(raised={first.cause: first.raised}), "acknowledge")

    def ask_about_alarms(self, request: Request, title: str) -> None:
        """Acknowledge or shelve: nothing is told unless it could not be done."""

        async def ask() -> None:
            reply = await self.feed.request(request)
            if not reply.ok:
                self.notice(f"{title} NOT DONE: {reply.text}", Level.CAUTION)

        self.run_worker(ask(), group="requests", exit_on_error=False)

    def action_show_alarms(self) -> None:
        """All alarms."""
        self.push_screen(AlarmScreen(self.feed, self.ask_about_alarms, self.glyphs))

    def action_toggle_bell(self) -> None:
        """This console's bell."""
        self.bell_rings.is_on = not self.bell_rings.is_on
        self.notice("the bell is on" if self.bell_rings.is_on else "the bell is OFF: alarms are silent on this console")

    # ------------------------------------------------------------ the second line

    def notice(self, text: str, level: Level = Level.NORMAL) -> None:
        """Say something for a while, beside the alarm if there is one; the journal has it, too."""
        self.feed.note(text, NOTE_SEVERITIES[level])
        self._notices += 1
        number = self._notices
        for lines in self._top_lines():
            lines.alarm_line.set_notice(Notice(text, level))

        def forget() -> None:
            if number == self._notices:
                for lines in self._top_lines():
                    lines.alarm_line.set_notice(Notice(""))

        self.set_timer(NOTICE_S, forget)

    def _prompt(self, text: str = "") -> None:
        if self._chord.waiting:
            text = "! HOLD ALL: press h    (Esc: no)"
            self.set_timer(PREFIX_S, self._prompt_over)
        for lines in self._top_lines():
            lines.alarm_line.set_prompt(text)

    def _prompt_over(self) -> None:
        for lines in self._top_lines():
            lines.alarm_line.set_prompt("")

    def _top_lines(self) -> list[TopLines]:
        return [lines for screen in self.screen_stack for lines in screen.query(TopLines)]
