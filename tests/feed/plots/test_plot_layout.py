"""Panes, the values in them, and views in a file."""

import json
from pathlib import Path

import pytest

from tui_gcs.feed.plots.plot_layout import MAX_CURVES, MAX_PANES, WHOLE_FLIGHT, PlotLayout, PlotViews
from tui_gcs.feed.plots.plotted_values import PlotValue, ValueKind


def values(name: str, unit: str, count: int = 1) -> tuple[PlotValue, ...]:
    return tuple(PlotValue(ValueKind.TELEMETRY, vehicle, name, unit) for vehicle in range(1, count + 1))


def test_a_pane_takes_as_many_values_as_can_be_told_apart() -> None:
    layout = PlotLayout()
    words = layout.toggle(values("altitude", "m", 50))
    assert len(layout.pane.values) == MAX_CURVES and "42 more do not fit" in words


def test_panes_are_bounded_and_another_unit_says_so() -> None:
    layout = PlotLayout()
    for at in range(MAX_PANES):
        layout.toggle(values("x", f"unit {at}"))
    assert "6 panes are shown already" in layout.toggle(values("y", "other"))
    assert "is shown" in layout.toggle(values("y", "unit 0"))


def test_labels_say_what_differs() -> None:
    layout = PlotLayout()
    layout.toggle(values("altitude", "m", 2))
    assert [layout.pane.label(value) for value in layout.pane.values] == ["v1", "v2"]
    assert layout.pane.title == "altitude"
    layout.toggle(values("layer", "m", 1))
    assert [layout.pane.label(value) for value in layout.pane.values] == ["v1 altitude", "v2 altitude", "v1 layer"]


def test_the_last_pane_is_emptied() -> None:
    layout = PlotLayout()
    layout.toggle(values("altitude", "m"))
    layout.remove_pane()
    assert len(layout.panes) == 1 and not layout.values


def test_a_view_outlives_the_console(tmp_path: Path) -> None:
    path = tmp_path / "views.json"
    layout = PlotLayout()
    layout.toggle(values("altitude", "m", 3))
    layout.window = WHOLE_FLIGHT
    assert PlotViews(path).save("  power  ", layout) == "view power is saved"
    again = PlotViews(path)
    found = again.layout("power")
    assert found is not None and found.values == layout.values and found.window == WHOLE_FLIGHT
    assert again.remove("power") == "view power is removed" and PlotViews(path).names == []


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        '{"a": 1}',
        '{"a": {"panes": [[["telemetry", 1]]], "window": 1}}',
        '{"a": {"panes": [[["nothing", 1, "x", "m"]]], "window": 1}}',
        "[" * 10_000,
        "x" * 600_000,
    ],
)
def test_a_damaged_file_counts_as_empty(tmp_path: Path, text: str) -> None:
    path = tmp_path / "views.json"
    path.write_text(text)
    views = PlotViews(path)
    assert views.names == []
    assert "saved" in views.save("new", PlotLayout()) and PlotViews(path).names == ["new"]


def test_a_hostile_file_is_cleaned_and_cut(tmp_path: Path) -> None:
    path = tmp_path / "views.json"
    value = ["telemetry", "\x1b[31mteam", "\x07" + "n" * 500, "unit" * 50]
    path.write_text(json.dumps({"\x1b]52;x\x07": {"panes": [[value] * 20] * 20, "window": -(10**9)}}))
    views = PlotViews(path)
    layout = views.layout(views.names[0])
    assert layout is not None and len(layout.panes) == MAX_PANES and layout.window == 0
    assert "\x1b" not in views.names[0] + layout.values[0].label and len(layout.values[0].unit) <= 16


def test_a_view_that_cannot_be_written_is_kept_until_the_console_ends(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    views = PlotViews(tmp_path / "file" / "views.json")
    assert "cannot be written" in views.save("a", PlotLayout()) and views.names == ["a"]


def test_a_view_needs_a_name() -> None:
    assert PlotViews(None).save("   ", PlotLayout()) == "a view needs a name"
