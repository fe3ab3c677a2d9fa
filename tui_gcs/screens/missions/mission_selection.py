"""The missions screen's keys that choose: which vehicle, which kind of plan, which item."""

from tui_gcs.screens.common.draft_screen import DraftScreen
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.missions.mission_editor import MissionEditor
from tui_gcs.widgets.missions.mission_table import ItemTable, PlanList


class MissionChoosing(DraftScreen):
    """They change what is looked at, and nothing else."""

    editor: MissionEditor
    item_table: ItemTable
    plan_list: PlanList

    def did(self, text: str, ink: Ink = Ink.TEXT) -> None:
        """The draft, or what is edited of it, changed."""
        raise NotImplementedError

    def _choose(self, index: int) -> None:
        self.editor.choose(index)
        self.did("")

    def action_item_up(self) -> None:
        """The item above."""
        self._choose(self.editor.index - 1)

    def action_item_down(self) -> None:
        """The item below."""
        self._choose(self.editor.index + 1)

    def action_page_up(self) -> None:
        """A page up."""
        self._choose(self.editor.index - self.item_table.page)

    def action_page_down(self) -> None:
        """A page down."""
        self._choose(self.editor.index + self.item_table.page)

    def action_first(self) -> None:
        """The first one."""
        self._choose(0)

    def action_last(self) -> None:
        """The last one."""
        self._choose(len(self.editor.items) - 1)

    def on_item_table_chosen(self, message: ItemTable.Chosen) -> None:
        """Clicked."""
        self.item_table.focus()
        self._choose(message.index)

    def action_kind(self) -> None:
        """Mission, fence, rally points."""
        self.editor.step_kind()
        self.did("")

    def action_next_vehicle(self) -> None:
        """The next one's plan."""
        self.editor.step_vehicle(1)
        self.did("")

    def action_previous_vehicle(self) -> None:
        """The one before."""
        self.editor.step_vehicle(-1)
        self.did("")

    def action_digit(self, digit: str) -> None:
        """This one's plan."""
        self._pick(int(digit))

    def on_plan_list_picked(self, message: PlanList.Picked) -> None:
        """Clicked."""
        self._pick(message.vehicle)

    def _pick(self, vehicle: int) -> None:
        known = self.editor.choose_vehicle(vehicle)
        self.did("" if known else f"vehicle {vehicle} is neither in the scenario nor heard", Ink.CAUTION)
