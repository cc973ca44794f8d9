"""The documentation's own maps as pages that zoom (`survey share`), in the place of pictures, which
stay as a fallback.

A page is drawn from series where the map has them, so that a few of its points are enough to make
it; else from points.
"""

import html
import re
import shutil
import tomllib
from pathlib import Path
from urllib.parse import quote

import figures

import survey
from survey.request import workflow
from survey.share import page
from survey.sweep import proofs

ROOT = Path(__file__).resolve().parents[2]
LARGEST = 2_000_000  # bytes of a page
SERIES = 9  # points along each axis of a map that has series
MAPS = {  # {workflow whose pictures the pages show: points along each axis, at most}
    "brun_frequency": 150,
    "brun_monodromy": 150,
    "brun_periods": 150,
    "brun_states": 150,
    "brun_triaxial": 150,
    "gyrostat_body": 100,
    "gyrostat_fate": 150,
    "libration_elliptic": SERIES,
    "libration_elliptic_proved": SERIES,
    "libration_elliptic_strip": SERIES,
    "mathieu_proved": SERIES,
    "satellite_areas": SERIES,
    "satellite_prolate": SERIES,
    "satellite_proved": SERIES,
    "satellite_rotations": SERIES,
    "satellite_rotations_oblate": SERIES,
    "satellite_tongues": SERIES,
    "satellite_triaxial": 150,
    "satellite_triaxial_amplitude": 100,
}


def pages(folder):
    """Write the pages, and the pictures that stand for them, to the folder; {picture: its page and
    what it shows}.
    """
    folder.mkdir(parents=True, exist_ok=True)
    found = {}
    for name, points in MAPS.items():
        path = folder / f"{name}.nc"
        written = page.write(_solved(name, points, path), path.with_suffix(".html"))
        if written["series"] != (points == SERIES):
            raise RuntimeError(f"{name}: series {written['series']}, {written['why']}")
        if written["bytes"] > LARGEST:
            raise RuntimeError(f"{name}: a page of {written['bytes']:,} bytes")
        for left in folder.glob(f"{path.name}*"):
            left.unlink()
        given = _given(name)["output"]
        pictures = figures.of_workflow(_path(name), "_proved" if name.endswith("_proved") else "")
        content = path.with_suffix(".html").read_text(encoding="utf-8")
        for picture, variable in zip(pictures, given["figures"], strict=True):
            # of an output in each well, the first one
            if shown := re.search(rf'"name": "({variable}(?: \([^"]*)?)"', content):
                shutil.copy(ROOT / "results" / picture, folder)
                found[picture] = f"{name}.html#show={quote(shown[1])}"
    return found


def _path(name):
    return ROOT / "workflows" / f"{name}.toml"


def _given(name):
    return tomllib.loads(_path(name).read_text(encoding="utf-8"))


def _solved(name, points, path):
    """The map of a workflow with fewer points, and what its certificate states of it, if it has one."""
    given = _given(name)
    axes = {key: own | {"num": min(own["num"], points)} if isinstance(own, dict) else own
            for key, own in given["axes"].items()}  # fmt: skip
    scene = (
        str(_path(name).with_name(given["scene"]))
        if given["scene"].endswith(".py")
        else given["scene"]
    )
    output = {key: own for key, own in given["output"].items() if key != "path"}
    fewer = {key: own for key, own in given.items() if key not in ("boundaries", "refine")}
    ds = survey.run(fewer | {"scene": scene, "axes": axes, "output": output}, output=path)
    certificate = ROOT / "results" / f"{name}.cert"
    if not certificate.is_file():
        return ds
    asked, text = workflow.read(_path(name), (), str(path)), certificate.read_text(encoding="utf-8")
    stated = proofs.described(asked, certificate, text)
    return ds.merge(stated).assign_attrs(stated.attrs)


def replaced(text, name, live):
    """The page `name` with its pictures of these maps replaced; each at its first place."""
    up = "../" * name.count("/")
    for picture, target in live.items():
        at = f"{up}_static/maps"
        text = re.sub(
            rf"!\[([^]]*)\]\({re.escape(up)}results/{re.escape(picture)}\)",
            lambda found, at=at, target=target, picture=picture: _frame(found[1], f"{at}/{target}", f"{at}/{picture}"),
            text, count=1,
        )  # fmt: skip
    return text


def _frame(words, target, picture):
    alt = html.escape(words)
    return (
        f'```{{raw}} html\n<iframe class="map" src="{target}" title="{alt}" loading="lazy"></iframe>\n'
        f'<noscript><img src="{picture}" alt="{alt}"></noscript>\n'
        f'<p><a href="{target}">This map on a page of its own</a></p>\n```'
    )
