"""The documentation's own maps as pages that zoom (`survey share`), in the place of pictures, which stay as a fallback.

A page is drawn from series, so that a few points of the map are enough to make it; a map that has none is that of its
workflow, point by point.
"""

import html
import re
import shutil
import tomllib
from pathlib import Path

import survey
from survey.share import page

ROOT = Path(__file__).resolve().parents[2]
POINTS = 9  # along each axis
MAPS = {  # {picture in results/: scene, options, axes; or the workflow of a map without series}
    "satellite_prolate.png": ("satellite", {"body": "prolate"}, {"k": (0.0, 0.99), "rho": (0.6, 4.0)}),
    "satellite_rotations.png": ("satellite", {"body": "prolate"}, {"k": (1.02, 2.0), "rho": (-3.0, 2.0)}),
    "satellite_rotations_oblate.png": ("satellite", {"body": "oblate"}, {"k": (1.02, 2.0), "rho": (-3.0, 2.0)}),
    "mathieu_proved.png": ("mathieu", {}, {"a": (0.0, 20.0), "q": (0.0, 10.0)}),
    "libration_elliptic.png": ("libration_elliptic", {}, {"mu": (0.0, 0.055), "e": (0.0, 0.98)}),
    "gyrostat_fate.png": "gyrostat_fate.toml",
}
TITLES = {
    "satellite_prolate.png": "Out-of-plane stability of a prolate satellite's librations",
    "satellite_rotations.png": "Tongues of a prolate satellite's rotations",
    "satellite_rotations_oblate.png": "Tongues of an oblate satellite's rotations",
    "mathieu_proved.png": "Mathieu's equation",
    "libration_elliptic.png": "Triangular libration points of the elliptic problem",
}


def pages(folder):
    """Write the pages, and the pictures that stand for them, to the folder; {picture: name of its page}."""
    folder.mkdir(parents=True, exist_ok=True)
    for picture, known in MAPS.items():
        path = folder / f"{picture.removesuffix('.png')}.nc"
        told = page.write(survey.run(_workflow(picture), output=path), path.with_suffix(".html"))
        if not (told["series"] or isinstance(known, str)):
            raise RuntimeError(f"{picture}: no series, {told['why']}")
        for left in folder.glob(f"{path.name}*"):
            left.unlink()
        shutil.copy(ROOT / "results" / picture, folder)
    return {picture: picture.replace(".png", ".html") for picture in MAPS}


def _workflow(picture):
    if isinstance(MAPS[picture], str):
        given = tomllib.loads((ROOT / "workflows" / MAPS[picture]).read_text(encoding="utf-8"))
        return given | {"output": {}}
    scene, options, axes = MAPS[picture]
    table = {name: {"start": low, "stop": high, "num": POINTS} for name, (low, high) in axes.items()}
    return {"title": TITLES[picture], "scene": scene, "options": options, "axes": table}


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
