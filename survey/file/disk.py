"""Writing so that a path is absent, old or new at every instant."""

import contextlib
import os
import shutil
from pathlib import Path

from rich import filesize

from survey.errors import Stopped, SurveyError


@contextlib.contextmanager
def refused(path, what="writing"):
    """Turn a disk that refuses into one line; a file elsewhere is named in it."""
    try:
        yield
    except SurveyError:
        raise
    except OSError as error:
        told = error.strerror or error
        if isinstance(error.filename, (str, os.PathLike)) and not str(error.filename).startswith(str(path)):
            told = f"{told}: {error.filename}"
        with contextlib.suppress(OSError):
            told = f"{told}; {filesize.decimal(shutil.disk_usage(Path(path).parent).free)} are free"
        raise Stopped(f"{path}: {what} failed ({told}); mend it and run the command again") from None


def write_atomically(path, content, folder=None):
    """Write bytes, or what `content(file)` writes, so that `path` is absent, old or new at every instant.

    In `folder`, on the same disk, lies what is not yet complete; by default beside it.
    """
    part = (folder or path.parent) / f".{path.name}.{os.getpid()}.part"
    try:
        with open(part, "wb") as file:
            content(file) if callable(content) else file.write(content)
            file.flush()
            os.fsync(file.fileno())
        publish(part, path)
    except BaseException:
        with contextlib.suppress(OSError):  # what made it fail is told
            part.unlink(missing_ok=True)
        raise


def publish(part, path):
    """Rename a complete file into place and make the rename durable."""
    os.replace(part, path)
    sync(path.parent)


def sync(folder):
    """Make durable what was made, renamed or removed in the folder."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def digest_of(path):
    """Where the digest of the file at `path` lies."""
    return Path(f"{path}.sha256")
