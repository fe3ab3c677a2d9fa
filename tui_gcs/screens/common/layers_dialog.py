"""The dialog that switches layers of a map, one number each."""

from textual.app import ComposeResult
from textual.events import Key
from textual.screen import ModalScreen

from tui_gcs.widgets.basics.border_titles import framed, set_title
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_layers import Layer
from tui_gcs.widgets.map.map_view import MapView

NUMBERS = "1234567890b"
"""The keys of the layers, in their order."""
REFRESH_S = 0.5


class LayerLines(LinesView):
    """The list of layers with their numbers, and whether each is shown."""

    DEFAULT_CSS = framed("LayerLines", "width: 34; height: auto; background: #101418;")

    def __init__(self, map_view: MapView) -> None:
        super().__init__(glyphs=map_view.glyphs)
        self._map_view = map_view
        self.styles.height = len(Layer) + 3

    def lines(self, width: int, height: int) -> list[Line]:
        """Return each layer with its number and whether it is shown."""
        shown: list[Line] = []
        for number, layer in zip(NUMBERS, Layer, strict=True):
            on = layer not in self._map_view.content.hidden
            ink = Ink.TEXT if on else Ink.MUTED
            why = self._map_view.base_map_state if layer is Layer.BASE_MAP else ""
            words = f"{layer}: {why}" if why else layer
            shown.append([(f" {number} ", Ink.BOLD), (f"[{'x' if on else ' '}] {words}", ink)])
        return [*shown, [(" number: on, off   Esc: close", Ink.MUTED)]]


class LayersDialog(ModalScreen[None]):
    """A dialog over the map, which changes at once."""

    DEFAULT_CSS = "LayersDialog { align: center middle; background: #101418 0%; }"

    def __init__(self, map_view: MapView) -> None:
        super().__init__()
        self._map_view = map_view
        self._layer_lines = LayerLines(map_view)

    def compose(self) -> ComposeResult:
        """Compose the list of layers."""
        yield self._layer_lines

    def on_mount(self) -> None:
        """Name the box that holds the list."""
        set_title(self._layer_lines, "layers of the map")
        # Tiles of a base map are read meanwhile.
        self.set_interval(REFRESH_S, self._layer_lines.update_lines)

    def on_key(self, event: Key) -> None:
        """Switch a layer by its number; Escape, Enter and q close."""
        layers = dict(zip(NUMBERS, Layer, strict=True))
        if event.key in layers:
            self._map_view.toggle_layer(layers[event.key])
            self._layer_lines.update_lines()
        elif event.key in ("escape", "enter", "q", "L", "shift+l") and self.is_active:  # not for a second key behind it
            self.dismiss()
        event.stop()
