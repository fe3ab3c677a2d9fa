"""The verbs of `tui-gcs vehicle`: what can be asked of single vehicles through the running station.

`parser.add` declares their arguments; `verb.run`, called by `cli.main`, imports the module of the verb and gives it a
`station_client.StationClient`. Each verb sends one request and prints one line per vehicle, or JSON.

Always true: vehicles are named, never implied, wherever something is changed; what could harm is confirmed first
(docs/threats.md D.1); results go to stdout, prompts and progress to stderr. Not here: what a request does, which is
decided by the station (`core.requests`).
"""
