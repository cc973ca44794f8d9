"""What a run would find out too late is refused before it starts."""

import os
from types import SimpleNamespace

import pytest

from survey.errors import Stopped
from survey.request.output_path import check_path


def test_a_read_only_disk_stops_the_run(tmp_path, monkeypatch):
    assert check_path(tmp_path / "map.nc") == tmp_path / "map.nc"
    monkeypatch.setattr(os, "statvfs", lambda folder: SimpleNamespace(f_flag=os.ST_RDONLY))
    with pytest.raises(Stopped, match="is read-only; make it writable"):
        check_path(tmp_path / "map.nc")
