"""Directories that nobody else can change, and what is reported where they cannot be used."""

import grp
import os
import pwd
from pathlib import Path
from types import SimpleNamespace

import pytest

from tui_gcs.core.base.directories import ConfigError, runtime_dir, state_dir
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.signing.keystore import KeyStoreError, open_store


@pytest.fixture
def base(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    made = tmp_path / "outer" / "state"
    made.mkdir(parents=True, mode=0o700)
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(made))
    monkeypatch.setenv("TUI_GCS_RUNTIME_DIR", str(tmp_path / "outer" / "run"))
    return made


def test_they_are_made_private(base: Path) -> None:
    for made in (state_dir(RunKind.LIVE), runtime_dir(RunKind.LIVE)):
        assert made.name == "live" and made.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("place", ["state", "outer"])
def test_a_directory_in_which_every_user_may_rename_is_refused(base: Path, place: str) -> None:
    state_dir(RunKind.LIVE)
    opened = base if place == "state" else base.parent
    opened.chmod(0o777)
    with pytest.raises(ConfigError, match=f"{opened}: every user may write there .* TUI_GCS_STATE_DIR$"):
        state_dir(RunKind.LIVE)
    with pytest.raises(KeyStoreError, match="every user may write there"):
        open_store(RunKind.LIVE)  # without it the station would take unsigned frames
    opened.chmod(0o1777)
    assert state_dir(RunKind.LIVE) == base / "live", "sticky: only owners rename"


@pytest.mark.parametrize("place", ["state", "outer"])
@pytest.mark.parametrize(
    ("name", "members", "refused"),
    [("pilots", [], True), ("own", ["eve"], True), ("own", [], False), ("own", ["own"], False)],
)
def test_a_directory_in_which_a_group_may_rename_is_refused_unless_it_is_the_users_own(
    base: Path, monkeypatch: pytest.MonkeyPatch, place: str, name: str, members: list[str], refused: bool
) -> None:
    """A umask of 002 with a group for each user alone is what many systems come with."""
    state_dir(RunKind.LIVE)
    monkeypatch.setattr(pwd, "getpwuid", lambda user: SimpleNamespace(pw_name="own"))
    monkeypatch.setattr(grp, "getgrgid", lambda group: SimpleNamespace(gr_name=name, gr_mem=members))
    opened = base if place == "state" else base.parent
    opened.chmod(0o775)
    if refused:
        with pytest.raises(ConfigError, match=f"{opened}: its group may write there .* TUI_GCS_STATE_DIR$"):
            state_dir(RunKind.LIVE)
        with pytest.raises(ConfigError, match="its group may write there"):
            runtime_dir(RunKind.LIVE) if place == "outer" else state_dir(RunKind.LIVE)
        opened.chmod(0o1775)
    assert state_dir(RunKind.LIVE) == base / "live"


def test_a_group_without_a_name_is_not_the_users_own(base: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(group: int) -> None:
        raise KeyError(group)

    monkeypatch.setattr(grp, "getgrgid", unknown)
    base.chmod(0o770)
    with pytest.raises(ConfigError, match=f"{base}: its group may write there"):
        state_dir(RunKind.LIVE)


def test_the_runtime_directory_is_checked_the_same_way(base: Path) -> None:
    base.parent.chmod(0o777)
    with pytest.raises(ConfigError, match=r"every user may write there .* TUI_GCS_RUNTIME_DIR$"):
        runtime_dir(RunKind.SIM)


@pytest.mark.skipif(os.getuid() != 0, reason="only root gives files away")
def test_a_directory_of_another_user_is_refused(base: Path) -> None:
    state_dir(RunKind.LIVE)
    os.chown(base, 12345, -1)
    with pytest.raises(ConfigError, match=f"{base}: belongs to another user, .* TUI_GCS_STATE_DIR$"):
        state_dir(RunKind.LIVE)


def test_a_link_is_followed_only_to_a_safe_place(base: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    link = base.parent.parent / "link"
    link.symlink_to(base)
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(link))
    assert state_dir(RunKind.LIVE).exists()
    base.parent.chmod(0o777)
    with pytest.raises(ConfigError, match="every user may write there"):
        state_dir(RunKind.LIVE)


def test_a_directory_that_cannot_be_written_names_its_own_variable(base: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    state_dir(RunKind.SIM)
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(ConfigError, match="sim: cannot be written; set TUI_GCS_STATE_DIR to"):
        state_dir(RunKind.SIM)
    with pytest.raises(ConfigError, match=r"cannot be written; set TUI_GCS_RUNTIME_DIR to"):
        runtime_dir(RunKind.SIM)
