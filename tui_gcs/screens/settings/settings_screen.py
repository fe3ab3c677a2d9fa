"""The settings screen: layout and keys."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType

from tui_gcs.actions import APP_ACTIONS, ConsoleAction, bindings
from tui_gcs.actions.palette.own_commands import OwnCommands
from tui_gcs.actions.settings_actions import SETTINGS_ACTIONS
from tui_gcs.client.settings_file import COMMANDS, change, shown_value, typed_value
from tui_gcs.client.user_settings import NOW, SETTINGS, SettingsError, SettingsInUse
from tui_gcs.core.base.text import clean
from tui_gcs.feed.feed import Feed
from tui_gcs.screens.common.list_screen import ListScreen
from tui_gcs.screens.common.row_copies import below_report
from tui_gcs.screens.settings.command_rows import MARK, command_rows, write_command
from tui_gcs.screens.settings.setting_rows import read_file, setting_rows
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.strips import Run
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.forms.prompt_bar import PromptBar
from tui_gcs.widgets.settings.setting_list import SettingList, SettingPanel

MAX_REPORT = 400
CHOOSE_COMMAND = "choose one of the commands below this line"


class SettingsScreen(ListScreen):
    """The settings of this console, and those of the file for the next."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = SETTINGS_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(SETTINGS_ACTIONS, "settings")
    CSS = "SettingsScreen { layout: vertical; }"

    def __init__(
        self,
        feed: Feed,
        settings: SettingsInUse,
        use: Callable[[str, str], None] = lambda key, value: None,
        use_commands: Callable[[OwnCommands], None] = lambda commands: None,
        *,
        glyphs: GlyphSet = UNICODE,
    ) -> None:
        """Show `settings`; `use` takes a new value of a setting that counts at once, "" for its default.

        `use_commands` takes the operator's own commands whenever one was changed.
        """
        super().__init__(feed)
        self._glyphs = glyphs
        self._settings = settings
        self._use = use
        self._use_commands = use_commands
        self._commands: OwnCommands | None = None
        """The own commands in use, since one was changed here."""
        self._used: dict[str, str] = {}
        """Values that have counted at once since this console was started."""
        self._in_file: dict[str, Any] = {}
        self._trouble = ""
        """Why the file cannot be read."""
        self._report: tuple[Run, ...] = ()
        self._asked = ""
        """The setting whose value is being typed."""
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.setting_list = SettingList(glyphs=glyphs)
        self.panel = SettingPanel(glyphs=glyphs)
        self.value_bar = PromptBar("value")

    def compose(self) -> ComposeResult:
        """Compose the top lines, the list, the panel, the question and the footer."""
        yield self.top_lines
        yield self.setting_list
        yield self.panel
        yield self.value_bar
        yield FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=self._glyphs, feed=self.feed, here="show_settings")

    def on_mount(self) -> None:
        """Begin to receive the feed's messages."""
        self.feed.listen(self)

    @on(events.ScreenResume)
    def look(self) -> None:
        """Read the file again: it may have been edited meanwhile."""
        self._in_file, self._trouble = read_file(self._settings.path)
        self.show_all()

    @on(events.Resize)
    def show_all(self) -> None:
        """Show all settings; the same stays chosen."""
        used = self._commands.words if self._commands is not None else None
        rows = setting_rows(self._settings, self._in_file, self._used)
        rows += command_rows(self._settings, self._in_file, used)
        self.setting_list.show_kept(rows, lambda row: row.setting)
        self.show_chosen()

    def show_chosen(self) -> None:
        """Show the path of the file, and the chosen setting in detail."""
        path = self._settings.path
        where = str(path) if path is not None else "no file is read: TUI_GCS_CONFIG is empty"
        set_title(self.setting_list, f"settings   {clean(where, 100)}")
        trouble: tuple[Run, ...] = ((clean(self._trouble, MAX_REPORT), Ink.WARNING),) if self._trouble else ()
        self.panel.show(self.setting_list.chosen_row, (*trouble, *self._report))

    @property
    def row_list(self) -> RowsView[Any]:
        """See `ListScreen`."""
        return self.setting_list

    def say_copied(self, text: str, ink: Ink) -> None:
        """See `ListScreen`."""
        self._report = below_report(self._report, text, ink)
        self.show_chosen()

    def _say(self, text: str, ink: Ink = Ink.TEXT) -> None:
        self._report = ((clean(text, MAX_REPORT), ink),)
        self.show_chosen()

    # ---------------------------------------------------------------- keys

    def action_change(self) -> None:
        """Take the next value of a choice, or ask for the value."""
        row = self.setting_list.chosen_row
        path = self._file()
        if row is None or path is None:
            return
        if row.setting.startswith(MARK):
            self._asked = row.setting
            self.value_bar.ask(f"{row.setting} =", row.in_file)
            return
        key, setting = row.setting, SETTINGS[row.setting]
        present = self._in_file.get(key)
        if setting.kind is dict:
            self._asked = key
            self.value_bar.ask("new command: name = words", "")
        elif setting.kind is bool:
            self._write(path, key, not present)
        elif setting.choices:
            at = setting.choices.index(present) + 1 if present in setting.choices else 0
            # Without a value in the file the first choice is the default already, if the setting has one.
            if present is None and row.value == setting.choices[0]:
                at = 1
            self._write(path, key, setting.choices[at % len(setting.choices)])
        else:
            self._asked = key
            hint = " (; between several)" if setting.kind is list and key != "operator_at" else ""
            self.value_bar.ask(f"{key}{hint} =", shown_value(key, present) if present is not None else "")

    @on(PromptBar.Answered, "#value")
    def _answered(self, message: PromptBar.Answered) -> None:
        self.set_focus(None)
        key, self._asked, path = self._asked, "", self._file()
        if path is None:
            return
        if message.text is None:
            self._say(f"{key}: left as it is")
        elif not message.text.strip():
            self._say(f"{key}: nothing was typed, left as it is; Del removes it", Ink.CAUTION)
        elif key == COMMANDS:
            self._add_command(path, message.text)
        elif key.startswith(MARK):
            self._write_command(path, key.removeprefix(MARK), message.text.strip())
        else:
            try:
                self._write(path, key, typed_value(key, message.text))
            except SettingsError as error:
                self._say(f"NOT WRITTEN: {error}", Ink.CAUTION)

    def action_remove(self) -> None:
        """Remove the chosen setting from the file."""
        row = self.setting_list.chosen_row
        path = self._file()
        if row is None or path is None:
            return
        if row.setting.startswith(MARK):
            self._write_command(path, row.setting.removeprefix(MARK), None)
        elif row.setting == COMMANDS:
            self._say(CHOOSE_COMMAND, Ink.CAUTION)
        elif row.setting not in self._in_file:
            self._say(f"{row.setting} is not in the file", Ink.CAUTION)
        else:
            self._write(path, row.setting, None)

    def action_cancel(self) -> None:
        """Forget the report of the last key."""
        self._report = ()
        self.look()

    def _file(self) -> Path | None:
        """Return the file that is written; without one the operator is shown why."""
        if self._settings.path is None:
            self._say("NOT WRITTEN: TUI_GCS_CONFIG is empty, so no file is read", Ink.CAUTION)
        return self._settings.path

    def _write(self, path: Path, key: str, value: Any | None) -> None:
        """Write one setting; what counts at once is used."""
        try:
            change(path, key, value)
        except SettingsError as error:
            self._say(f"NOT WRITTEN: {error}", Ink.CAUTION)
            return
        text = shown_value(key, value) if value is not None else ""
        if SETTINGS[key].counts == NOW:
            self._use(key, text)
            self._used[key] = text
        done = f"{key} = {text} is written" if value is not None else f"{key} is removed from the file"
        self.look()
        self._say(f"{done}; it counts: {SETTINGS[key].counts}", Ink.NORMAL)

    def _add_command(self, path: Path, typed: str) -> None:
        """Write the command that was typed as `name = words`."""
        name, equals, words = (part.strip() for part in typed.partition("="))
        if not (name and equals and words):
            self._say("NOT WRITTEN: type a name, = and words: low = select t1; altitude", Ink.CAUTION)
            return
        if name in self._in_file.get(COMMANDS, {}):
            self._say(f"NOT WRITTEN: there is :{name} already: choose its line to change it", Ink.CAUTION)
            return
        self._write_command(path, name, words)

    def _write_command(self, path: Path, name: str, words: str | None) -> None:
        """Write an own command, or with None remove it; it counts at once."""
        try:
            self._commands = write_command(path, name, words)
        except SettingsError as error:
            self._say(f"NOT WRITTEN: {error}", Ink.CAUTION)
            return
        self._use_commands(self._commands)
        self._used[COMMANDS] = shown_value(COMMANDS, self._commands.words)
        self.look()
        done = f":{name} = {words} is written" if words is not None else f":{name} is removed from the file"
        self._say(f"{done}; it counts: {NOW}", Ink.NORMAL)
