"""Base: clock, files, directories, text and undo, which all other packages use.

Entries: `clock.Clock` (all waiting goes through an injected one), `text.clean` (text from a vehicle becomes safe to
show), `directories` (where SIM and LIVE keep their files), `safe_files.SafeFolder` (files from vehicles),
`regular_file` (files that an operator names), `autosave` and `undo_history` (editors), `rejection_counter`. Nothing
here imports another package of ours, Textual or rich, and nothing knows of vehicles, MAVLink or the bus.
"""
