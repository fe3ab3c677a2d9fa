"""tui-gcs: a ground control station for fleets of autonomous vehicles, in a terminal."""

__version__ = "0.1.0"
