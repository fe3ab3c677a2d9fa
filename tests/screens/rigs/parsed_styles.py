"""Makes Textual parse each style sheet once per process.

Every test of the console begins an app, and Textual parses the same style sheets several times for each.
Importing this module, which every rig with a console does, replaces that by one parse per set of variables.
"""

from collections import defaultdict
from typing import Any

from textual._styles_cache import StylesCache
from textual.css.model import RuleSet
from textual.css.stylesheet import Stylesheet

_begin, _set_variables = Stylesheet.__init__, Stylesheet.set_variables
_parsed: defaultdict[tuple[Any, ...], Any] = defaultdict(dict)
"""By the variables (a theme's colours): what Textual keeps for one style sheet, its rules by their text."""


def _with_what_was_parsed(self: Stylesheet, *, variables: dict[str, str] | None = None) -> None:
    _begin(self, variables=variables)
    self._parse_cache = _parsed[tuple(sorted(self._variables.items()))]


def _with_what_was_parsed_with_these(self: Stylesheet, variables: dict[str, str]) -> None:
    self._parse_cache = {}  # type: ignore[assignment]  # it will be cleared
    _set_variables(self, variables)
    self._parse_cache = _parsed[tuple(sorted(variables.items()))]


Stylesheet.__init__ = _with_what_was_parsed  # type: ignore[method-assign]
Stylesheet.set_variables = _with_what_was_parsed_with_these  # type: ignore[method-assign]
RuleSet.__hash__ = object.__hash__  # type: ignore[method-assign]  # its own says `id(self)`, a hundred times slower
# It remembers 1024 results by the cache of lines that asked, and so holds all that consoles of other tests have drawn.
StylesCache.get_inner_outer = StylesCache.get_inner_outer.__wrapped__  # type: ignore[method-assign]
