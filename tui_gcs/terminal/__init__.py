"""What reads from and writes to the operator's terminal, between Textual and the console.

Entry point: `variant`, which chooses the app class that the console is built on. `DiffApp` (of `private`) writes only
cells that changed and never waits for a terminal that does not read; `PlainApp` is stock Textual (`--plain`). The
console's app uses `KeyQueue`, so that each key is handled completely before the next; `themes` has the colours.

What always holds: private parts of Textual are used in `terminal.private` alone, one class for each part, and each
has a contract test (tests/terminal/test_textual_contract.py). What arrives from the terminal is filtered before it
becomes keys (`input_filter`). Measurements behind the numbers: docs/terminal.md.

Not here: screens, widgets, and which key does what (`actions`).
"""
