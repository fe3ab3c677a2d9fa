"""Tables and numbers of a report as HTML."""

from collections.abc import Sequence
from html import escape


def table(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: int | None = None) -> str:
    """Return an HTML table; columns from `numbers` on are aligned to the right. Cells of `rows` are HTML already."""

    def cell(tag: str, column: int, text: str) -> str:
        right = ' class="n"' if numbers is not None and column >= numbers else ""
        return f"<{tag}{right}>{text}</{tag}>"

    lines = ["".join(cell("th", i, escape(text)) for i, text in enumerate(head))]
    lines += ["".join(cell("td", i, text) for i, text in enumerate(row)) for row in rows]
    return "<table>" + "".join(f"<tr>{line}</tr>" for line in lines) + "</table>"


def number(value: float | None) -> str:
    """Return a number with at most two decimals, or `--` where there is none."""
    return "--" if value is None else f"{value:.2f}".removesuffix(".00")
