"""Which scene files may run: those whose exact text this user has run here before, or allows in
this process.

Until then, a file that a survey names is untrusted. Texts are identified by their SHA-256; those of
earlier runs are recorded in the user's state folder as empty files, `scenes/HASH`, so that writers
need no lock.
"""

import os
import stat
from contextlib import suppress
from pathlib import Path

import platformdirs

_allowed: set[str] = set()  # in this process
_kept: set[str] = set()  # by this process


def known(digest: str) -> bool:
    """Has this user run the text with this hash here before, or allowed it in this process?"""
    return digest in _allowed or _is_kept(digest)


def allow(digest: str) -> None:
    """Allow the text with this hash to run in this process."""
    _allowed.add(digest)


def keep(digest: str) -> None:
    """Record that this user has run the text with this hash; if nothing can be written, for this
    process only.
    """
    if digest in _kept:
        return
    _kept.add(digest)
    _allowed.add(digest)
    folder = _folder()
    if folder is None:
        return
    with suppress(OSError):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if _is_private(folder, stat.S_ISDIR):
            os.close(
                os.open(
                    folder / digest, os.O_WRONLY | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o600
                )
            )


def _folder() -> Path | None:
    """The folder of the hashes; None without a home: the current folder may be untrusted."""
    try:
        folder = platformdirs.user_state_path("survey") / "scenes"
    except RuntimeError:
        return None
    return folder if folder.is_absolute() else None


def _is_kept(digest: str) -> bool:
    folder = _folder()
    return (
        folder is not None
        and _is_private(folder, stat.S_ISDIR)
        and _is_private(folder / digest, stat.S_ISREG)
    )


def _is_private(path: Path, kind) -> bool:  # type: ignore[no-untyped-def]
    """Is it of this kind, not a link, owned by this user, and writable by nobody else?

    Windows has no owners and modes to look at: there, only this user can write to the user's own
    folders.
    """
    try:
        found = path.lstat()
    except OSError:
        return False
    if not hasattr(os, "geteuid"):
        return kind(found.st_mode)  # type: ignore[no-any-return]
    return (
        kind(found.st_mode)
        and found.st_uid == os.geteuid()
        and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    )
