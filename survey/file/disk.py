"""Atomic, durable writing, and errors of the disk as one line."""

import contextlib
import os
import shutil
from pathlib import Path

from rich import filesize

from survey.errors import BadInput, Stopped, SurveyError
from survey.wording import shown


@contextlib.contextmanager
def refused(path, what="writing"):
    """Turn an error of the disk into a Stopped of one line, which also names a file elsewhere."""
    try:
        yield
    except SurveyError:
        raise
    except OSError as error:
        reason = error.strerror or error
        if isinstance(error.filename, (str, os.PathLike)) and not str(error.filename).startswith(
            str(path)
        ):
            reason = f"{reason}: {error.filename}"
        with contextlib.suppress(OSError):
            reason = f"{reason}; {filesize.decimal(shutil.disk_usage(Path(path).parent).free)} free"
        raise Stopped(
            f"{path}: {what} failed ({reason}); fix this and run the command again"
        ) from None


def check_folder(path, *endings):
    """Raise BadInput, before anything is computed, where no file can be made at `path`.

    Its folder must exist, and it may be no folder itself; if `endings` are given, it has one of
    them, so that the name of a file of another kind, a survey's say, is not taken for that of this
    one.
    """
    path = Path(path)
    folder = path.parent
    if endings and path.is_dir():
        raise BadInput(
            f"{shown(str(path), 120)} is a folder; name a file that ends in {' or '.join(endings)}, with -o"
        )
    if endings and path.suffix.lower() not in endings:
        example = shown(path.stem + endings[0], 120)
        raise BadInput(
            f"{shown(str(path), 120)}: this file ends in {' or '.join(endings)}; name one, such as {example}"
        )
    if not folder.is_dir():
        raise BadInput(f"{shown(str(path), 120)}: there is no folder {shown(str(folder), 120)}; create it first, "
                       "or name another with -o")  # fmt: skip


def write_atomically(path, content, folder=None):
    """Write bytes, or what `content(file)` writes, so that `path` is absent, old or new at every
    instant.

    The incomplete file lies in `folder`, on the same disk; by default beside `path`.
    """
    part = (folder or path.parent) / f".{path.name}.{os.getpid()}.part"
    try:
        with open(part, "wb") as file:
            content(file) if callable(content) else file.write(content)
            file.flush()
            os.fsync(file.fileno())
        publish(part, path)
    except BaseException:
        with contextlib.suppress(OSError):  # the first error is the one to report
            part.unlink(missing_ok=True)
        raise


def publish(part, path):
    """Rename a complete file into place, durably."""
    os.replace(part, path)
    sync(path.parent)


def sync(folder):
    """Make durable what was created, renamed or removed in the folder."""
    if not hasattr(os, "O_DIRECTORY"):  # Windows opens no folders
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def digest_of(path):
    """The path of the digest of the file at `path`."""
    return Path(f"{path}.sha256")
