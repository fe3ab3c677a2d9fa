"""The two lists of the missions screen: all vehicles with the figures of their missions, and the edited items."""

from collections.abc import Mapping

from textual import events
from textual.message import Message

from tui_gcs.core.missions.command_reference import FRAMES, word_of
from tui_gcs.core.missions.mission_builder import CHANGE_SPEED
from tui_gcs.core.missions.mission_findings import FindingLevel
from tui_gcs.core.plans.model import JUMP, PLAIN_FRAME, PlanItem, PlanKind
from tui_gcs.widgets.basics.border_titles import show_beyond
from tui_gcs.widgets.basics.copied_rows import Record
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.missions.mission_editor import MissionEditor
from tui_gcs.widgets.missions.mission_text import clock, distance, has_height, labels, of_vehicle

_HOW_TO_BEGIN = {
    PlanKind.MISSION: "+ adds one, g generates",
    PlanKind.FENCE: "g over zones, G polygon, O circle",
    PlanKind.RALLY: "+ adds one",
}


COLUMNS = f"   ID {'ITEMS':>5} {'WAY':>7} {'TIME':>6}  LEFT"
COLUMNS_TITLE = COLUMNS[2:]
"""The names of the columns for the border above the list: two cells on, after its corner."""


class PlanList(LinesView):
    """A line for each vehicle: items, distance, time, battery left, and a mark for the gravest finding.

    On a low terminal the names of the columns stand in the border above, which leaves room for one more vehicle.
    """

    DEFAULT_CSS = "PlanList { height: 1fr; }"

    class Picked(Message):
        """The operator clicked a vehicle."""

        def __init__(self, vehicle: int) -> None:
            super().__init__()
            self.vehicle = vehicle

    class OthersHidden(Message):
        """The number of vehicles out of view has changed."""

    def __init__(self, editor: MissionEditor, **options: object) -> None:
        super().__init__(**options)  # type: ignore[arg-type]
        self._editor = editor
        self._states: Mapping[int, str] = {}
        self._failed: frozenset[int] = frozenset()
        self._first = 0
        self.hidden = 0
        """Number of vehicles above and below those in view."""

    def show(self, states: Mapping[int, str], failed: frozenset[int] = frozenset()) -> None:
        """Show the draft; `states` are the transfers under way, by vehicle, `failed` the vehicles to send to again."""
        self._states, self._failed = states, failed
        self.update_lines()

    def on_click(self, event: events.Click) -> None:
        """Choose the vehicle under the pointer."""
        ids, row = self._editor.vehicles, event.y - self._header_rows
        if row >= 0 and self._first + row < len(ids):
            self.post_message(self.Picked(ids[self._first + row]))

    @property
    def _header_rows(self) -> int:
        return 0 if self.screen.has_class("-short") else 1

    def lines(self, width: int, height: int) -> list[Line]:
        """Return the vehicles in view, scrolled so that the edited one is among them."""
        ids = self._editor.vehicles
        if not ids:
            return [[("no vehicle is known yet", Ink.MUTED)]]
        room = max(height - self._header_rows, 1)
        at = ids.index(self._editor.vehicle) if self._editor.vehicle in ids else 0
        # Scrolls only as far as needed, so that the line under the eyes stays where it is.
        self._first = max(0, min(max(self._first, at - room + 1), at, len(ids) - room))
        beyond = self._first, max(len(ids) - self._first - room, 0)
        show_beyond(self.parent, *beyond, "n N")
        if sum(beyond) != self.hidden:
            self.hidden = sum(beyond)
            self.post_message(self.OthersHidden())
        header: list[Line] = [[(COLUMNS, Ink.MUTED)]] * self._header_rows
        return [*header, *(self._line(vehicle) for vehicle in ids[self._first : self._first + room])]

    def _line(self, vehicle: int) -> Line:
        editor = self._editor
        look, draft = editor.forecast, editor.draft.of(vehicle)
        chosen = vehicle == editor.vehicle
        mark, ink = ("!", Ink.WARNING) if vehicle in self._failed else _mark(editor, vehicle)
        name = f"{self.glyphs.selected if chosen else ' '}{mark}{vehicle:>3}"
        style = Ink.BOLD if chosen else Ink.TEXT
        if state := self._states.get(vehicle, ""):
            return [(name, ink if mark != " " else style), (f" {state}", Ink.ADVISORY)]
        if draft.is_empty:
            return [(name, style), ("     nothing planned", Ink.MUTED)]
        if vehicle in self._failed:
            return [(name, Ink.WARNING), (f" {len(draft.mission):>5}  upload FAILED: R again", Ink.WARNING)]
        path = look.path(vehicle)
        left = f"{look.battery_left_pct(vehicle):>4.0f}%" if not path.is_empty else f"{'--':>5}"
        end = "+" if path.endless or path.cut else " "
        text = f" {len(draft.mission):>5} {distance(path.length_m):>7} {clock(path.duration_s):>6}{end}{left}"
        return [(name, ink if mark != " " else style), (text, style)]


def _mark(editor: MissionEditor, vehicle: int) -> tuple[str, Ink]:
    """Return `!` for a plan that cannot be sent or meets another vehicle, `^` for a caution."""
    met = of_vehicle(editor.forecast.conflicts, vehicle)
    worst = max((finding.level for finding in editor.forecast.findings(vehicle)), default=FindingLevel.NOTE)
    if worst is FindingLevel.ERROR or any(conflict.together for conflict in met):
        return "!", Ink.WARNING
    return ("^", Ink.CAUTION) if worst is FindingLevel.CAUTION or met else (" ", Ink.TEXT)


class ItemTable(LinesView, can_focus=True):
    """The items of the edited plan; only those in view cost time."""

    DEFAULT_CSS = "ItemTable { height: 1fr; min-height: 2; }"

    class Chosen(Message):
        """The operator clicked another item."""

        def __init__(self, index: int) -> None:
            super().__init__()
            self.index = index

    def __init__(self, editor: MissionEditor, **options: object) -> None:
        super().__init__(**options)  # type: ignore[arg-type]
        self._editor = editor
        self._first = 0

    @property
    def page(self) -> int:
        """The number of items in view."""
        return max(self.size.height - 1, 1)

    def on_click(self, event: events.Click) -> None:
        """Choose the item under the pointer."""
        index = self._first + event.y - 1
        if event.y >= 1 and index < len(self._editor.items):
            self.post_message(self.Chosen(index))

    def watch_has_focus(self, has_focus: bool) -> None:
        """Draw the chosen line as focused, or not."""
        super().watch_has_focus(has_focus)
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """Return the items in view, scrolled so that the edited one is among them."""
        editor = self._editor
        items, room = editor.items, max(height - 1, 1)
        if not items:
            return [[(f"no {editor.kind.word}: {_HOW_TO_BEGIN[editor.kind]}", Ink.MUTED)]]
        self._first = max(0, min(max(self._first, editor.index - room + 1), editor.index, len(items) - room))
        wrong = {f.item: f.level for f in reversed(editor.forecast.findings(editor.vehicle)) if f.kind is editor.kind}
        shown = range(self._first, min(self._first + room, len(items)))
        show_beyond(self.parent, self._first, len(items) - shown.stop, "arrows")
        return [[(_header(editor), Ink.MUTED)], *(self._line(i, items[i], wrong.get(i)) for i in shown)]

    def records(self) -> list[Record]:
        """Return the items for the clipboard, as MISSION_ITEM_INT has them, with degrees."""
        editor = self._editor
        return [_record(editor, number, item) for number, item in enumerate(editor.items, 1)]

    def _line(self, index: int, item: PlanItem, wrong: FindingLevel | None) -> Line:
        editor = self._editor
        chosen = index == editor.index
        style = Ink.SELECTED if chosen and self.has_focus else Ink.BOLD if chosen else Ink.TEXT
        sign = {FindingLevel.ERROR: "!", FindingLevel.CAUTION: "^"}.get(wrong, " ") if wrong is not None else " "
        ink = {"!": Ink.WARNING, "^": Ink.CAUTION}.get(sign, style)
        name = f"{self.glyphs.selected if chosen else ' '}{sign}{index + 1:>4} "
        return [
            (name, ink),
            (f"{word_of(item.command).word[:12]:<12}{_height(item)}{_more(editor, index, item)}", style),
        ]


def _record(editor: MissionEditor, number: int, item: PlanItem) -> Record:
    place = {"latitude_deg": item.x / 1e7, "longitude_deg": item.y / 1e7} if item.is_place else {}
    params = {f"param{at}": value for at, value in enumerate(item.params, 1)}
    own: dict[str, object] = {"vehicle": editor.vehicle, "plan": editor.kind.word, "number": number}
    named = {"command": item.command, "item": word_of(item.command).word, "frame": item.frame}
    return {**own, **named, **params, **place, "height_m": item.z}


def _header(editor: MissionEditor) -> str:
    last = {PlanKind.MISSION: f"{'TIME':>7} LEFT", PlanKind.FENCE: "  RADIUS", PlanKind.RALLY: ""}[editor.kind]
    return f"     # {'ITEM':<12}{'':>3}HEIGHT{last}"


def _height(item: PlanItem) -> str:
    if not has_height(item):
        return " " * 9
    above = {"home": "", "sea": "s", "ground": "g"}[FRAMES.get(PLAIN_FRAME.get(item.frame, item.frame), "home")]
    return f"{item.z:>7.0f}m{above or ' '}"


def _more(editor: MissionEditor, index: int, item: PlanItem) -> str:
    """Return arrival time and battery left of a mission item; of other items their first parameter."""
    if editor.kind is PlanKind.MISSION:
        arrival_s = editor.forecast.path(editor.vehicle).arrivals_s.get(index)
        if arrival_s is not None:
            site = editor.forecast.site(editor.vehicle)
            left = site.battery_pct - site.performance.energy_pct(arrival_s)
            return f"{clock(arrival_s):>7} {left:>3.0f}%"
    if item.command == CHANGE_SPEED:
        return f" {item.params[1]:g} m/s"
    values = [f"{label.label.lower()} {_value(item, i)}{label.unit}" for i, label in enumerate(labels(item)) if label]
    return f" {values[0]}" if values else ""


def _value(item: PlanItem, index: int) -> str:
    value = item.params[index] + (1 if item.command == JUMP and index == 0 else 0)
    return f"{value:g} "
