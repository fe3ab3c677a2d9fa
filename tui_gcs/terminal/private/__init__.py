"""The only users of private parts of Textual 8.2.8, one small class for each part.

`compositor.ScreenUpdates` reads what the compositor wants written, `DiffApp` takes it over from `App._display`,
`NonBlockingDriver` looks at the driver's queue of writes, `EscapeKeyParser` extends the parser of key sequences, and
`field_bindings` reads the bindings of a widget. `terminal.variant` imports these modules, and only without `--plain`.

Each part has a contract test in tests/terminal/test_textual_contract.py, which fails with the name of the module to
adapt when another version of Textual has changed it. Not here: what needs only Textual's public interface.
"""
