"""What a survey's file contains, as `survey info` prints it."""

from survey.file import schema
from survey.file.labels import counts, flag_codes, percent, repeated
from survey.wording import counted


def summary(ds):
    """The contents of a survey's dataset: axes, fixed numbers, variables, counts, provenance."""
    axes = {
        dim: f"{counted(ds.sizes[dim], 'value')} from {ds[dim].values[0]!s} to {ds[dim].values[-1]!s}"
        for dim in ds.status.dims
        if dim in ds.coords
    }
    return {
        "title": ds.attrs.get("title", ""),
        "scene": ds.attrs["scene"],
        "options": ds.attrs.get("options", ""),
        "axes": axes,
        "fixed": {
            name: float(c) for name, c in ds.coords.items() if c.ndim == 0 and c.dtype.kind == "f"
        },
        "variables": {
            name: v.attrs.get("long_name", "")
            for name, v in ds.data_vars.items()
            if not str(name).endswith("_error")
        },
        **({"areas": areas(ds)} if "area" in ds else {}),
        "counts": counts(ds) | ({"note": again} if (again := repeated(ds)) else {}),
        "provenance": {
            k: v
            for k, v in ds.attrs.items()
            if k not in ("title", "scene", "options", "workflow", "summary", "scene_text")
        },
    }


def areas(ds):
    """{verdict: its area with its error bound, and its fraction of the map} of a refined map."""
    names = ("area", "area_error", "area_fraction", "area_fraction_error")
    schema.areas(ds)
    rows = zip(flag_codes(ds.area_verdict.attrs), *(ds[name].values for name in names), strict=True)
    return {
        name: f"{area:.12g} +- {bar:.2g} ({percent(part, part_bar)})"
        for name, area, bar, part, part_bar in rows
    }
