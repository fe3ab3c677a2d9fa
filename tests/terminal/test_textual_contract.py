"""Private parts of Textual that terminal/private uses: each is still there, and still means the same.

A failure here names the part and the module to adapt; until then `--plain` runs without any of them.
"""

import inspect
from importlib.metadata import version
from typing import Any

import pytest
from rich.segment import Segment
from textual.app import App
from textual.driver import Driver
from textual.geometry import Region
from textual.strip import Strip
from textual.widgets import Input

STRIP = Strip([Segment("ab")])


def changed(part: str, module: str) -> str:
    return f"Textual {version('textual')} no longer has {part}: adapt tui_gcs/terminal/private/{module}"


def needs(owner: object, name: str, module: str, *parameters: str) -> Any:
    """`owner.name`, which takes these parameters."""
    what = f"{getattr(owner, '__name__', type(owner).__name__)}.{name}"
    part = getattr(owner, name, None)
    assert part is not None, changed(what, module)
    if parameters:
        taken = list(inspect.signature(part).parameters)
        assert all(parameter in taken for parameter in parameters), changed(f"{what}({', '.join(parameters)})", module)
    return part


def test_the_compositors_two_kinds_of_update_have_the_fields_that_the_painter_reads() -> None:
    try:
        from textual._compositor import ChopsUpdate, CompositorUpdate, LayoutUpdate
    except ImportError:
        pytest.fail(changed("textual._compositor.{ChopsUpdate,CompositorUpdate,LayoutUpdate}", "compositor.py"))
    needs(CompositorUpdate, "render_segments", "compositor.py", "console")
    whole = LayoutUpdate([[STRIP]], Region(3, 1, 2, 1))
    assert whole.strips == [[STRIP]] and whole.region.y == 1, changed("LayoutUpdate.strips, region", "compositor.py")
    part = ChopsUpdate([{0: STRIP}], [(0, 0, 2)], [[2]])
    for field, value in (("chops", [{0: STRIP}]), ("spans", [(0, 0, 2)]), ("chop_ends", [[2]])):
        assert getattr(part, field, None) == value, changed(f"ChopsUpdate.{field}", "compositor.py")


async def test_the_app_gives_every_update_to_display_and_its_screen_has_a_compositor() -> None:
    needs(App, "_display", "diff_app.py", "screen", "renderable")
    needs(App, "_set_pointer_shape", "diff_app.py", "shape")
    shown: list[object] = []

    class Watched(App[None]):
        def _display(self, screen: Any, renderable: Any) -> None:
            shown.append(renderable)

    app = Watched()
    async with app.run_test() as pilot:
        await pilot.pause()
        assert isinstance(app._driver, Driver), changed("App._driver", "diff_app.py")
        assert shown, changed("App._display, called for every update", "diff_app.py")
        compositor = needs(app.screen, "_compositor", "compositor.py")
        needs(compositor, "render_update", "compositor.py", "full", "screen_stack", "simplify")
        assert isinstance(app._background_screens, list), changed("App._background_screens", "compositor.py")


def test_the_unix_driver_writes_through_a_queue_and_handles_signals_by_methods() -> None:
    try:
        from textual.drivers._writer_thread import WriterThread
    except ImportError:
        pytest.fail(changed("textual.drivers._writer_thread.WriterThread", "driver.py"))
    from textual.drivers.linux_driver import LinuxDriver

    queue = needs(WriterThread(None), "_queue", "driver.py")
    for method in ("put_nowait", "get_nowait", "qsize"):
        needs(queue, method, "driver.py")
    for method in ("_get_terminal_size", "_sigtstp_application", "_sigcont_application"):
        needs(LinuxDriver, method, "driver.py")
    for attribute, owner in (("_writer_thread", LinuxDriver), ("_loop", Driver)):
        assert f"self.{attribute}" in inspect.getsource(owner), changed(f"{owner.__name__}.{attribute}", "driver.py")


def test_the_unix_driver_makes_its_parser_by_name_and_the_parser_makes_keys_by_a_method() -> None:
    from textual.drivers import linux_driver

    try:
        from textual._xterm_parser import XTermParser
    except ImportError:
        pytest.fail(changed("textual._xterm_parser.XTermParser", "key_parser.py"))
    needs(linux_driver, "XTermParser", "key_parser.py")
    assert "XTermParser(" in inspect.getsource(linux_driver.LinuxDriver), changed("XTermParser(…)", "key_parser.py")
    needs(XTermParser, "feed", "key_parser.py", "data")
    needs(XTermParser, "_sequence_to_key_events", "key_parser.py", "sequence", "alt")
    called = "_sequence_to_key_events" in inspect.getsource(XTermParser.parse)
    assert called, changed("XTermParser._sequence_to_key_events, called for every key", "key_parser.py")


def test_a_widget_has_its_own_bindings_by_key() -> None:
    bindings = needs(Input(), "_bindings", "field_bindings.py")
    by_key = needs(bindings, "key_to_bindings", "field_bindings.py")
    (home,) = by_key.get("home", ())
    assert (home.action, home.priority) == ("home", False), changed("Binding of Input for Home", "field_bindings.py")
