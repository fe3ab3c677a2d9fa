"""What Textual's compositor wants written: the private part `textual._compositor`."""

from collections.abc import Callable, Iterable, Iterator
from typing import cast

from rich.console import Console, RenderableType
from textual._compositor import ChopsUpdate, CompositorUpdate, LayoutUpdate
from textual.app import App
from textual.strip import Strip

Piece = tuple[int, int, Iterable[Strip]]
"""Line, first column, and the strips that stand side by side from there."""


class ScreenUpdates:
    """Reads and replaces the compositor's updates.

    Private: `ChopsUpdate` (fields `chops`, `spans`, `chop_ends`), `LayoutUpdate` (`strips`, `region`) and
    `CompositorUpdate.render_segments`; `Screen._compositor.render_update` and `App._background_screens`. They are
    needed because Textual has no public way to learn which cells an update contains.
    """

    @staticmethod
    def replaced(
        update: RenderableType | None, render: Callable[[CompositorUpdate, Console], str]
    ) -> RenderableType | None:
        """An update that is written as `render` decides at that moment; other renderables stay as they are."""
        if not isinstance(update, ChopsUpdate | LayoutUpdate):
            return update
        return cast("RenderableType", _RenderedUpdate(update, render))  # Textual calls only `render_segments` of it

    @staticmethod
    def pieces(update: object) -> Iterator[Piece]:
        """Everything that an update contains, line by line."""
        if isinstance(update, LayoutUpdate):
            for y, strips in enumerate(update.strips, update.region.y):
                yield y, update.region.x, strips
        elif isinstance(update, ChopsUpdate):
            for y, first, last in update.spans:
                for end, (x, strip) in zip(update.chop_ends[y], update.chops[y].items(), strict=False):
                    if strip is not None and x <= last and end > first:
                        yield y, x, [strip if end <= last else strip.crop(0, min(end, last) - x)]

    @staticmethod
    def whole_screen(app: App[None], *, simplify: bool = False) -> object:
        """An update that contains all of the screen that `app` shows, dialogs and what lies behind them."""
        return app.screen._compositor.render_update(full=True, screen_stack=app._background_screens, simplify=simplify)


class _RenderedUpdate(CompositorUpdate):
    """Takes the place of an update; what it writes is decided when it is written."""

    def __init__(self, update: CompositorUpdate, render: Callable[[CompositorUpdate, Console], str]) -> None:
        self._update = update
        self._render = render

    def render_segments(self, console: Console) -> str:
        return self._render(self._update, console)
