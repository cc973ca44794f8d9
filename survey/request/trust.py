"""Which scenes' files may run: those whose very text this user has run here before, or allows in this process.

A file that a survey names is a stranger's until then. Texts are known by their SHA-256; those of former runs stand in
the user's state folder as empty files, `scenes/HASH`, so that writers need no lock.
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
    """Let the text with this hash run in this process."""
    _allowed.add(digest)


def keep(digest: str) -> None:
    """Remember that this user has run the text with this hash; where nothing can be written, for this process alone."""
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
            os.close(os.open(folder / digest, os.O_WRONLY | os.O_CREAT | os.O_NOFOLLOW, 0o600))


def _folder() -> Path | None:
    """Where the hashes stand; None without a home: a path relative to the current folder may be a stranger's."""
    folder = platformdirs.user_state_path("survey") / "scenes"
    return folder if folder.is_absolute() else None


def _is_kept(digest: str) -> bool:
    folder = _folder()
    return folder is not None and _is_private(folder, stat.S_ISDIR) and _is_private(folder / digest, stat.S_ISREG)


def _is_private(path: Path, kind) -> bool:  # type: ignore[no-untyped-def]
    """Is it of this kind, no link, this user's, and writable by nobody else?"""
    try:
        found = path.lstat()
    except OSError:
        return False
    return kind(found.st_mode) and found.st_uid == os.geteuid() and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
