"""What is typed into the settings form, and why a value was not taken. Independent of Textual."""

from collections.abc import Callable

import msgspec

from tui_gcs.core.scenario.edit import ScenarioDocument
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.widgets.forms.form_text import FieldError
from tui_gcs.widgets.plan.forms import settings_text as st
from tui_gcs.widgets.plan.scenario_editor import Problems, ScenarioEditor

Change = Callable[[ScenarioDocument], None]
LABELS = {
    st.SCENARIO: "settings",
    st.ORIGIN: "origin",
    st.LIMITS: "limits",
    st.BATTERY: "low batteries",
    st.RESULTS: "what a good run must reach",
    st.LOSS: "what a restarted station does",
}
"""Names of the undo steps, by group."""


class SettingsDraft:
    """Stands between the form, which knows texts, and the working copy, which knows valid scenarios."""

    def __init__(self, model: ScenarioEditor) -> None:
        self.model = model
        self.place_index = 0
        self.swapped = ""
        """A line for the operator: which vehicles exchanged take-off places by the last change."""
        self._problems: dict[str, Problems] = {}

    @property
    def problems(self) -> Problems:
        """Why values in the form are not in the working copy, one line each."""
        return tuple(line for lines in self._problems.values() for line in lines)

    @property
    def texts(self) -> dict[str, str]:
        """The texts that the fields are filled with; empty while there is no scenario."""
        scenario = self.model.scenario
        if scenario is None:
            return {}
        # Take-off places may have gone with their team.
        self.place_index = min(self.place_index, max(len(scenario.places) - 1, 0))
        return st.settings_text(scenario, self.model.round_index, self.place_index)

    @property
    def rounds(self) -> list[str]:
        """The options of the field that chooses a round."""
        scenario = self.model.scenario
        return [f"{i}" for i, _ in enumerate(scenario.rounds, 1)] if scenario is not None else []

    @property
    def places(self) -> list[str]:
        """The options of the field that chooses a take-off place."""
        places = self.model.scenario.places if self.model.scenario is not None else ()
        return [f"{i}: {named(place.vehicle)}" for i, place in enumerate(places, 1)]

    def refilled(self) -> None:
        """Drop the problems: the form shows the working copy again."""
        self._problems = {}

    def typed(self, texts: st.Texts, field: str) -> None:
        """Take the group of this field into the working copy, or note the problems."""
        scenario, group = self.model.scenario, st.GROUP_OF.get(field, "")
        if scenario is None or not group:
            return
        self.swapped = ""
        subject = self._subject(group, field)
        if group == st.PLACE:
            self.model.retract_if(subject)  # while "12" was typed, "1" may have exchanged places
            scenario = self.model.scenario or scenario
        try:
            problems = self._take(group, texts, scenario, subject)
        except FieldError as error:
            problems = (str(error),)
        # The last valid value was half of what is being typed: it is taken back.
        if problems:
            self.model.retract_if(subject)
            self._problems[group] = problems
        else:
            self._problems.pop(group, None)

    def _subject(self, group: str, field: str) -> str:
        number = {st.ROUND: self.model.round_index, st.PLACE: self.place_index}.get(group, "")
        return f"settings {group} {number} {field}"

    def _take(self, group: str, texts: st.Texts, old: Scenario, subject: str) -> Problems:
        if group == st.PLACE:
            return self._take_place(texts, old, subject)
        label, change = LABELS.get(group, ""), self._change(group, texts, old)
        if group == st.ROUND:
            label = f"round {self.model.round_index + 1}"
        return self.model.edit(label, subject, change)

    def _change(self, group: str, texts: st.Texts, old: Scenario) -> Change:
        """Return what the texts of a group change in the file. Raises FieldError."""
        if group == st.SCENARIO:
            new = st.to_scenario(texts, old)
            return lambda document: document.set_scenario(
                name=new.name, seed=new.seed, footprint_radius_m=new.footprint_radius_m
            )
        if group == st.ORIGIN:
            origin = st.to_origin(texts, old.origin)
            return lambda document: document.set_origin(origin)
        if group == st.ROUND:
            index = self.model.round_index
            round_ = st.to_round(texts, old.rounds[index])
            return lambda document: document.set_round(index, name=round_.name, duration_s=round_.duration_s)
        if group == st.LIMITS:
            limits = st.to_limits(texts, old.limits)
            return lambda document: document.set_limits(limits)
        if group == st.BATTERY:
            battery = st.to_battery(texts, old.battery)
            return lambda document: document.set_battery(battery)
        if group == st.RESULTS:
            results = st.to_results(texts, old.results)
            return lambda document: document.set_results(results)
        return lambda document: document.set_resume(texts["resume"] == st.YES)

    def _take_place(self, texts: st.Texts, scenario: Scenario, subject: str) -> Problems:
        """Change a take-off place; a vehicle that has another place exchanges it with the vehicle that was here."""
        index, places = self.place_index, scenario.places
        if index >= len(places):
            return ()
        old, new = places[index], st.to_place(texts, places[index])
        other = next(
            (i for i, place in enumerate(places) if i != index and new.vehicle and place.vehicle == new.vehicle), None
        )

        def change(document: ScenarioDocument) -> None:
            document.set_place(index, new)
            if other is not None:
                document.set_place(other, msgspec.structs.replace(places[other], vehicle=old.vehicle))

        problems = self.model.edit(f"place {index + 1}", subject, change)
        if not problems and other is not None:
            self.swapped = f"{named(old.vehicle)} has place {other + 1} now"
        return problems


def named(vehicle: int | None) -> str:
    """Return the name of the vehicle that a place belongs to."""
    return f"vehicle {vehicle}" if vehicle is not None else "any vehicle"
