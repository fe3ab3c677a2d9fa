"""What the command line, the console and scripts share: starting and finding stations, and the user's settings.

Entry: `launcher.launch` starts a supervised station, detached from the terminal; `launcher.is_running` and
`launcher.start_error` look at it. `user_settings` reads `config.toml` for the command line and the console, and
`settings_file` changes it. Requests to a running station go over the bus and are not here.

What always holds: a station outlives the program that started it, and there is one station per kind of run (SIM, LIVE)
at a time, held by lock files. Nothing here imports Textual.
"""
