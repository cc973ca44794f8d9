"""A survey's dataset -> one HTML file: its series where it has some, else its points; scripts, and
nothing from a net.

What comes from the file is text: it stands in HTML escaped, or in JSON, and the page puts it into
text nodes alone. The page's policy lets no script run but its own, and nothing be fetched.
"""

import base64
import hashlib
import html
import json
import tomllib
import zlib
from dataclasses import replace
from importlib import resources
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_rgb
from matplotlib.textpath import TextPath

import survey
from survey import status
from survey.analysis import point, zoom
from survey.errors import BadInput, Untrusted
from survey.file.disk import check_folder, write_atomically
from survey.file.labels import flag_codes, scene_statuses
from survey.grid import logarithmic
from survey.model import build, proved
from survey.model.reader import Model
from survey.request import workflow
from survey.show import boundaries, maps, palette
from survey.show.text import fixed_numbers, label_of, literal, options_in_words, spaced
from survey.wording import plain

RTOL = 1e-12  # of the series, at most
BUDGET = 1_000_000  # points that are solved for the series
LARGEST = 1_350_000  # bytes of the model, for a page of less than 2 MB
POINTS = 4_000_000  # of a map without series
FLOATS = 8  # variables of numbers that such a page holds
SAMPLES = 150  # along a side, by which colours of numbers are chosen
KINDS = {"undecided": -1, "unstable": 0, "stable": 1}
ATTRIBUTES = (
    "scene", "options", "method", "rtol", "source", "version_survey", "version_numpy", "version_python", "commit",
    "dirty", "kernel_hash", "history", "status_counts", "verdict_counts", "accuracy_missed",
)  # fmt: skip
EDGES = (
    ("even, periodic (y1' = 0)", "#000000", False), ("odd, periodic (y2 = 0)", "#707070", False),
    ("even, antiperiodic (y1 = 0)", "#000000", True), ("odd, antiperiodic (y2' = 0)", "#707070", True),
)  # fmt: skip
OTHER_EDGES = {  # by rule, in the order of `edgesOf` in engine.js
    "trace": ("D = 2", "D = -2"),
    "danby": (
        "two multipliers meet at -1 (A B = 0)",
        "two multipliers meet at 1 (C D = 0)",
        "two pairs meet (K = 0)",
    ),
    "reciprocal 1": ("two multipliers meet at -1", "two multipliers meet at 1"),
    "reciprocal": ("two pairs meet", "two multipliers meet at 1", "two multipliers meet at -1"),
    "schur": ("a multiplier passes the unit circle",),
}
STYLES = (("#000000", False), ("#000000", True), ("#707070", False))
HINT = (
    "Point at the map for its values. Wheel, pinch or double click: zoom; drag: move. Keyboard: arrows, + and -, 0; "
    "the values are those at the cross."
)


def write(ds, path, at=None, progress=None):
    """Write the page of a survey to `path`; returns {"bytes", "series": does it hold series?,
    "why": else why not, "plane": {axis: value} of the plane that was chosen for a map with more axes,
    "left_out": one line about curves in other planes, or ""}.
    """
    check_folder(path, ".html", ".htm")
    ds = point.plane(ds, at or {})
    chosen = _first_plane(ds)
    ds = point.plane(ds, chosen)
    content, why = made(ds, progress)
    write_atomically(Path(path), content.encode())
    axes = [dim for dim in ds.status.dims if ds.sizes[dim] > 1]
    left_out = boundaries.elsewhere(ds, axes)
    return {
        "bytes": len(content.encode()),
        "series": not why,
        "why": why,
        "plane": chosen,
        "left_out": left_out,
    }


def _first_plane(ds):
    """{axis: value as text} of the axes along which a map of more than two is cut, where pictures cut it."""
    axes = [dim for dim in ds.status.dims if ds.sizes[dim] > 1]
    drawn = boundaries.plane_of(ds) or [dim for dim in axes if ds[dim].dtype.kind in "fi"][:2]
    if len(drawn) < 2:
        return {}
    return {
        dim: str(ds[dim].values[boundaries.position_of(ds, dim)])
        for dim in axes
        if dim not in drawn
    }


def made(ds, progress=None):
    """(the page as text, why it holds no series: "" where it does)."""
    axes = [dim for dim in ds.status.dims if ds.sizes[dim] > 1]
    if len(axes) != 2 or any(ds[dim].dtype.kind not in "fi" for dim in axes):
        raise BadInput(
            f"share: a page shows a map of two numeric axes, and this file has {', '.join(axes) or 'none'}"
        )
    numbers = [f"{c.name} = {float(c):.6g}" for c in fixed_numbers(ds, ds.status.squeeze())]
    about = ", ".join([str(ds.attrs["scene"]), *filter(None, [options_in_words(ds)]), *numbers])
    ds = boundaries.in_plane(ds, ds.status.squeeze())
    ds = ds.squeeze([dim for dim in ds.status.dims if ds.sizes[dim] == 1]).sortby(axes)
    proof = proved.of(ds)
    packed, why = _series(ds, proof, progress)
    table = _common(ds, axes)
    table |= _of_model(ds, packed) if packed else _of_points(ds, axes)
    table["proof"] = bool(packed and proof and proof["names"] == axes)  # the model has it
    return _html(ds, table, proof, why, plain(about, 300)), why


def _series(ds, proof, progress):
    """(the model file, ""), or (None, why there is none)."""
    try:
        checked = workflow.check(zoom.workflow_of(ds))
        checked = replace(
            checked, request=replace(checked.request, rtol=min(checked.request.rtol, RTOL))
        )
        return build.packed(checked, proof, BUDGET, LARGEST, progress), ""
    except Untrusted:
        raise
    except BadInput as refused:
        return None, str(refused).removeprefix("model: ")


def _common(ds, axes):
    """Axes and boundaries."""
    described = []
    for dim in axes:
        values = ds[dim].values.astype(float)
        log = logarithmic(ds[dim].values)
        ends = [float(end) for end in (np.log(values[[0, -1]]) if log else values[[0, -1]])]
        described.append(
            {
                "name": plain(str(dim), 40),
                "log": log,
                "ends": ends,
                "label": _glyphs(label_of(ds[dim])),
            }
        )
    file = "".join(c if c.isalnum() else "_" for c in str(ds.attrs.get("title", "map"))[:60])
    return {"axes": described, "hint": HINT, "file": file, "edges": [], "curves": []}


def _glyphs(text):
    """A label with formulas as the outlines of its glyphs: {"path": SVG path with y upwards, "width"}."""
    drawn = TextPath((0, 0), " ".join(text.split()), size=15)
    parts = []
    letters = {1: "M", 2: "L", 3: "Q", 4: "C", 79: "Z"}
    for points, code in drawn.iter_segments(curves=True, simplify=False):
        parts.append(
            letters[int(code)]
            + ("" if code == 79 else " ".join(f"{value:.1f}" for value in points))
        )
    return {"path": "".join(parts), "width": round(float(drawn.get_extents().x1), 1)}


def _of_model(ds, packed):
    """What a page with series shows."""
    from io import BytesIO

    model = Model(BytesIO(packed))
    colours = palette.colours_of(KINDS)
    shown = [{
        "name": "verdict", "text": "stability", "colours": {code: _rgb(colours[name]) for name, code in KINDS.items()},
        "kinds": [{"text": name, "colour": _rgb(colours[name])} for name in KINDS],
    }]  # fmt: skip
    lattice = [
        np.linspace(low, high, SAMPLES) for low, high in zip(model.low, model.high, strict=True)
    ]
    found = model.grid(*lattice, model.outputs, gradient=False)
    words = {f["name"]: f["long_name"] for f in model.about["functions"]}
    for name in model.outputs:
        said = str(ds[name].attrs.get("long_name", "")) if name in ds else words.get(name, "")
        shown.append(
            {"name": name, "text": f"{name}: {plain(said)}" if said else name} | _scale(found[name])
        )
    rule = model.rule
    given = {}
    if rule != "hill" and "curve_count" in ds:
        given = _curves(ds, model.names)
    others = OTHER_EDGES.get(f"{rule} {len(model.functions)}") or OTHER_EDGES.get(rule, ())
    drawn = (
        EDGES
        if rule == "hill"
        else [(text, *style) for text, style in zip(others, STYLES, strict=False)]
    )
    edges = [{"text": text, "colour": colour, "dash": dash} for text, colour, dash in drawn]
    described = _common(ds, list(model.names))["axes"]
    sides = zip(described, model.low, model.high, strict=True)
    axes = [{**own, "log": False, "ends": [low, high]} for own, low, high in sides]
    return {"model": base64.b64encode(packed).decode(), "shown": shown, "edges": edges, "axes": axes,
            "hatched": "no answer"} | given  # fmt: skip


def _of_points(ds, axes):
    """What a page of points shows: flags, and numbers with their bars."""
    if ds.status.size > POINTS:
        raise BadInput(f"share: the map has {ds.status.size:,} points; a page without series holds at most {POINTS:,}: "
                       "take a part with ds.survey.zoom()")  # fmt: skip
    ds = _separated(ds, axes)
    names = [
        name for name, v in ds.data_vars.items() if set(v.dims) == set(axes) and name != "status"
    ]
    flags = [name for name in names if "flag_values" in ds[name].attrs]
    flags.sort(key=lambda name: name != "verdict")
    floats = [
        name
        for name in names
        if ds[name].dtype.kind in "fi" and name not in flags and not name.endswith("_error")
    ]
    figures = _figures(ds)
    floats.sort(
        key=lambda name: (
            figures.index(named) if (named := name.split(" ")[0]) in figures else len(figures)
        )
    )
    state = ds.status.transpose(*axes)
    shown = []
    variables = {}
    for name in flags + floats[:FLOATS]:
        variable = ds[name].transpose(*axes)
        text = plain(str(variable.attrs.get("long_name", name)))
        if name in flags:
            _, _, colours = palette.kinds_of(ds, variable, state)
            codes = flag_codes(variable.attrs)
            here = set(np.unique(variable.values).tolist())
            kinds = [other for other, code in codes.items() if code in here]
            shown.append({
                "name": name, "text": text, "colours": {codes[other]: _rgb(colours[other]) for other in codes},
                "kinds": [{"text": plain(spaced(other)), "colour": _rgb(colours[other])} for other in kinds],
            })  # fmt: skip
            kind = "i1" if variable.dtype.itemsize == 1 else "i4"
            words = {code: plain(other) for other, code in codes.items()}
            variables[name] = {"flags": words, "values": _packed(variable.values, kind)}
        else:
            answered = np.where(
                np.isin(state.values, list(status.UNANSWERED)),
                np.nan,
                variable.values.astype(float),
            )
            shown.append({"name": name, "text": f"{name}: {text}"} | _scale(answered))
            variables[name] = {
                "flags": None,
                "values": _packed(answered, "f8"),
                "bars": _bars(ds, name, axes),
            }
    if not shown:
        raise BadInput("share: the file holds no variable over both axes")
    codes, own = flag_codes(ds.status.attrs), scene_statuses(ds)
    grid = {
        "axes": [_packed(ds[dim].values, "f8") for dim in axes],
        "status": _packed(state.values, "i1"), "statuses": {code: plain(name) for name, code in codes.items()},
        "unanswered": sorted(status.UNANSWERED), "failed": sorted(status.FAILURES), "variables": variables,
        "greys": {own[name]: _rgb(grey) for name, grey in palette.greys(ds).items() if (state == own[name]).any()},
    }  # fmt: skip
    widened = []
    # half a step more at the ends: whole pixels
    for own, dim in zip(_common(ds, axes)["axes"], axes, strict=True):
        values = np.log(ds[dim].values) if own["log"] else ds[dim].values.astype(float)
        ends = [
            values[0] - 0.5 * (values[1] - values[0]),
            values[-1] + 0.5 * (values[-1] - values[-2]),
        ]
        widened.append({**own, "ends": [float(end) for end in ends]})
    curves = _curves(ds, axes) if "curve_count" in ds else {}
    return {
        "grid": grid,
        "shown": shown,
        "axes": widened,
        "hatched": "outside the domain; crossed: failed",
    } | curves


def _separated(ds, axes):
    """With a variable for each index of an extra dimension: "period (well 2)"."""
    more = {}
    for name, variable in ds.data_vars.items():
        others = [dim for dim in variable.dims if dim not in axes]
        plain_floats = variable.dtype.kind == "f" and not name.endswith("_error")
        if len(others) != 1 or len(variable.dims) != len(axes) + 1 or not plain_floats:
            continue
        dim, bar = others[0], f"{name}_error"
        labels = ds[dim].values if dim in ds.coords else 1 + np.arange(ds.sizes[dim])
        for i, label in enumerate(labels):
            of_dim = f"({plain(str(dim), 40)} {plain(str(label), 40)})"
            words = f"{variable.attrs.get('long_name', name)} {of_dim}"
            more[f"{name} {of_dim}"] = variable.isel({dim: i}, drop=True).assign_attrs(
                long_name=words
            )
            if bar in ds:
                more[f"{name} {of_dim}_error"] = ds[bar].isel({dim: i}, drop=True)
    return ds.assign(more)


def _figures(ds):
    """The names of the variables that the workflow in the file draws."""
    try:
        found = tomllib.loads(str(ds.attrs.get("workflow", "")))["output"]["figures"]
    except (tomllib.TOMLDecodeError, RecursionError, KeyError, TypeError):
        return []
    return [name for name in found if isinstance(name, str)] if isinstance(found, list) else []


def _bars(ds, name, axes):
    bar = f"{name}_error"
    return _packed(ds[bar].transpose(*axes).values, "f4") if bar in ds else None


def _curves(ds, axes):
    """The boundaries in the file: curves with their style, and the legend's entries."""
    curves, edges = [], {}
    for kind, parts in boundaries.curves_of(ds).items():
        text, line = boundaries.CURVES[kind]
        if "marker" in line:
            continue
        dash = [] if line["ls"] == "-" else list(line["ls"][1])
        text = spaced(kind) if len(text) > 30 else text
        edges[text] = {"text": " ".join(text.split()), "colour": line["color"], "dash": bool(dash)}
        for part in parts:
            x, y = (ds[f"curve_{dim}"].values[part] for dim in axes)
            curves.append({"x": _packed(x, "f8"), "y": _packed(y, "f8"), "colour": line["color"], "dash": dash,
                           "width": 1.3 * line["lw"]})  # fmt: skip
    return {"curves": curves, "edges": list(edges.values())}


def _scale(values):
    """Colour table and limits of numbers, as in pictures."""
    shown = np.ma.masked_invalid(values)
    limits = maps.colour_limits(shown) if shown.count() else {}
    low, high = limits.get("vmin", 0.0), limits.get("vmax", 1.0)
    if low < 0.0 < high:
        low, high = -max(-low, high), max(-low, high)
    name = maps.DIVERGING if low < 0.0 < high else maps.SEQUENTIAL
    table = np.rint(255 * colormaps[name](np.linspace(0, 1, 256))[:, :3]).astype(int)
    return {
        "table": table.reshape(-1).tolist(),
        "range": [float(low), float(high if high > low else low + 1.0)],
    }


def _rgb(colour):
    return [round(255 * part) for part in to_rgb(colour)]


def _packed(values, kind):
    """An array for the page: deflated, in base64."""
    types = {"f8": "<f8", "f4": "<f4", "i1": "i1", "i4": "<i4"}
    raw = np.ascontiguousarray(values).astype(types[kind]).tobytes()
    packer = zlib.compressobj(9, wbits=-15)
    return {"type": kind, "data": base64.b64encode(packer.compress(raw) + packer.flush()).decode()}


def _html(ds, table, proof, why, about):
    """The page; `why` it holds no series; `about`: the scene, options and fixed numbers in a line."""
    parts = {name: resources.files(__package__).joinpath(name).read_text(encoding="utf-8")
             for name in ("page.html", "page.css", "model.js", "engine.js", "app.js")}  # fmt: skip
    engine = parts["model.js"] + parts["engine.js"]
    scripts = " ".join(f"'sha256-{_digest(text)}'" for text in (engine, parts["app.js"]))
    title = plain(str(ds.attrs.get("title", "")) or "a stability map", 300)
    kind = ("each point shown with its own value, no point between them" if why else
            "drawn from Chebyshev series with error bars, sharp at every scale")  # fmt: skip
    filled = {
        "policy": f"default-src 'none'; script-src {scripts}; style-src 'unsafe-inline'; img-src data: blob:; "
                  "worker-src blob:; base-uri 'none'; form-action 'none'",
        "version": survey.__version__, "title": html.escape(title), "style": parts["page.css"],
        "subtitle": html.escape(f"{about}: {kind}"),
        "alt": html.escape(f"{title}: a map; arrows move it, plus and minus zoom"), "about": _about(ds, proof, why),
        # no "<" in it: nothing in the data can end the element
        "data": json.dumps(table, allow_nan=False).replace("<", "\\u003c"), "engine": engine, "app": parts["app.js"],
    }  # fmt: skip
    out = []
    for piece in parts["page.html"].split("{{"):
        name, closed, rest = piece.partition("}}")
        out.append(filled[name] + rest if closed else piece)
    return "".join(out)


def _digest(text):
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _about(ds, proof, why):
    """Proof, provenance, and how to cite, as HTML."""
    attrs = ds.attrs
    out = []
    if proof:
        areas = "; ".join(
            f"{plain(name)}: area {a:.9g} to {b:.9g}" for name, (a, b) in proof["areas"].items()
        )
        certificate = html.escape(plain(proof["certificate"]))
        digest = html.escape(plain(proof["sha256"]))
        theorem = html.escape(plain(proof["statement"], 10_000, True))
        out.append(f'<div class="proof"><strong>Proved</strong> ({html.escape(areas)}) by the certificate '
                   f"{certificate}, sha256 {digest}: survey-check {certificate} verifies it"
                   f"<details><summary>the theorem</summary><pre>{theorem}</pre></details></div>")  # fmt: skip
    if why:
        # without what to do: the reader has the page alone
        reason = html.escape(plain(why.partition("; ")[0]))
        out.append(f"<p>The page shows the points that were solved, no series: {reason}.</p>")
    sources = plain(str(attrs.get("references", "")), 2000)
    cite = (
        f"{literal(attrs.get('title', 'A stability map')).rstrip('.')}. Computed with survey "
        f"{attrs.get('version_survey', survey.__version__)}, scene {attrs['scene']}, commit "
        f"{str(attrs.get('commit', 'unknown'))[:12]}. Equations: {sources}"
    )
    out.append(
        f"<details open><summary>how to cite</summary><p>{html.escape(plain(cite, 3000))}</p></details>"
    )
    rows = "\n".join(
        f"{name}: {plain(str(attrs[name]), 2000)}" for name in ATTRIBUTES if name in attrs
    )
    out.append(f"<details><summary>provenance</summary><pre>{html.escape(rows)}</pre></details>")
    text = plain(str(attrs.get("workflow", "")), 20_000, True)
    out.append(f"<details><summary>the workflow</summary><pre>{html.escape(text)}</pre></details>")
    return "\n".join(out)
