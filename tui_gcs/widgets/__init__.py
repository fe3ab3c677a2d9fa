"""Widgets of the console: they draw state and post messages, one folder per subject.

`basics` has the lines, inks and bars of every screen, `fleet` the roster, grid and panels of vehicles, `map` the map;
`forms` has fields and prompts, `plan`, `missions` and `drafts` what the editing screens edit with. Screens compose
them.

Always: a widget writes only the lines that changed, draws text as it is and never as markup, and can be read without
colour and in ASCII. Models beside widgets (`…_editor`, `…_edits`, `…_text`) know no Textual.

Not here: where a widget stands and what its messages do (`screens/`), requests to the station (`feed/`).
"""
