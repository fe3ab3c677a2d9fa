"""The missions screen's key that gives one vehicle's plans to others."""

from textual.app import ComposeResult

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.missions.survey import GeneratorError
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.feed.feed import Feed
from tui_gcs.screens.missions.mission_transfers import MissionVehicles
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.number_text import ids
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.drafts.save_flow import WorkingCopy
from tui_gcs.widgets.missions.copy_bar import CopyBar


class MissionCopies(MissionVehicles):
    """Mission, fence and rally points alike; an edit that undo takes back."""

    def __init__(self, feed: Feed, clock: Clock, glyphs: GlyphSet, work: WorkingCopy) -> None:
        """For this feed and this work."""
        super().__init__(feed, clock, glyphs, work)
        self.copy_bar = CopyBar()

    def compose_questions(self) -> ComposeResult:
        """One more than files."""
        yield from super().compose_questions()
        yield self.copy_bar

    def action_copy(self) -> None:
        """To whom?"""
        editor = self.editor
        planned = self._planned(tuple(PlanKind))
        if editor.preview is not None:
            self.say("first take what is generated (^G), or drop it (Esc)", Ink.CAUTION)
        elif not planned:
            self.say(f"nothing is planned for vehicle {editor.vehicle}", Ink.CAUTION)
        else:
            others = tuple(vehicle for vehicle in editor.vehicles if vehicle != editor.vehicle)
            self.copy_bar.ask(editor.vehicle, planned, others)

    def on_copy_bar_wanted(self, message: CopyBar.Wanted) -> None:
        """Theirs from now on."""
        self.work_list.focus()
        if message.vehicles is None:
            self.say(f"nothing copied: {message.why}" if message.why else "nothing copied", Ink.CAUTION)
            return
        kinds = message.kinds or tuple(PlanKind)
        others = tuple(vehicle for vehicle in message.vehicles if vehicle != self.editor.vehicle)
        try:
            what = self._planned(kinds)
            self.editor.copy_to(others, kinds)
        except GeneratorError as error:
            self.say(f"nothing copied: {error}", Ink.CAUTION)
        else:
            self.did(f"{what} of {self.editor.vehicle} copied to {ids(others)}, each on its layer; u takes it back")

    def _planned(self, kinds: tuple[PlanKind, ...]) -> str:
        draft = self.editor.history.draft.of(self.editor.vehicle)
        return ", ".join(kind.word for kind in kinds if draft.items(kind))
