"""The console: screens over a feed. Its only input is the bus, its only output are requests.

When it is closed nothing is lost: the station flies on, and another console shows the same.
"""

import asyncio
import contextlib
import os
import signal
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar

from textual import events
from textual.await_complete import AwaitComplete
from textual.binding import BindingType
from textual.screen import Screen
from textual.widget import AwaitMount

from tui_gcs.actions import APP, APP_ACTIONS, ConsoleAction, bindings
from tui_gcs.actions.action import on_screen
from tui_gcs.actions.keymap import with_keys
from tui_gcs.actions.palette.entries import Entry, entries_of, order_entries
from tui_gcs.actions.replay_actions import REPLAY_ACTIONS, REPLAY_SCOPE
from tui_gcs.client.user_settings import THEMES
from tui_gcs.console.alarm_acknowledgement import AlarmAcknowledgement, AlarmBell
from tui_gcs.console.commands import CommandController
from tui_gcs.console.idle_garbage import LOOK_S, IdleGarbage
from tui_gcs.console.key_input import CHORD_HELP, CHORD_S, KeyInput
from tui_gcs.console.order_results import FOLLOW_S, OrderResults
from tui_gcs.console.parts import ConsoleOptions, ConsoleParts
from tui_gcs.console.preload import AFTER_S, preload_screens
from tui_gcs.console.selection_entry import SelectionEntry
from tui_gcs.core.base.clock import Clock, MonotonicClock
from tui_gcs.core.protocol.bus import Bus
from tui_gcs.core.protocol.common import AddPoints, RunKind
from tui_gcs.core.protocol.replay import ControlReplay, ReplayAct
from tui_gcs.feed.feed import PERIOD_S, Feed
from tui_gcs.feed.live_watch import LOOK_S as LIVE_LOOK_S
from tui_gcs.feed.live_watch import LiveWatch
from tui_gcs.feed.messages import DisplayLagged, FleetUpdated, StatusUpdated
from tui_gcs.feed.notices import NOTICE_S, Notice, NoticeBoard, Severity
from tui_gcs.feed.plots.value_recorder import ValueRecorder
from tui_gcs.screens.common.help import HelpDialog
from tui_gcs.screens.common.map_screen import MapScreen
from tui_gcs.screens.common.text_dialog import BESIDE
from tui_gcs.screens.common.time_dialog import TimeDialog
from tui_gcs.screens.common.tiny_screen import MIN_COLUMNS, MIN_ROWS, TinyScreen
from tui_gcs.screens.fly.fly_screen import FlyScreen
from tui_gcs.screens.logs.alarms_screen import AlarmScreen
from tui_gcs.screens.preflight.preflight_screen import Operator
from tui_gcs.terminal.input_filter import InputDropped
from tui_gcs.terminal.key_queue import KeyHandled
from tui_gcs.terminal.terminal_options import SLOW_PERIOD_S, wants_slow
from tui_gcs.terminal.themes import THEMES as DISPLAY_THEMES
from tui_gcs.terminal.variant import TerminalApp
from tui_gcs.widgets.basics.glyphs import glyph_set, wants_ascii
from tui_gcs.widgets.basics.shown_keys import use_keys
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.map.base_map_layer import BaseMapTiles

if TYPE_CHECKING:
    from tui_gcs.actions.palette.own_commands import OwnCommands
    from tui_gcs.screens.common.point_prompt import PointPrompt
    from tui_gcs.screens.plan.plan_screen import PlanScreen

REPLAY_WORDS = "replay: nothing is commanded from here"
NOTE_SEVERITIES = {Severity.NORMAL: 6, Severity.GREY: 6, Severity.CAUTION: 4, Severity.WARNING: 4}
"""MAV_SEVERITY of a notice in the station's journal."""


class ConsoleApp(TerminalApp):
    """Attaches to the station on a bus and shows it; what the operator does is in the parts (`console`)."""

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
        options: ConsoleOptions | None = None,
        *,
        clock: Clock | None = None,
    ) -> None:
        """Show a station of this kind, asking as `principal`; empty for a name with this process's number."""
        super().__init__()
        self.options = options = options or ConsoleOptions()
        self.own_commands = options.own_commands
        self._base_map = BaseMapTiles(options.base_map) if options.base_map is not None else None
        if options.theme:
            self.display_theme = options.theme
        self.kind = kind
        self.keymap = options.keymap
        use_keys(self.keymap)
        self.glyphs = options.glyphs or glyph_set(wants_ascii(os.environ, getattr(sys.__stdout__, "encoding", None)))
        self.clock = clock or MonotonicClock()
        self.feed = Feed(
            bus,
            principal or f"console-{os.getpid()}",
            clock=self.clock,
            period_s=SLOW_PERIOD_S if wants_slow() else PERIOD_S,
            may_paint=lambda: not self.is_lagging,
        )
        self.feed.starts_station = options.starts_station
        if options.replay:
            self.feed.requests.read_only = REPLAY_WORDS
        elif options.read_only:
            self.feed.requests.read_only = "read-only: started with --read-only"
        parts = ConsoleParts(self, self.feed, self.glyphs, self.clock, self.notice)
        self.operator = Operator(options.settings.text("operator"))
        self.results = OrderResults(parts)
        self.commands = CommandController(parts, self.results, self.operator)
        self.commands.unapplied = lambda: self._plan.model.changes if self._plan is not None else 0
        self.bell_rings = AlarmBell()
        self._acknowledgement = AlarmAcknowledgement(parts, self.commands.ask_quietly)
        self.recorder = ValueRecorder(self.feed.requests)
        self._garbage = IdleGarbage()
        self._entry = SelectionEntry(parts, options.groups, self.keymap, self._prompt)
        self.keys = KeyInput(
            parts, self.commands, self.results, self._entry, self._garbage, super().on_event, self._prompt
        )
        self._notices = NoticeBoard(self.clock.now)
        self._leaving = False
        self._plan: PlanScreen | None = None
        self._fly: FlyScreen | None = None
        for mode, screen in self._screens().items():
            self.add_mode(mode, screen)

    def _screens(self) -> dict[str, Callable[[], Screen[None]]]:
        """What makes the screen of each mode, when it is first shown."""
        return {
            "fly": self._fly_screen,
            "plan": self._plan_screen,
            "missions": self._missions_screen,
            "vehicles": self._vehicles_screen,
            "journal": self._journal_screen,
            "parameters": self._parameters_screen,
            "inspector": self._inspector_screen,
            "links": self._links_screen,
            "tasks": self._tasks_screen,
            "plots": self._plots_screen,
            "flights": self._flights_screen,
            "rehearsals": self._rehearsals_screen,
            "traffic": self._traffic_screen,
            "onboard": self._onboard_screen,
            "setup": self._setup_screen,
            "settings": self._settings_screen,
            "planner_log": self._planner_log_screen,
        }

    def _fly_screen(self) -> Screen[None]:
        self._fly = screen = FlyScreen(self.feed, glyphs=self.glyphs)
        screen.map_view.set_overlays(tuple(self.options.overlays))
        screen.map_view.content.elevation = self.options.elevation
        screen.map_view.set_base_map(self._base_map)
        return screen

    # The other screens are imported when they are first shown: the first frame does not wait for them.

    def _plan_screen(self) -> Screen[None]:
        from tui_gcs.screens.plan.plan_screen import PlanScreen

        self._plan = PlanScreen(self.feed, self.clock, folder=self.options.folder, glyphs=self.glyphs)
        self._plan.map_view.content.elevation = self.options.elevation
        self._plan.map_view.set_base_map(self._base_map)
        return self._plan

    def _missions_screen(self) -> Screen[None]:
        from tui_gcs.screens.missions.missions_screen import MissionsScreen

        screen = MissionsScreen(self.feed, self.clock, folder=self.options.folder, glyphs=self.glyphs)
        screen.set_elevation(self.options.elevation)
        screen.map_view.set_base_map(self._base_map)
        return screen

    def _vehicles_screen(self) -> Screen[None]:
        from tui_gcs.screens.vehicles.vehicles_screen import VehiclesScreen

        return VehiclesScreen(self.feed, glyphs=self.glyphs)

    def _journal_screen(self) -> Screen[None]:
        from tui_gcs.screens.logs.journal_screen import JournalScreen

        return JournalScreen(self.feed, glyphs=self.glyphs)

    def _parameters_screen(self) -> Screen[None]:
        from tui_gcs.screens.parameters.parameters_screen import ParametersScreen

        return ParametersScreen(self.feed, self.clock, folder=self.options.folder, glyphs=self.glyphs)

    def _inspector_screen(self) -> Screen[None]:
        from tui_gcs.screens.inspect.inspector_screen import InspectorScreen

        return InspectorScreen(self.feed, self.clock, glyphs=self.glyphs)

    def _links_screen(self) -> Screen[None]:
        from tui_gcs.screens.links.links_screen import LinksScreen

        return LinksScreen(self.feed, self.clock, glyphs=self.glyphs)

    def _tasks_screen(self) -> Screen[None]:
        from tui_gcs.screens.tasks.tasks_screen import TasksScreen

        return TasksScreen(self.feed, self.clock, glyphs=self.glyphs)

    def _plots_screen(self) -> Screen[None]:
        from tui_gcs.screens.plots.live_plots_screen import LivePlotsScreen

        return LivePlotsScreen(self.feed, self.recorder, folder=self.options.folder, glyphs=self.glyphs)

    def _onboard_screen(self) -> Screen[None]:
        from tui_gcs.screens.flights.vehicle_logs_screen import VehicleLogsScreen

        return VehicleLogsScreen(self.feed, self.clock, glyphs=self.glyphs)

    def _flights_screen(self) -> Screen[None]:
        from tui_gcs.core.records.flight_archive import FlightArchive
        from tui_gcs.screens.flights.flights_screen import FlightsScreen

        return FlightsScreen(self.feed, self.clock, FlightArchive(self.options.recordings), glyphs=self.glyphs)

    def _rehearsals_screen(self) -> Screen[None]:
        from tui_gcs.screens.rehearsals.rehearsals_screen import RehearsalsScreen

        state = self.options.recordings.get(RunKind.SIM)
        return RehearsalsScreen(self.feed, self.clock, state, self.commands.unapplied, self.notice, glyphs=self.glyphs)

    def _traffic_screen(self) -> Screen[None]:
        from tui_gcs.screens.traffic.traffic_screen import TrafficScreen

        def cursor() -> tuple[float, float] | None:
            return self._fly.cursor_m if self._fly is not None else None

        return TrafficScreen(self.feed, self.clock, cursor=cursor, glyphs=self.glyphs)

    def _planner_log_screen(self) -> Screen[None]:
        from tui_gcs.screens.logs.planner_log_screen import PlannerLogScreen

        return PlannerLogScreen(self.feed, glyphs=self.glyphs)

    def _setup_screen(self) -> Screen[None]:
        from tui_gcs.screens.setup.setup_screen import SetupScreen

        return SetupScreen(self.feed, self.clock, glyphs=self.glyphs)

    def _settings_screen(self) -> Screen[None]:
        from tui_gcs.screens.settings.settings_screen import SettingsScreen

        use = (self._use_setting, self._use_commands)
        return SettingsScreen(self.feed, self.options.settings, *use, glyphs=self.glyphs)

    def _use_setting(self, key: str, value: str) -> None:
        """Take a setting that counts at once; "" is its default."""
        if key == "theme":
            names = list(DISPLAY_THEMES)
            self.display_theme = names[THEMES.index(value)] if value else names[0]
        elif key == "operator":
            self.operator.name = value

    def _use_commands(self, commands: "OwnCommands") -> None:
        """Take the operator's own commands, which were changed."""
        self.own_commands = commands

    def on_mount(self) -> None:
        """Open the feed; leave in good order when the terminal or the system asks for it."""
        loop = asyncio.get_running_loop()
        # SIGHUP is a dropped SSH session: without handlers it kills the process with the terminal in a bad state
        # (docs/terminal.md B4).
        for number in (signal.SIGTERM, signal.SIGHUP):
            with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):  # not in the main thread
                loop.add_signal_handler(number, self.exit)
        self.set_keymap(self.keymap)
        self.feed.listen(self)
        self.feed.open()
        self.set_interval(FOLLOW_S, self.results.follow)
        self._garbage.begin(self.clock.now())
        self.set_interval(LOOK_S, lambda: self._garbage.look(self.clock.now()))
        self.set_timer(AFTER_S, preload_screens)
        self.switch_mode("fly")

    def on_unmount(self) -> None:
        """Leave the bus, and Python's garbage collection to itself."""
        self._garbage.end()
        self.feed.close()

    def on_fleet_updated(self, message: FleetUpdated) -> None:
        """Record telemetry for plots, and compare with it what was ordered."""
        self.recorder.take_frame(message.frame)
        self.results.update()

    def on_status_updated(self, message: StatusUpdated) -> None:
        """Ring for alarms, and refuse to command a station of another kind than this console was opened for."""
        self._acknowledgement.update()
        self.recorder.take_status(message.status)
        if self.bell_rings.rings(message.status.alarms, self.clock.now()):
            self.bell()
        kind = message.status.kind
        if kind is not self.kind and not self.feed.requests.read_only:
            self.feed.requests.read_only = f"read-only: opened for {self.kind}, but this station is {kind}"

    def on_display_lagged(self, _message: DisplayLagged) -> None:
        """Report that the picture stood still."""
        self.notice("DISPLAY LAGGED: this terminal had stopped reading; the picture is fresh again", Severity.CAUTION)

    def on_input_dropped(self, message: InputDropped) -> None:
        """Report what was not taken: an operator pasted more than a line, or a mouse went wild."""
        text = f"{message.characters} characters came at once and were NOT TAKEN: paste at most one line"
        self.notice(text, Severity.CAUTION)

    def on_map_screen_resume_requested(self) -> None:
        """Resume after a hold; Enter does nothing else on a map."""
        self.commands.resume_by_enter()

    def on_point_prompt_typed(self, message: "PointPrompt.Typed") -> None:
        """Send a task that was typed on a map."""
        self.commands.ask_quietly(AddPoints((message.point,)), "task", "S a, then Tab, lists and cancels it")

    def on_point_prompt_remark(self, message: "PointPrompt.Remark") -> None:
        """Report why no task is sent."""
        self.notice(message.text, Severity.CAUTION)

    def on_resize(self, event: events.Resize) -> None:
        """Show only the essentials on a terminal of less than 80x24."""
        # A terminal keeps or wraps old cells when it is resized: what it shows is not known any more.
        self.redraw()
        small = event.size.width < MIN_COLUMNS or event.size.height < MIN_ROWS
        shown = isinstance(self.screen, TinyScreen)
        if small and not shown:
            self.push_screen(TinyScreen(self.feed, glyphs=self.glyphs))
        elif not small and shown:
            self.pop_screen()
        self.call_after_refresh(self.results.fit)

    async def on_event(self, event: events.Event) -> None:
        """Give keys to `KeyInput` first: no dialog, form or small terminal can swallow the chord for all vehicles."""
        if isinstance(event, events.Key | events.Paste) and not event.is_forwarded:
            await self.keys.take(event)
        else:
            await super().on_event(event)

    async def on_key_handled(self, message: KeyHandled) -> None:
        """Let the next key go; see `KeyInput.on_handled`."""
        await self.keys.on_handled(message)

    def pop_screen(self) -> AwaitComplete:
        """See `App`. Keys behind a question that closed by itself were still meant for it."""
        if why := getattr(self.screen, "closed_by_itself", ""):
            self.keys.note_closed(why)
        return super().pop_screen()

    def action_command(self, name: str) -> None:
        """Carry out a command of the action table by its id."""
        self.commands.by_name[name]()

    def action_order(self, order_id: str) -> None:
        """Ask about one order to the selected vehicles."""
        self.commands.order(order_id)

    def action_select(self) -> None:
        """Begin to type which vehicles are meant."""
        self._entry.begin()

    def action_show(self, mode: str) -> None:
        """Change to the screen of a mode; a replay has no scenario to edit."""
        self._show(mode)

    def _show(self, mode: str) -> AwaitMount | None:
        """Do `action_show`; return what waits until the screen is there, None if it is not shown."""
        if mode == "plan" and self.options.replay:
            self.notice("a replay has no plan: this is a recording", Severity.CAUTION)
            return None
        return self.switch_mode(mode)

    async def action_command_line(self, line: str) -> None:
        """Carry out a line that was typed after `:`, step by step."""
        from tui_gcs.console.command_line import CommandLine, CommandLineParts  # when first typed

        parts = CommandLineParts(
            self._entries, self._show, self._entry.choose, self.commands.order, self._run_chosen, self.notice
        )
        await CommandLine(self.own_commands, parts).run(line)

    def action_show_menu(self) -> None:
        """Show the menu of the screens that have no key of their own."""
        from tui_gcs.screens.common.screens_menu import ScreensMenu  # when first shown

        self.push_screen(ScreensMenu(self.glyphs), self._run_chosen)

    def action_show_checks(self) -> None:
        """Show what is checked before a start."""
        self.commands.show_checks()

    def action_show_planners(self) -> None:
        """Show teams, how well they do, and all that their planners count."""
        from tui_gcs.screens.fly.planners_dialog import PlannersDialog  # when first shown

        self.push_screen(PlannersDialog(self.feed, self.glyphs))

    def action_show_help(self) -> None:
        """Show all keys of this screen, and which work now."""
        own = self._own_actions()
        everywhere = (*self._replay_actions(), *on_screen(with_keys(APP_ACTIONS, APP, self.keymap), own))
        if isinstance(self.screen, MapScreen):
            own, everywhere = (), (*own, *everywhere)
        self.push_screen(HelpDialog(everywhere, self.feed.action_context(), self.glyphs, own))

    def action_palette(self) -> None:
        """Find an action by name, and do it."""
        from tui_gcs.screens.common.palette_dialog import PaletteDialog  # when first shown

        self.push_screen(PaletteDialog(self._entries(), self.glyphs, self.own_commands), self._run_chosen)

    def _own_actions(self) -> tuple[ConsoleAction, ...]:
        actions: tuple[ConsoleAction, ...] = getattr(self.screen, "ACTIONS", ())
        return with_keys(actions, self.current_mode, self.keymap)

    def _replay_actions(self) -> tuple[ConsoleAction, ...]:
        """What controls the player of a recording; nothing at a station that flies."""
        return with_keys(REPLAY_ACTIONS, REPLAY_SCOPE, self.keymap) if self.options.replay else ()

    def _entries(self) -> list[Entry]:
        context = self.feed.action_context()
        return [
            *order_entries(context),
            *entries_of(self._replay_actions(), APP, context),
            *entries_of(with_keys(APP_ACTIONS, APP, self.keymap), APP, context),
            *entries_of(self._own_actions(), self.current_mode, context),
        ]

    async def _run_chosen(self, run: str | None) -> None:
        if run:
            await self.run_action(run, self.screen if run.startswith("screen.") else self)

    def action_detach(self) -> None:
        """Leave; everything else goes on. Unsaved edits on the plan screen are asked about first."""
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

    def action_acknowledge(self) -> None:
        """Acknowledge the alarm of the second line."""
        self._acknowledgement.acknowledge()

    def action_show_alarms(self) -> None:
        """Show the list of all alarms."""
        self.push_screen(AlarmScreen(self.feed, self.commands.ask_quietly, self.glyphs, self.clock))

    def action_toggle_bell(self) -> None:
        """Switch the bell of this console off and on."""
        self.bell_rings.is_on = not self.bell_rings.is_on
        self.notice("the bell is on" if self.bell_rings.is_on else "the bell is OFF: alarms are silent on this console")

    def notice(self, text: str, level: Severity = Severity.NORMAL, about: str = "") -> None:
        """Show a line for a while, beside the alarm if there is one, and write it to the journal; see `NoticeBoard`."""
        self.feed.note(text, NOTE_SEVERITIES[level])
        self._notices.add(Notice(text, level), about)
        self.feed.show_notice(self._notices.line())
        self.set_timer(NOTICE_S + 0.1, lambda: self.feed.show_notice(self._notices.line()))

    def _prompt(self) -> None:
        """Show what waits for the next key, on the lines of all screens."""
        if self.keys.awaits_chord:
            self.set_timer(CHORD_S + 0.1, self._prompt)
        text = self.keys.prompt
        for lines in (lines for screen in self.screen_stack for lines in screen.query(TopLines)):
            lines.alarm_line.set_prompt(text)
        for screen in self.screen_stack[-1:]:  # empty while the console ends
            if isinstance(screen, TinyScreen):
                screen.tiny_lines.set_prompt(text)


class ReplayApp(ConsoleApp):
    """Shows what the player of a recording plays; nothing of it can be commanded.

    What flies meanwhile is on a line of its own, and HOLD ALL holds that: see `LiveWatch`.
    """

    BINDINGS: ClassVar[list[BindingType]] = bindings(REPLAY_ACTIONS, REPLAY_SCOPE)

    def on_mount(self) -> None:
        """Listen to what flies. Textual calls that of `ConsoleApp`, too."""
        if (beside := self.options.beside) is not None:
            beside.open()
            self.add_class(BESIDE)
            self.commands.by_name["hold_all"] = self._hold_what_flies
            self.set_interval(LIVE_LOOK_S, self.look_at_what_flies)

    def on_unmount(self) -> None:
        """Listen no more. Textual calls that of `ConsoleApp`, too."""
        if self.options.beside is not None:
            self.options.beside.close()

    def look_at_what_flies(self) -> None:
        """Show the worst news of it; ring for a new one."""
        if (beside := self.options.beside) is None:
            return
        kinds, news = beside.words, beside.news()
        self.feed.requests.read_only = f"{REPLAY_WORDS}   !h HOLDS {kinds}" if kinds else REPLAY_WORDS
        self.keys.chord_help = f"! h HOLD ALL of {kinds} NOW   r, l: nothing, leave the replay" if kinds else CHORD_HELP
        if news.rings and self.bell_rings.is_on:
            self.bell()
        self.feed.show_live(news.line)

    def _hold_what_flies(self) -> None:
        beside = self.options.beside
        if beside is None or not beside.kinds:
            self.commands.hold_all()
            return
        self.notice(f"HOLD ALL is sent to {beside.words}", Severity.CAUTION, about="hold")
        self.run_worker(self._report_hold(beside), group="hold", exit_on_error=False)

    async def _report_hold(self, beside: LiveWatch) -> None:
        answer = await beside.hold_all()
        self.notice(answer.text, answer.level, about="hold")

    def action_replay(self, act: str, seconds: float) -> None:
        """Ask the player for one act of `ReplayAct`, by its name."""
        self._control(ControlReplay(ReplayAct[act], float(seconds)))

    def action_go_to_time(self) -> None:
        """Ask to which time to go."""
        if self.feed.status is not None:
            self.push_screen(TimeDialog(self.glyphs, self.feed.status), self._go_to)

    def _go_to(self, at_s: float | None) -> None:
        if at_s is not None:
            self._control(ControlReplay(ReplayAct.GO_TO, at_s))

    def _control(self, request: ControlReplay) -> None:
        self.run_worker(self._send(request), group="replay", exit_on_error=False)

    async def _send(self, request: ControlReplay) -> None:
        reply = await self.feed.requests.send(request)
        if not reply.ok:
            self.notice(reply.text, Severity.CAUTION, about="replay")
