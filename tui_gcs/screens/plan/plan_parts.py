"""The plan screen's keys for rounds, copies of zones and teams."""

from tui_gcs.screens.plan.plan_preview import PlanPreview
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.plan.plan_draft import PlanDraft
from tui_gcs.widgets.plan.scenario_editor import ScenarioEditor


class PlanParts(PlanPreview):
    """What a scenario consists of besides the shapes of its zones."""

    model: ScenarioEditor
    draft: PlanDraft
    copies = False
    """The next digit says where the zone is copied to."""

    def show_forms(self) -> None:
        """Fill the forms from the working copy."""
        raise NotImplementedError

    def say(self, text: str, ink: Ink = Ink.TEXT) -> None:
        """Tell what became of a key; a copy that waited for its round is over."""
        self.copies = False
        super().say(text, ink)

    def action_copy_zone(self) -> None:
        """Where to?"""
        name = self.draft.zone_name
        if name is None:
            self.say("choose a zone: the operating area is each round's own", Ink.CAUTION)
            return
        here = self.model.round_index + 1
        self.say(f"copy {name}: {here} here, another number into that round, 0 into all others", Ink.CAUTION)
        self.copies = True

    def action_copy_to_all(self) -> None:
        """Into every other round."""
        scenario = self.model.scenario
        if self.copies and scenario is not None:
            self.copy_zone([i for i in range(len(scenario.rounds)) if i != self.model.round_index])

    def copy_zone(self, indices: list[int]) -> None:
        """Into these rounds; into the edited one as a duplicate."""
        scenario, name = self.model.scenario, self.draft.zone_name
        rounds = len(scenario.rounds) if scenario is not None else 0
        if indices == [self.model.round_index]:
            problems = self.draft.duplicate_zone()
            done = f"{self.draft.zone_name} is a copy of {name}"
        elif not indices or max(indices) >= rounds:
            problems, done = (f"there is no round {indices[0] + 1}" if indices else "there is no other round",), ""
        else:
            problems = self.draft.copy_zone(indices)
            done = f"{name} is so in round {', '.join(str(i + 1) for i in indices)}, too; u takes it back"
        self.show_forms()
        self.say(f"not copied: {problems[0]}" if problems else done, Ink.CAUTION if problems else Ink.TEXT)

    def action_add_round(self) -> None:
        """Like the edited one."""
        problems = self.draft.parts.add_round()
        self.show_forms()
        self.say(f"not added: {problems[0]}" if problems else "a round like the one before; u takes it back")

    def action_delete_round(self) -> None:
        """The edited one; the second press does it."""
        current = self.model.current_round
        if current is None or not self.confirmed("delete round", f"delete {current.name}? X again deletes it"):
            return
        problems = self.draft.parts.remove_round()
        self.show_forms()
        self.say(f"not deleted: {problems[0]}" if problems else f"{current.name} deleted, u brings it back")

    @property
    def is_on_teams(self) -> bool:
        """Whether the cursor is in the line of teams."""
        return getattr(self.focused, "field", "") == "team"

    def add_team(self) -> None:
        """One more."""
        problems, name = self.draft.parts.add_team()
        self.draft.team_name = self.draft.team_name if problems else name
        self.show_forms()
        self.say(f"not added: {problems[0]}" if problems else f"{name} added with a vehicle, its place and layer")

    def delete_team(self) -> None:
        """The one in the form; the second press does it."""
        team = self.draft.team
        if team is None or not self.confirmed(f"delete team {team.name}", f"delete team {team.name}? Del again"):
            return
        problems = self.draft.parts.remove_team(team.name)
        self.show_forms()
        self.say(f"not deleted: {problems[0]}" if problems else f"{team.name} deleted, u brings it back")
