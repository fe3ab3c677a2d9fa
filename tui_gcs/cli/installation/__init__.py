"""What concerns this computer and its user rather than vehicles: settings, shell completion, `tui-gcs doctor`.

`config.apply` fills options that were not typed from `config.toml`; `main` calls it for every command.
`general_options` are `-v`, `-q` and `--no-color`, which every command has. `completion` and `doctor` are commands;
`checks` has what the doctor looks at.

Always true: hold, return, land and stop read no settings, so that a mistake in a file never keeps a vehicle in the air;
what gives rights away or overrides a check is never a setting. Not here: the operator's keys, which are
`actions.keymap`.
"""
