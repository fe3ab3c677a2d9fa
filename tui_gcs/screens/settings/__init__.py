"""The settings screen: what `config.toml` knows, with value, origin and meaning, and how it is changed.

`SettingsScreen` reads the file whenever it is shown. What always holds: only the operator's own file is written, a
value that a command would refuse is not, and nothing is asked of the station. Not here: the keys of the file and how it
is written (`client`), and drawing (`widgets/settings`).
"""
