"""Replacing the content of a file as a whole, so that a crash leaves either the old file or the new one."""

import os
import tempfile
from pathlib import Path


def replace_file(path: Path, data: bytes, *, new_mode: int | None = None, sync: bool = True) -> None:
    """Write `data` beside the file and rename it; a link stays a link, and permissions stay.

    A file that does not exist yet gets `new_mode`, or with None what the umask leaves. With `sync` the data is on the
    disk before the rename: that may take long, so a loop that must not wait does without.

    Raises:
        OSError: it could not be written; the old file is unchanged.
    """
    # The target of a link is replaced, not the link.
    real = path.resolve()
    temporary: Path | None = None
    try:
        # In the same directory, since a file is only replaced atomically within one file system; a long name is cut,
        # for prefix and suffix must fit into 255 bytes.
        with tempfile.NamedTemporaryFile("wb", dir=real.parent, prefix=f".{real.name[:50]}.", delete=False) as file:
            temporary = Path(file.name)
            file.write(data)
            file.flush()
            if sync:
                # Without this a crash could leave an empty file under the new name.
                os.fsync(file.fileno())
        temporary.chmod(real.stat().st_mode & 0o7777 if real.exists() else _mode(new_mode))
        temporary.replace(real)
    except OSError:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
        raise


def _mode(new_mode: int | None) -> int:
    if new_mode is not None:
        return new_mode
    mask = os.umask(0o077)
    os.umask(mask)
    return 0o666 & ~mask
