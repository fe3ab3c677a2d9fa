"""How the setup of several vehicles stands, side by side, and what goes on with them, as far as this console asks.

Independent of Textual. What needs attention is judged by the station; here rows of vehicles are only put together.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from tui_gcs.core.base.float32 import shown
from tui_gcs.core.protocol.services import GetTasks, TaskInfo
from tui_gcs.core.protocol.setup import GetSetup, Number, SectionWord, SetupFieldRow, SetupSectionRow
from tui_gcs.feed.requests import ConsoleRequests

ATTENTION, UNKNOWN, DONE = "needs attention", "unknown", "done"
STATES = (ATTENTION, UNKNOWN, DONE)
"""States of a section, the worst first."""
LED = ("calibrate ", "test of motor ")
"""How the names of tasks begin that an operator leads from the setup screen."""
MOTOR_TEST = LED[1]


@dataclass(frozen=True)
class SectionSummary:
    """One section of the setup of several vehicles."""

    section: SectionWord
    texts: tuple[tuple[str, str, tuple[int, ...]], ...]
    """State, what is so or missing, and the vehicles that it holds for; the worst state first."""

    @property
    def state(self) -> str:
        """The worst state."""
        return self.texts[0][0] if self.texts else UNKNOWN

    def vehicles_in(self, state: str) -> tuple[int, ...]:
        """Return the vehicles in that state."""
        return tuple(vehicle for each, _, vehicles in self.texts if each == state for vehicle in vehicles)


@dataclass(frozen=True)
class FleetSetupField:
    """One line of a section, of all vehicles that have it."""

    row: SetupFieldRow
    """The line of the first of them."""
    values: tuple[tuple[str, tuple[int, ...]], ...]
    """What it is, in words, and of which vehicles; what most have first."""
    attention: tuple[int, ...]
    """Vehicles of which it needs attention."""
    numbers: tuple[tuple[int, Number], ...]
    """Values by vehicle, of those that were read."""
    prompts: tuple[tuple[str, tuple[int, ...]], ...] = ()
    """What to do before it begins or is changed, and on which vehicles; none where nothing is to be done."""

    @property
    def key(self) -> tuple[str, str]:
        """What makes it the same line in another answer."""
        return self.row.label, self.row.param

    @property
    def vehicles(self) -> tuple[int, ...]:
        """The vehicles that have it."""
        return tuple(sorted(vehicle for _, vehicles in self.values for vehicle in vehicles))

    def number_of(self, vehicle: int | None) -> Number | None:
        """Return the value of a vehicle, or of the first one; None if none was read."""
        values = dict(self.numbers)
        if vehicle in values:
            return values[vehicle]
        return self.numbers[0][1] if self.numbers else None


class SetupWatch:
    """Asks the station how the setup of vehicles stands, and for the calibrations that are under way."""

    def __init__(self, requests: ConsoleRequests, on_news: Callable[[], None]) -> None:
        """Ask by `requests`; `on_news` is called after every answer."""
        self.sections: tuple[SectionSummary, ...] = ()
        self.fields: tuple[FleetSetupField, ...] = ()
        """The lines of the section that was asked for."""
        self.tasks: tuple[TaskInfo, ...] = ()
        """Calibrations and motor tests of these vehicles that are under way, also those of other consoles."""
        self._requests = requests
        self._on_news = on_news
        self._section: SectionWord | None = None
        """The section that was asked for last."""

    async def look_at(self, vehicles: Sequence[int], section: SectionWord) -> None:
        """Ask once for the lines of `section` alone, which was chosen now: an operator goes past several."""
        self._section = section
        if not vehicles:
            return
        reply = await self._requests.send(GetSetup(tuple(vehicles), section, only=True))
        if section == self._section:
            self.fields = fleet_fields(reply.setup_sections)
            self._on_news()

    async def look(self, vehicles: Sequence[int], section: SectionWord) -> None:
        """Ask once about these vehicles, with the lines of `section`."""
        self._section = section
        if not vehicles:
            self.sections, self.fields, self.tasks = (), (), ()
            self._on_news()
            return
        reply = await self._requests.send(GetSetup(tuple(vehicles), section))
        # A vehicle that was never heard makes the reply a refusal; the others are there all the same.
        if reply.setup_sections:
            self.sections = summaries(reply.setup_sections)
            # Another section may have been chosen meanwhile.
            if section == self._section:
                self.fields = fleet_fields(row for row in reply.setup_sections if row.section == section)
        tasks = await self._requests.send(GetTasks())
        if tasks.ok:
            asked = set(vehicles)
            self.tasks = tuple(t for t in tasks.tasks if not t.over and t.vehicle in asked and t.what.startswith(LED))
        self._on_news()


def summaries(rows: Iterable[SetupSectionRow]) -> tuple[SectionSummary, ...]:
    """Return one summary for each section, in the order of the rows."""
    found: dict[SectionWord, dict[tuple[str, str], list[int]]] = {}
    for row in rows:
        found.setdefault(row.section, {}).setdefault((row.state, row.text), []).append(row.vehicle)
    return tuple(
        SectionSummary(
            section,
            tuple(
                (state, text, tuple(vehicles))
                for (state, text), vehicles in sorted(
                    texts.items(), key=lambda each: (STATES.index(each[0][0]), -len(each[1]))
                )
            ),
        )
        for section, texts in found.items()
    )


def fleet_fields(rows: Iterable[SetupSectionRow]) -> tuple[FleetSetupField, ...]:
    """Return the lines of one section, those of several vehicles with the same label and parameter together."""
    found: dict[tuple[str, str], list[tuple[int, SetupFieldRow]]] = {}
    for row in rows:
        for field in row.fields:
            found.setdefault((field.label, field.param), []).append((row.vehicle, field))
    return tuple(_together(lines) for lines in found.values())


def _together(lines: Sequence[tuple[int, SetupFieldRow]]) -> FleetSetupField:
    words: dict[str, list[int]] = {}
    prompts: dict[str, list[int]] = {}
    for vehicle, row in lines:
        words.setdefault(value_words(row), []).append(vehicle)
        if row.prompt:
            prompts.setdefault(row.prompt, []).append(vehicle)
    return FleetSetupField(
        lines[0][1],
        _most_first(words),
        tuple(vehicle for vehicle, row in lines if row.needs_attention),
        tuple((vehicle, row.value) for vehicle, row in lines if row.value is not None),
        _most_first(prompts),
    )


def _most_first(texts: dict[str, list[int]]) -> tuple[tuple[str, tuple[int, ...]], ...]:
    ordered = sorted(texts.items(), key=lambda each: -len(each[1]))
    return tuple((text, tuple(vehicles)) for text, vehicles in ordered)


def value_words(row: SetupFieldRow) -> str:
    """Return the words of a line: what it does, the name of its value, or the value with its unit."""
    if row.words:
        return row.words
    if row.value is None:
        return "not read"
    name = dict(row.choices).get(int(row.value)) if row.value == row.value and abs(row.value) < 1e9 else None
    if name is not None:
        return f"{name} ({shown(row.value)})"
    former = f"   was {', '.join(map(shown, row.former))}" if row.former else ""
    return f"{shown(row.value)} {row.unit}".rstrip() + former
