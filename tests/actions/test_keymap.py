"""Keymap files are judged whole before a console is shown."""

from pathlib import Path

import pytest

from tui_gcs.actions.keymap import RESERVED, KeymapError, _is_known, read_keymap, with_keys
from tui_gcs.actions.scopes import SCOPES


def read(tmp_path: Path, text: str) -> dict[str, str]:
    file = tmp_path / "keymap.toml"
    file.write_text(text)
    return read_keymap(file, SCOPES)


def test_other_keys_reach_bindings_footer_and_help(tmp_path: Path) -> None:
    keymap = read(tmp_path, '[app]\nshow_help = ["f1", "question_mark"]\n[fly]\nzoom_in = "i"\nzoom_out = "plus"\n')
    assert keymap == {"app.show_help": "f1,question_mark", "fly.zoom_in": "i", "fly.zoom_out": "plus"}
    shown = {action.id: action.shown for action in with_keys(SCOPES["app"], "app", keymap)}
    assert shown["show_help"] == "F1/?" and shown["palette"] == ":"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("[app]\nshow_hlp = 'f1'", r"\[app\] show_hlp: no such action; there are: start_stop"),
        ("[flight]\nfit = 'z'", r"\[flight\]: no such part; there are: app, fly, plan"),
        ("[app]\nshow_help = 'exclamation_mark'", "is taken: it begins HOLD ALL"),
        ("[app]\nshow_help = 'escape'", "is taken: it leaves everywhere"),
        ("[fly]\nfit = '5'", "is taken: it numbers vehicles"),
        ("[fly]\nenter = 'x'", "enter: no such action"),
        ("[app]\nshow_help = ''", "is no key"),
        ("[app]\nshow_help = 3", "name keys as"),
        ("[app]\nshow_help = 'o'", "o is for app.(choose_round|show_help) and for app.(choose_round|show_help)"),
        ("[fly]\nfit = 'q'", "q is for app.detach and for fly.fit"),
        ("[app", "no TOML"),
        ("a = " + "[" * 9000, "no TOML"),
        ("[app]\nshow_help = " + "9" * 5000, "no TOML"),
        ("[app]\nshow_help = 'qestion_mark'", "no terminal has such a key"),
        ("[app]\nshow_help = 'f99'", "no terminal has such a key"),
        ("[app]\nstart_stop = 'ctrl+m'", "is taken: it is Enter"),
        ('["\\u001b[31m"]\nfit = "z"', "no such part"),
    ],
)
def test_what_is_wrong_is_one_line_and_nothing_is_used(tmp_path: Path, text: str, why: str) -> None:
    with pytest.raises(KeymapError, match=why) as caught:
        read(tmp_path, text)
    assert str(caught.value).isprintable() and "keymap.toml" in str(caught.value)


def test_every_key_that_an_action_has_can_be_named(tmp_path: Path) -> None:
    keys = {key for actions in SCOPES.values() for action in actions for key in action.keys if key not in RESERVED}
    assert {key for key in keys if not _is_known(key.rsplit("+", 1)[-1])} == set()


def test_a_file_that_is_not_there_says_so(tmp_path: Path) -> None:
    with pytest.raises(KeymapError, match="cannot be read"):
        read_keymap(tmp_path / "none.toml", SCOPES)
