"""What a dataset's points were asked with: options and parameters."""

from survey.file.labels import options_of
from survey.request.checks import check_options


def options_at(ds, scene):
    """{name: value} of all options of the scene, as in the file; raises BadInput for unknown ones."""
    return check_options(
        scene, options_of(ds), [p.name for p in scene.PARAMETERS if p.name in ds.coords]
    )


def parameters(ds):
    """{name: value} of a point's parameters."""
    return {name: float(c) for name, c in ds.coords.items() if c.ndim == 0 and c.dtype.kind in "fi"}
