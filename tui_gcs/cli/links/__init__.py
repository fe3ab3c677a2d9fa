"""`tui-gcs link` and `tui-gcs forward`: links and forwarding partners of the running station, listed and changed.

`parser.add` declares their arguments; `cli.main` imports `verbs` and calls its `run`. What may be done is judged by the
station (`core/requests/links`), as for the links screen.
"""
