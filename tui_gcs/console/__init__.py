"""The console's app in parts: keys, commands and their results, alarms, notices and options.

Entry class: `ConsoleApp` in `tui_gcs.app`, which puts the parts together. `KeyInput` takes every key before any screen;
`CommandController` turns keys and confirmed orders into requests; `OrderResults` follows them; `SelectionEntry` reads
which vehicles are meant. Each part gets `ConsoleParts`, and none inherits from another.

What always holds: HOLD ALL works from every screen, dialog and form. No order leaves without the confirmation that its
harm demands. Closing the console stops no flight.

Not here: what a screen shows (`screens`), what can be ordered (`actions`), the connection to the station (`feed`).
"""
