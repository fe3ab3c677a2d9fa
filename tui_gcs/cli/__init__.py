"""The subcommands of `tui-gcs`, one module each, imported only when asked for."""
