"""Building blocks of every screen: lines of text, glyphs, inks, the two top lines and the footer.

Entry class: `LinesView`, the base of all text panels: a subclass returns its lines, and only those that changed are
written. `TopLines` and `FooterLine` stand on every screen; `palette.Ink` names what a word or a cell stands for;
`glyphs` has the characters for terminals with and without Unicode; `number_text` and `strips` fit values into cells.

What always holds: text is never markup, whatever a vehicle sent; a value that is not known is `--`; every meaning has a
shape or a word besides its colour.

Not here: panels about vehicles (`widgets.fleet`), the map (`widgets.map`), forms (`widgets.forms`).
"""
