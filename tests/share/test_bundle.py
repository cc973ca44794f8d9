"""Bundles: what is in them, `survey verify` of the whole, and the same bits from their workflow."""

import hashlib
import json
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
import xarray as xr

import survey
from survey.errors import BadInput
from survey.file.disk import digest_of
from survey.share import bundle

SCENE = '''"""Mathieu's equation as one's own."""
from math import cos, pi
PARAMETERS, PERIOD, EVEN = ("a", "q"), pi, True
def z(u, p):
    return p[0] - 2 * p[1] * cos(2 * u)
'''
WORKFLOW = """title = "A map to be kept"
scene = "{scene}"

[axes]
a = {{ start = 0.0, stop = 5.0, num = 30 }}
q = {{ start = 0.1, stop = 2.0, num = 20 }}

[output]
path = "map.nc"
figures = ["verdict", "discriminant"]
"""


def program(folder, *words):
    return subprocess.run(
        [sys.executable, "-m", "survey", *words], cwd=folder, capture_output=True, text=True
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A survey of mathieu, one of a scene of one's own in a folder of its own, and their bundles."""
    path = tmp_path_factory.mktemp("bundles")
    (path / "scenes").mkdir()
    (path / "scenes/own.py").write_text(SCENE)
    for name, scene in (("map", "mathieu"), ("own", "scenes/own.py")):
        (path / f"{name}.toml").write_text(WORKFLOW.format(scene=scene))
        done = program(path, "run", f"{name}.toml", "-o", f"{name}.nc", "--quiet")
        assert done.returncode == 0, done.stderr
    done = program(
        path, "bundle", "map.nc", "--author", "A. Author", "--license", "https://example.org/l"
    )
    assert done.returncode == 0, done.stderr
    done = program(path, "bundle", "own.nc", "-o", "kept")
    assert done.returncode == 0, done.stderr
    return path


@pytest.mark.slow
def test_a_bundle_holds_everything_and_describes_it(folder):
    with zipfile.ZipFile(folder / "map.zip") as archive:
        names = {name.removeprefix("map/") for name in archive.namelist()}
        crate = json.loads(archive.read("map/ro-crate-metadata.json"))
    assert names == {"map.nc", "map.nc.sha256", "workflow.toml", "requirements.txt", "README.md", "map_verdict.png",
                     "map_discriminant.png", "ro-crate-metadata.json"}  # fmt: skip
    graph = {entity["@id"]: entity for entity in crate["@graph"]}
    root, action = graph["./"], graph["#run"]
    assert crate["@context"] == "https://w3id.org/ro/crate/1.1/context"
    assert graph["ro-crate-metadata.json"]["about"] == {"@id": "./"}
    assert {part["@id"] for part in root["hasPart"]} == names - {"ro-crate-metadata.json"}
    assert all(graph[part["@id"]]["@type"] == "File" for part in root["hasPart"])
    assert (
        root["license"] == {"@id": "https://example.org/l"}
        and graph["#author"]["name"] == "A. Author"
    )
    assert root["datePublished"] == survey.open(folder / "map.nc").attrs["date_created"][:10]
    assert {"@id": "map.nc"} in action["result"] and {"@id": "workflow.toml"} in action["object"]


@pytest.mark.parametrize("name", ["map.zip", pytest.param("kept", marks=pytest.mark.slow)])
def test_verify_checks_the_whole(folder, name):
    done = program(folder, "verify", name, "--points", "5", "--trust-scene")
    assert done.returncode == 0, done.stderr
    assert (
        "all files are those that the bundle lists" in done.stdout
        and "within the error bars" in done.stdout
    )


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (
            lambda at: (at / "map_verdict.png").unlink(),
            "map_verdict.png: the bundle lists this file, but it is missing",
        ),
        (
            lambda at: (at / "more.txt").write_text("x"),
            "more.txt: the bundle does not list this file",
        ),
        (lambda at: (at / "README.md").write_text("other"), "README.md: its bits differ"),
        (
            lambda at: (at / "ro-crate-metadata.json").write_text("{}"),
            "does not describe the bundle",
        ),
        (
            lambda at: (at / "workflow.toml").write_text("scene = 'brun'"),
            "not the workflow that the data",
        ),
    ],
)
def test_verify_finds_what_was_changed(folder, tmp_path, change, line):
    with zipfile.ZipFile(folder / "map.zip") as archive:
        archive.extractall(tmp_path)
    change(tmp_path / "map")
    done = program(tmp_path, "verify", "map")
    assert done.returncode == 3 and line in done.stderr and "Traceback" not in done.stderr


@pytest.mark.parametrize("name", [pytest.param("map", marks=pytest.mark.slow), "own"])
def test_run_makes_the_same_bits_again_from_a_bundle(folder, tmp_path, name):
    if name == "map":
        with zipfile.ZipFile(folder / "map.zip") as archive:
            archive.extractall(tmp_path)
        at = tmp_path / "map"
    else:
        at = Path(shutil.copytree(folder / "kept", tmp_path / "kept"))
        assert (at / "own.py").read_text() == SCENE and 'scene = "own.py"' in (
            at / "workflow.toml"
        ).read_text()
    done = program(at, "run", "workflow.toml", "-o", "again.nc", "--quiet")
    assert done.returncode == 0, done.stderr
    with xr.open_dataset(folder / f"{name}.nc") as one, xr.open_dataset(at / "again.nc") as other:
        assert one.load().equals(other.load())


def test_zips_that_are_no_bundles_are_refused(folder, tmp_path):
    for member in ("../evil.nc", "a/b/c.nc", "/etc/x", "map/.hidden"):
        with zipfile.ZipFile(tmp_path / "bad.zip", "w") as archive:
            archive.writestr(member, "x")
        done = program(tmp_path, "verify", "bad.zip")
        assert (
            done.returncode == 3
            and done.stderr.count("\n") == 1
            and "which no bundle does" in done.stderr
        ), member
    with zipfile.ZipFile(tmp_path / "empty.zip", "w"):
        pass
    done = program(tmp_path, "verify", "empty.zip")
    assert done.returncode == 3 and "does not describe the bundle" in done.stderr


def test_what_exists_is_not_overwritten(folder):
    with pytest.raises(BadInput, match="it exists"):
        bundle.write(folder / "map.nc", folder / "map.zip")
    assert not list(folder.glob(".bundle-*"))


def test_only_the_certificate_of_the_proof_is_bundled(folder, tmp_path):
    """A file from a stranger may name any file beside it: what is not the certificate is not packed."""
    text = b"a certificate"
    ds = xr.load_dataset(folder / "map.nc", decode_timedelta=False)
    ds.attrs |= {
        "proof_certificate": "../map.cert",
        "proof_sha256": hashlib.sha256(text).hexdigest(),
    }
    ds.to_netcdf(tmp_path / "map.nc")
    digest_of(tmp_path / "map.nc").write_text(
        f"{hashlib.sha256((tmp_path / 'map.nc').read_bytes()).hexdigest()}  map.nc\n"
    )
    with pytest.raises(BadInput, match=r"map\.cert, the proof's certificate, is not beside"):
        bundle.write(tmp_path / "map.nc", tmp_path / "kept")
    (tmp_path / "map.cert").write_text("a secret")
    with pytest.raises(BadInput, match=r"map\.cert beside .* is not the certificate of its proof"):
        bundle.write(tmp_path / "map.nc", tmp_path / "kept")
    (tmp_path / "map.cert").write_bytes(text)
    assert "map.cert" in bundle.write(tmp_path / "map.nc", tmp_path / "kept")
