"""Where methods fail: the true error of each, and its error bar, over the planes on which it should
break.

Everything specific to a scene is in the file of its name in `planes/`:

    ABOUT            the scene's planes and what `auto` does on them, in a few sentences of Markdown
    planes(share)    [Plane, ...]; a share below 1 makes them coarser

A user's own file needs none: its plane is spanned by its first two parameters, or by a workflow's
axes (`planes/own_file.py`).
"""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from survey import modules
from survey.errors import BadInput
from survey.failures import planes as folder
from survey.failures.plane import RTOL
from survey.failures.planes import own_file
from survey.file.labels import provenance
from survey.request import ranges
from survey.truth import kept


@dataclass(frozen=True)
class PlaneRecord:
    """One method on one plane; counts of points."""

    name: str
    method: str
    points: int
    refused: int  # no answer; `status` says why
    missed: int  # answered, but an error bar exceeds rtol (1 + |value|)
    undecided: int  # answered, without a verdict
    unchecked: int  # answered, but the truth's own doubt exceeds every bar
    lies: int  # a true error beyond its bar, or a verdict that the truth contradicts
    median_error: float
    largest_error: float
    largest_error_where_met: float
    largest_error_over_bar: float


def write(scene, directory, share=1.0, say=lambda line: None):
    """Hold every method against the truth; failures_SCENE.json, .md and .png in `directory`;
    returns the paths.
    """
    from survey.failures import page, picture

    directory = Path(directory)
    name, about, planes = _planes(scene, share)
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(
            f"-o {str(directory)!r}: cannot make this folder ({error.strerror})"
        ) from None
    results = measure(planes, say)
    records = [
        record(plane, method, found)
        for plane, of in zip(planes, results, strict=True)
        for method, found in of
    ]
    paths = [directory / f"failures_{name}.{kind}" for kind in ("json", "md", "png")]
    written = {
        "rtol": RTOL,
        "planes": [_finite(asdict(r)) for r in records],
        "machine": provenance(),
    }
    paths[0].write_text(json.dumps(written, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    paths[1].write_text(
        page.text(scene, name, about, planes, results, records, share), encoding="utf-8"
    )
    picture.draw(planes, results, paths[2])
    return paths


def _finite(row):
    """The row with None for what is not known or not finite, as JSON has no NaN."""
    return {
        key: None if isinstance(value, float) and not np.isfinite(value) else value
        for key, value in row.items()
    }


def _planes(scene, share):
    """(the name in file names, about, planes) of a built-in scene, or of a user's own file."""
    if not 0.0 < share <= 1.0:
        raise BadInput(f"--share {share:g}: give a number above 0 and up to 1")
    if ranges.is_file(scene):
        return Path(scene).stem, own_file.ABOUT, own_file.planes(scene, share)
    module = modules.load(folder, scene, "failure chart")
    if module is own_file:
        raise BadInput(
            "own_file: name your own file, such as my_equation.py, or a workflow that names it"
        )
    return scene, module.ABOUT, module.planes(share)


def measure(planes, say=lambda line: None):
    """For each plane, [(method, Comparison or None where it is not the method's question), ...]."""
    from survey.failures.compare import compared

    found = []
    for plane in planes:
        with kept():
            found.append([(method, compared(plane, method, RTOL)) for method in plane.methods()])
        say(f"{plane.name}: measured")
    return found


def record(plane, method, found):
    """What the picture shows, in numbers."""
    if found is None:
        return PlaneRecord(
            plane.name, method, plane.size, plane.size, 0, 0, 0, 0, np.nan, np.nan, np.nan, np.nan
        )
    known = found.error[found.answered & np.isfinite(found.error)]
    met = found.error[found.answered & ~found.missed & np.isfinite(found.error)]
    return PlaneRecord(
        plane.name, method, found.answered.size, int((~found.answered).sum()), int(found.missed.sum()),
        int(found.undecided.sum()), int(found.unchecked.sum()), int(found.lie.sum()),
        float(np.median(known)) if known.size else np.nan, float(known.max(initial=0.0)),
        float(met.max(initial=0.0)), float(found.ratio.max(initial=0.0)),
    )  # fmt: skip
