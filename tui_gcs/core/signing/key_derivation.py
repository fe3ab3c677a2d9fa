"""Signing keys as other ground stations derive them from what an operator types.

One passphrase gives different keys: Mission Planner and MAVProxy hash it once, QGroundControl stretches it.
"""

import hashlib
import re
from typing import Literal

from tui_gcs.core.mavlink.signing import KEY_BYTES
from tui_gcs.core.signing.private_files import KeyStoreError

Form = Literal["hex", "mavproxy", "missionplanner", "qgc"]
MAX_CHARACTERS = 1024
"""Longer texts are refused."""
# From QGroundControl's source of 2026, src/MAVLink/Signing/MAVLinkSigningKeys.h; until 2025 it hashed once.
QGC_SALT = b"QGroundControl-MAVLink-Signing-v1"
QGC_ITERATIONS = 600_000
QGC_MIN_CHARACTERS = 8
_HEX = re.compile(r"[0-9A-Fa-f]{64}")


def secret_from(text: str, form: Form) -> bytes:
    """Return the 32 bytes of key that a ground station derives from `text`.

    hex: the key itself. mavproxy: SHA-256 of an ASCII passphrase. missionplanner: SHA-256 of a UTF-8 passphrase, as in
    QGroundControl until 2025. qgc: PBKDF2-SHA256 of a UTF-8 passphrase, as in QGroundControl since 2026; takes 0.2 s.

    Raises:
        KeyStoreError: `text` is not what that form needs. The text is not repeated.
    """
    if not text or len(text) > MAX_CHARACTERS:
        raise KeyStoreError("nothing was given" if not text else f"longer than {MAX_CHARACTERS} characters")
    if form == "hex":
        if not _HEX.fullmatch(text):
            raise KeyStoreError(f"a key is 64 hex digits; {len(text)} characters were given, or other ones")
        return bytes.fromhex(text)
    if form == "mavproxy" and not text.isascii():
        raise KeyStoreError("MAVProxy takes ASCII passphrases only; --as missionplanner takes any")
    if not _is_unicode(text):
        raise KeyStoreError("the passphrase is not UTF-8 text")
    if form != "qgc":
        return hashlib.sha256(text.encode()).digest()
    if len(text) < QGC_MIN_CHARACTERS:
        raise KeyStoreError(f"QGroundControl takes passphrases of {QGC_MIN_CHARACTERS} characters or more")
    return hashlib.pbkdf2_hmac("sha256", text.encode(), QGC_SALT, QGC_ITERATIONS, KEY_BYTES)


def _is_unicode(text: str) -> bool:
    """Return whether the text has no lone surrogates, which stand for bytes from a terminal that are no UTF-8."""
    return not any("\ud800" <= character <= "\udfff" for character in text)
