"""Fields of a form are gone through as they are written, also those that are not laid out yet."""

from textual.app import App, ComposeResult
from textual.widgets import Button

from tui_gcs.widgets.forms.choice_field import ChoiceField
from tui_gcs.widgets.forms.field_order import step_field
from tui_gcs.widgets.forms.form import Form, FormField, FormRow


class OneForm(App[None]):
    """A form between two buttons; its third row is hidden at first."""

    def compose(self) -> ComposeResult:
        """See `App.compose`."""
        self.fields = [FormField("name"), FormField("radius"), ChoiceField("side", ("in", "out")), FormField("height")]
        self.rows = [FormRow(field.field, field) for field in self.fields]
        yield Button("before")
        yield Form(*self.rows)
        yield Button("after")

    def on_mount(self) -> None:
        """See `App.on_mount`."""
        self.rows[2].display = False
        self.fields[0].focus()

    def focused_field(self) -> str:
        """Where the cursor is."""
        return getattr(self.focused, "field", str(getattr(self.focused, "label", "")))


async def test_a_row_shown_by_the_key_before_is_not_gone_past() -> None:
    app = OneForm()
    async with app.run_test():
        app.rows[2].display = True
        step_field(app.fields[0], 1)
        assert app.focused_field() == "radius"
        step_field(app.fields[1], 1)
        assert app.focused_field() == "side"
        step_field(app.fields[2], 1)
        assert app.focused_field() == "height"


async def test_hidden_rows_are_gone_past_and_the_ends_lead_out_of_the_form() -> None:
    app = OneForm()
    async with app.run_test() as pilot:
        gone = [app.focused_field()]
        for _ in range(4):
            await pilot.press("tab")
            gone.append(app.focused_field())
        assert gone == ["name", "radius", "height", "after", "before"]
        app.fields[0].focus()
        await pilot.press("up")
        assert app.focused_field() == "before"


async def test_a_form_alone_on_the_screen_goes_round() -> None:
    app = OneForm()
    async with app.run_test() as pilot:
        await app.query(Button).remove()
        await pilot.press("shift+tab")
        assert app.focused_field() == "height"
        await pilot.press("tab")
        assert app.focused_field() == "name"
