"""What a dataset's points were asked with: options and parameters."""

from survey.errors import BadInput
from survey.file.labels import options_of
from survey.request.checks import check_options
from survey.scene import exists


def options_at(ds, scene):
    """{name: value} of all options of the scene, as in the file; raises BadInput for unknown ones."""
    return check_options(
        scene, options_of(ds), [p.name for p in scene.PARAMETERS if p.name in ds.coords]
    )


def parameters(ds):
    """{name: value} of a point's parameters."""
    return {name: float(c) for name, c in ds.coords.items() if c.ndim == 0 and c.dtype.kind in "fi"}


def check_names(ds, scene):
    """Raise BadInput where a parameter without a default is no coordinate: it may have another name."""
    options = options_at(ds, scene)
    used = [p for p in scene.PARAMETERS if exists(p, options)]
    given = {p.instead_of or p.name for p in used if p.name in ds.coords}
    missing = [
        p.name for p in used if p.default is None and not p.instead_of and p.name not in given
    ]
    if missing:
        known = {p.name for p in scene.PARAMETERS}
        others = [str(name) for name in ds.coords if name not in known]
        called = others[0] if others else "NAME"
        raise BadInput(
            f"this survey has no coordinate {missing[0]}, a parameter of {ds.attrs['scene']}: give its coordinates the "
            f"names of parameters, such as ds.rename({called}={missing[0]!r})"
        )
