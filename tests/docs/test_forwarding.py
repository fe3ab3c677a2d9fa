"""`docs/forwarding.md` lists exactly what the rules let pass."""

import re
from pathlib import Path

from tui_gcs.core.forward import command_rules, mission_rules

TEXT = (Path(__file__).parents[2] / "docs" / "forwarding.md").read_text(encoding="utf-8")


def first_column(heading: str) -> str:
    """The first column of the table under a heading, without what stands in parentheses."""
    table = TEXT.partition(f"## {heading}\n")[2].partition("\n## ")[0]
    cells = [line.split("|")[1] for line in table.splitlines() if line.startswith("|")]
    return re.sub(r"\([^)]*\)", "", "\n".join(cells[2:]))


def numbers(heading: str) -> set[int]:
    return {int(number) for number in re.findall(r"\d+", first_column(heading))}


def test_every_message_with_a_rule_is_listed() -> None:
    assert set(re.findall(r"[A-Z_]{5,}", first_column("Messages"))) == set(command_rules.MESSAGES)


def test_every_command_that_may_pass_is_listed() -> None:
    rules = command_rules
    assert numbers("Commands") == rules.READS | set(rules.STOPS) | set(rules.PLAIN) | set(rules.CHECKED)


def test_every_mission_item_that_may_pass_is_listed() -> None:
    rules = mission_rules
    assert numbers("Mission items") == rules.ITEM_PLACES | rules.ITEM_PLAIN | {rules.JUMP, rules.CHANGE_SPEED}
