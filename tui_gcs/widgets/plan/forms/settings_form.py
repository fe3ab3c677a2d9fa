"""The form for a scenario's settings besides zones and teams: name, origin, rounds, places, limits, results."""

from collections.abc import Mapping, Sequence

from textual import on
from textual.message import Message
from textual.widget import Widget
from textual.widgets import Input

from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.forms.choice_field import ChoiceField
from tui_gcs.widgets.forms.form import Form, FormField, FormRow
from tui_gcs.widgets.forms.number_field import NumberField
from tui_gcs.widgets.plan.forms.settings_text import GROUP_OF, NO, YES

NAMES = ("scenario_name", "round_name")
HELP = {
    "seed": "everything random comes from it: the same seed gives the same run",
    "footprint_radius_m": "what one vehicle sees: a disc of this radius below it",
    "lat_deg": "where 0, 0 is: places in metres move with it, those in degrees stay",
    "lon_deg": "where 0, 0 is: places in metres move with it, those in degrees stay",
    "ground_amsl_m": "height of the ground above mean sea level",
    "duration_s": "how long the round is flown by tui-gcs run",
    "vehicle": "system id; empty: for any that has no place of its own",
    "layer_m": "height kept on the way out and back, one per vehicle",
    "separation_horizontal_m": "two in the air are this far apart on the ground plan",
    "separation_vertical_m": "or else this far apart in height",
    "geofence_margin_m": "vehicles stop this far inside the operating area",
    "home_spread_m": "heights are above each one's own take-off place: these may differ by this much",
    "return_pct": "a vehicle of a planner returns and lands at this charge; 0: never",
    "reserve_s": "or earlier, where less flight time would be left after the way home",
    "worst_ratio_max": "worst idleness over the ideal",
    "coverage_min": "share of the zone seen, 0 to 1",
    "on_slot_max_s": "all vehicles are on their slots this long after a round began",
    "measured_s": "a round is measured for this long, once it has warmed up",
    "landing_error_max_m": "from the take-off place",
    "slot_error_max_m": "no vehicle is farther from its plan than this",
    "slot_lag_max_s": "nor earlier or later on its plan than this",
    "resume": "no: a restarted station waits for you; yes: it flies on",
}


class SettingsForm(Form):
    """Posts what is typed; what it means and whether it is allowed is decided elsewhere."""

    DEFAULT_CSS = "SettingsForm { height: 1fr; }"

    class Edited(Message):
        """The operator changed a field."""

        def __init__(self, texts: Mapping[str, str], field: str) -> None:
            super().__init__()
            self.texts = texts
            self.field = field

    class RoundChosen(Message):
        """The operator chose another round, counted from 0."""

        def __init__(self, index: int) -> None:
            super().__init__()
            self.index = index

    class PlaceChosen(Message):
        """The operator chose another take-off place, counted from 0."""

        def __init__(self, index: int) -> None:
            super().__init__()
            self.index = index

    def __init__(self, *, glyphs: GlyphSet = UNICODE) -> None:
        fields = {
            name: FormField(name) if name in NAMES else NumberField(name) for name in GROUP_OF if name != "resume"
        }
        fields["vehicle"].placeholder = "any"
        self._fields = fields
        self._round = ChoiceField("round", glyphs=glyphs)
        self._place = ChoiceField("place", glyphs=glyphs)
        self._resume = ChoiceField("resume", (NO, YES), glyphs=glyphs)
        super().__init__(
            FormRow("Scenario", fields["scenario_name"]),
            FormRow("Seed", fields["seed"]),
            FormRow("Sees", fields["footprint_radius_m"], "m around itself"),
            FormRow("Origin", fields["lat_deg"], "N", fields["lon_deg"], "E"),
            FormRow("Ground", fields["ground_amsl_m"], "m AMSL"),
            FormRow("Round", self._round),
            FormRow(" Name", fields["round_name"]),
            FormRow(" Flown", fields["duration_s"], "s"),
            FormRow("Place", self._place),
            FormRow(" Vehicle", fields["vehicle"]),
            FormRow(" Lies", "E", fields["place_east_m"], "N", fields["place_north_m"], "m"),
            FormRow(" Layer", fields["layer_m"], "m"),
            _heading("Limits"),
            FormRow(" Speed", fields["speed_m_s"], "m/s"),
            FormRow(" Accel", fields["accel_m_s2"], "m/s2"),
            FormRow(" Apart", fields["separation_horizontal_m"], "m or", fields["separation_vertical_m"], "m high"),
            FormRow(" Border", fields["geofence_margin_m"], "m inside it"),
            FormRow(" Homes", fields["home_spread_m"], "m spread in height"),
            FormRow(" Battery", fields["return_pct"], "% or", fields["reserve_s"], "s left"),
            _heading("A good run"),
            FormRow(" Measure", fields["measured_s"], "s"),
            FormRow(" Ratio", fields["worst_ratio_max"], "x ideal at most"),
            FormRow(" Seen", fields["coverage_min"], "of the zone"),
            FormRow(" On slot", fields["on_slot_max_s"], "s after the switch"),
            FormRow(" Slots", fields["slot_error_max_m"], "m and", fields["slot_lag_max_s"], "s off"),
            FormRow(" Landing", fields["landing_error_max_m"], "m off"),
            FormRow("Restart", self._resume),
            glyphs=glyphs,
            id="settings",
        )
        set_title(self, "settings: Esc leaves")

    @property
    def texts(self) -> dict[str, str]:
        """The texts in the fields, by name."""
        return {name: field.value for name, field in self._fields.items()} | {"resume": self._resume.value}

    def show(
        self,
        texts: Mapping[str, str],
        *,
        rounds: Sequence[str],
        round_index: int,
        places: Sequence[str],
        place_index: int,
    ) -> None:
        """Fill all fields without posting a change."""
        for name, field in self._fields.items():
            field.show(texts.get(name, ""))
        self._resume.show(texts.get("resume", NO))
        self._round.show(rounds[round_index], rounds)
        self.show_places(places, place_index)

    def show_places(self, places: Sequence[str], place_index: int) -> None:
        """Show the take-off places and choose one, without touching the field that is typed into."""
        if places:
            self._place.show(places[place_index], places)

    def help_of(self, field: str) -> str:
        """Return what a field means."""
        return HELP.get(field, "")

    @on(Input.Changed)
    @on(ChoiceField.Changed)
    def _changed(self, event: Input.Changed | ChoiceField.Changed) -> None:
        event.stop()
        field = getattr(event.control, "field", "")
        if field == "round":
            self.post_message(self.RoundChosen(self._round.index))
        elif field == "place":
            self.post_message(self.PlaceChosen(self._place.index))
        else:
            self.post_message(self.Edited(self.texts, field))


def _heading(text: str) -> Widget:
    return FormRow(text, label_cells=len(text), ink=Ink.TEXT)
