"""The limit of open files, which each link, console and planner worker needs some of."""

import resource

from tui_gcs.core.base.directories import ConfigError

MIN_OPEN_FILES = 64
"""A station with two teams holds about 40; below this limit its workers or Zenoh fail somewhere in the midst."""
WANTED_OPEN_FILES = 1024


def require_open_files() -> None:
    """Raise the limit of this process and its children to what a station needs; `ConfigError` if that is forbidden."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    allowed = WANTED_OPEN_FILES if hard == resource.RLIM_INFINITY else min(hard, WANTED_OPEN_FILES)
    if soft != resource.RLIM_INFINITY and soft < allowed:
        resource.setrlimit(resource.RLIMIT_NOFILE, (allowed, hard))
    if allowed < MIN_OPEN_FILES:
        why = f"only {allowed} open files are allowed here, {MIN_OPEN_FILES} are needed"
        raise ConfigError(f"{why}: raise the limit (`ulimit -Hn` shows it)")
