"""The line of the plan screens that says what became of a key."""

from textual.app import App, ComposeResult

from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.forms.form_findings import EditLine, Remark

STATE = Remark("1 change not applied, not saved", Ink.CAUTION)
WHY = "not imported: round[1].zone[4].vertices_m[1]: corners 1 and 3: the polygon crosses itself near 400.5, 312.25"


class Line(App[None]):
    def __init__(self) -> None:
        super().__init__()
        self.line = EditLine()

    def compose(self) -> ComposeResult:
        yield self.line


def shown(line: EditLine) -> list[str]:
    return ["".join(text for text, _ in runs) for runs in line.lines(line.size.width, line.size.height)]


async def test_a_short_message_stands_beside_the_state() -> None:
    app = Line()
    async with app.run_test(size=(80, 24)) as pilot:
        app.line.show(STATE, Remark("zone 2 added"))
        await pilot.pause()
        assert shown(app.line) == [" 1 change not applied, not saved  zone 2 added"]


async def test_a_longer_message_has_the_line_alone_and_a_star_means_unsaved() -> None:
    app = Line()
    async with app.run_test(size=(80, 24)) as pilot:
        text = "copy zone 2: 1 here, another number into that round, 0 all"
        app.line.show(STATE, Remark(text))
        await pilot.pause()
        assert shown(app.line) == [f" *{text}"]


async def test_why_a_file_was_refused_is_read_to_its_end() -> None:
    app = Line()
    async with app.run_test(size=(80, 24)) as pilot:
        app.line.show(STATE, Remark(WHY))
        await pilot.pause()
        assert len(shown(app.line)) == 2
        assert " ".join(part.strip(" *") for part in shown(app.line)) == WHY
        app.line.show(STATE, Remark(""))
        await pilot.pause()
        assert (app.line.size.height, shown(app.line)) == (1, [" 1 change not applied, not saved"])
