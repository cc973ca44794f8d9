"""What a run would find out too late is refused before it starts."""

import errno
import os
import tempfile

import pytest

from survey.errors import BadInput, Stopped
from survey.request.output_path import check_path


@pytest.mark.parametrize(
    ("reason", "error", "words"),
    [
        (errno.EROFS, Stopped, "is read-only; make it writable"),
        (errno.EACCES, BadInput, "cannot be written to; use -o"),
        (errno.ENOENT, BadInput, "cannot be written to; use -o"),
    ],
)
def test_a_folder_that_takes_no_file_is_refused(tmp_path, monkeypatch, reason, error, words):
    assert check_path(tmp_path / "map.nc") == tmp_path / "map.nc" and not list(tmp_path.iterdir())

    def refuse(*_, **__):
        raise OSError(reason, "refused")

    monkeypatch.setattr(os, "access", lambda *_: False)
    monkeypatch.setattr(tempfile, "TemporaryFile", refuse)
    with pytest.raises(error, match=words):
        check_path(tmp_path / "map.nc")


@pytest.mark.skipif(not os.path.isdir("/proc"), reason="needs /proc")
def test_a_folder_of_the_kernel_takes_no_file():
    with pytest.raises(BadInput, match="cannot be written to; use -o"):
        check_path("/proc/map.nc")
