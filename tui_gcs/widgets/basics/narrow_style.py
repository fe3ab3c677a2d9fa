"""Classes that change the look of a few widgets, without styling everything below them again.

Textual styles every widget below the one whose class changes, which for a whole screen takes longer than a key may.
"""

from collections.abc import Iterable, Mapping

from textual.dom import DOMNode
from textual.widget import Widget


def show_classes(node: DOMNode, classes: Mapping[str, bool], affected: Iterable[Widget]) -> None:
    """Set or remove classes of `node` that the style sheet uses for the `affected` widgets alone."""
    before = node.classes
    node.update_classes(classes, update=False)
    if node.classes != before and node.is_attached:
        node.app.stylesheet.update_nodes(widget for widget in affected if widget.is_attached)
