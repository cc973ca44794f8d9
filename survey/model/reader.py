"""Read a model of a map (`survey model`), with numpy alone: this file needs no other of survey and
may be copied.

    model = Model("map.model")
    model(k=0.5, rho=[1.0, 1.2])     # an xarray Dataset: values, error bars, gradients, verdicts
    model.at(k, rho)                 # the same for points: a dict of numpy arrays, without xarray

The file is a zip of `model.json` and `series.f64`: documented in workflows/docs/model.md. On a
panel a function is sum_jk c_jk T_j(X) T_k(Y) within its bar, X and Y from -1 to 1 across the panel.

Sources: J. C. Mason, D. C. Handscomb, Chebyshev Polynomials (2003); I. Schur, J. reine angew. Math.
147 (1917) 205.
"""

import hashlib
import json
import math
import os
import zipfile
import zlib
from functools import cached_property
from itertools import pairwise

import numpy as np

FORMAT, TABLE, SERIES = "survey-model 1", "model.json", "series.f64"
UNDECIDED, UNSTABLE, STABLE = -1, 0, 1
EPS = 2.0**-52
# points whose temporaries stay in the processor's cache, of a grid and of a cell
CHUNK, PART = 16384, 4096
# terms of a cell's series, cells of a panel; points from which on cells pay
CELLS, PIECES, FEW = 16, 4, 100_000
SHORTER = 0.1  # of a cell's bound: what the degrees that are left out may add to it
BATCH = 2**20  # points that are sorted together
MOST_CELLS = 2**16  # what their numbers (uint16) tell apart
FINE = 2**14  # positions along a side, each in one cell
# at most: of a member, of a series along a side, of all series
BYTES, TERMS, DENSE = 2**28, 2**10, 2**27
HALF, INVARIANTS = ("y1", "dy1", "y2", "dy2"), ("A", "B", "C", "D", "t")
DERIVED = {"hill": ("discriminant", "exponent"), "trace": ("exponent",), "danby": ("a", "b")}


class OutOfDomain(ValueError):
    """A point outside the rectangle on which the model is known."""


class Model:
    """The model in the file `path`: `about` is its table, `names` the two parameters, `low` and
    `high` its rectangle.

    Raises ValueError, in one line, where the file is not a model or its bits have changed.
    """

    def __init__(self, path):
        self.about, series = _read(path)
        if self.about.get("format") != FORMAT:
            raise ValueError(f"{path}: the format is {self.about.get('format')!r}, not {FORMAT!r}")
        if hashlib.sha256(series).hexdigest() != self.about.get("sha256"):
            raise ValueError(f"{path}: its bits have changed (sha256); copy or make it again")
        try:
            _check(self.about, len(series) // 8)
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise ValueError(
                f"{path}: {TABLE} is not that of a model ({error!r}); make it again"
            ) from None
        self.names = tuple(p["name"] for p in self.about["parameters"])
        self.low, self.high = (
            tuple(p[end] for p in self.about["parameters"]) for end in ("low", "high")
        )
        self.functions = tuple(f["name"] for f in self.about["functions"])
        self.rule = self.about["rule"]
        self.outputs = tuple(dict.fromkeys((*DERIVED.get(self.rule, ()), *self.functions)))
        numbers = np.frombuffer(series, "<f8")
        self._panels = [_Panel(panel, numbers) for panel in self.about["panels"]]

    def __repr__(self):
        ends = zip(self.names, self.low, self.high, strict=True)
        return f"<Model of {self.about['title']!r}: {', '.join(f'{a:g} <= {n} <= {b:g}' for n, a, b in ends)}>"

    def __call__(self, variables=None, gradient=True, **parameters):
        """Values, bars `X_error`, gradients `X_by_NAME` and `verdict` as an xarray Dataset.

        `variables`: names of `outputs`; by default the first. `gradient=False`: without gradients.
        Numbers become scalar coordinates, 1-D arrays dimensions of their own (a grid), and
        DataArrays keep theirs, so that those that share one are taken point by point.
        """
        import xarray as xr

        if set(parameters) != set(self.names):
            raise ValueError(
                f"model({', '.join(parameters)}): give {self.names[0]} and {self.names[1]}"
            )
        given = [self._labelled(xr, name, parameters[name]) for name in self.names]
        x, y = (array.values.astype(float) for array in given)
        if given[0].ndim == 1 and given[1].ndim == 1 and given[0].dims != given[1].dims:
            found, shape = self.grid(x, y, variables, gradient), given
        else:
            shape = xr.broadcast(*given)
            found = self.at(*(own.values.astype(float) for own in shape), variables, gradient)
        dims = given[0].dims + given[1].dims if shape is given else shape[0].dims
        words = {f["name"]: f["long_name"] for f in self.about["functions"]}
        data = {
            name: (dims, values, self._attributes(name, words)) for name, values in found.items()
        }
        about = {key: self.about[key] for key in ("title", "scene", "options")} | {
            "source": "a model by series"
        }
        if self.about.get("proof"):
            about["proof"] = self.about["proof"]["statement"]
        return xr.Dataset(data, dict(zip(self.names, given, strict=True)), about)

    @staticmethod
    def _labelled(xr, name, value):
        if isinstance(value, xr.DataArray):
            return value
        value = np.asarray(value, dtype=float)
        if value.ndim > 1:
            raise ValueError(
                f"{name}: an array of {value.ndim} dimensions needs names for them; give a DataArray"
            )
        return xr.DataArray(value, dims=(name,) if value.ndim else ())

    def _attributes(self, name, words):
        if name == "verdict":
            return {"long_name": "stability", "flag_values": np.array([-1, 0, 1], np.int8),
                    "flag_meanings": "undecided unstable stable"}  # fmt: skip
        if name.endswith("_error"):
            return {"long_name": f"error bound of {name.removesuffix('_error')}"}
        return {"long_name": words.get(name, name.replace("_by_", ", derivative with respect to "))}

    def at(self, x, y, variables=None, gradient=True):
        """The outputs of points x, y (arrays of one shape), in a dict of arrays of that shape.

        From 100,000 points on, D comes from series on smaller cells, ten times as fast; points that
        these leave undecided from the factors. A point without an answer (around a singularity) has
        NaN and the verdict -1.
        """
        x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        shape, x, y = (
            x.shape,
            np.ascontiguousarray(x).reshape(-1),
            np.ascontiguousarray(y).reshape(-1),
        )
        self._check(x, y)
        wanted, out = self._prepared(variables, gradient, x.size)
        if x.size >= FEW and self._cells is not None and wanted == ("discriminant",):
            self._by_cells(x, y, out)
        else:
            self._one_by_one(x, y, wanted, out, np.arange(x.size))
        return {name: values.reshape(shape) for name, values in out.items()}

    def grid(self, x, y, variables=None, gradient=True):
        """The outputs (N1, N2) of the grid of x (N1) and y (N2), in a dict."""
        x, y = np.asarray(x, dtype=float).reshape(-1), np.asarray(y, dtype=float).reshape(-1)
        self._check(x, y)
        wanted, out = self._prepared(variables, gradient, (x.size, y.size))
        for panel in self._panels:
            rows, columns = (_run(panel.holds(values, side)) for side, values in enumerate((x, y)))
            if rows is not None and columns is not None:
                self._on_grid(panel, x, y, rows, columns, wanted, out)
        return out

    def _on_grid(self, panel, x, y, rows, columns, wanted, out):
        table, slope = panel.tables(y[columns], 1)
        # sums over y first: they serve all rows
        sums, slopes = panel.series @ table, panel.series @ slope
        some = np.arange(x.size)[rows]
        for part in np.split(
            some, range(max(1, CHUNK // table.shape[1]), some.size, max(1, CHUNK // table.shape[1]))
        ):
            across, slant = panel.tables(x[part], 0)
            slants = (slant.T @ sums, across.T @ slopes) if len(out) > 2 * len(wanted) + 1 else None
            found = answer(self.rule, across.T @ sums, panel.bars, slants, wanted, self.names)
            for name, own in found.items():
                if isinstance(columns, slice) and part[-1] - part[0] == part.size - 1:
                    out[name][part[0] : part[-1] + 1, columns] = own
                else:
                    out[name][np.ix_(part, np.arange(y.size)[columns])] = own

    def _check(self, x, y):
        for name, values, low, high in zip(self.names, (x, y), self.low, self.high, strict=True):
            if values.size and not (low <= values.min() and values.max() <= high):
                wrong = values[~((values >= low) & (values <= high))].flat[0]
                raise OutOfDomain(
                    f"{name} = {float(wrong)!r}: the model is known for {float(low)!r} <= {name} <= {float(high)!r}"
                )

    def _prepared(self, variables, gradient, shape):
        """(the names that are wanted, empty outputs)."""
        wanted = (
            (self.outputs[0],)
            if variables is None
            else (variables,)
            if isinstance(variables, str)
            else tuple(variables)
        )
        for name in wanted:
            if name not in self.outputs:
                raise ValueError(f"unknown variable {name!r} (allowed: {', '.join(self.outputs)})")
        out = {}
        for name in wanted:
            for own in (name, f"{name}_error", *(f"{name}_by_{p}" for p in self.names if gradient)):
                out[own] = np.full(shape, np.nan)
        return wanted, out | {"verdict": np.full(shape, UNDECIDED, np.int8)}

    def _one_by_one(self, x, y, wanted, out, points):
        """Answer some points from the functions themselves."""
        for panel in self._panels:
            own = points[panel.holds(x[points], 0) & panel.holds(y[points], 1)]
            for part in np.split(own, range(CHUNK, own.size, CHUNK)):
                if not part.size:
                    continue
                (across, slant), (table, slope) = panel.tables(x[part], 0), panel.tables(y[part], 1)
                rows = panel.transposed @ across
                slants = None
                if len(out) > 2 * len(wanted) + 1:
                    slants = (
                        ((panel.transposed @ slant) * table).sum(axis=1),
                        (rows * slope).sum(axis=1),
                    )
                found = answer(
                    self.rule, (rows * table).sum(axis=1), panel.bars, slants, wanted, self.names
                )
                for name, one in found.items():
                    out[name][part] = one

    @cached_property
    def _cells(self):
        """Series of D on cells of the panels; None where the rule knows no D, or there are too many
        to be numbered.
        """
        if self.rule not in ("hill", "trace"):
            return None
        lattice = [_lattice(self, side, PIECES) for side in range(2)]
        return (
            _Cells(self, lattice)
            if math.prod(edges.size - 1 for edges in lattice) <= MOST_CELLS
            else None
        )

    def _by_cells(self, x, y, out):
        left = [
            self._cells.solve(x, y, out, slice(first, min(first + BATCH, x.size)))
            for first in range(0, x.size, BATCH)
        ]
        left = np.concatenate(left)
        if left.size:
            own = {name: np.full(left.size, UNDECIDED if name == "verdict" else np.nan, values.dtype)
                   for name, values in out.items()}  # fmt: skip
            self._one_by_one(x[left], y[left], ("discriminant",), own, np.arange(left.size))
            for name, values in own.items():
                out[name][left] = values


def _read(path):
    """(the table, the bytes of the series) of a model; raises ValueError where the file holds none."""
    # a file that is open already
    if not isinstance(path, str | os.PathLike) and not hasattr(path, "seek"):
        raise TypeError(
            f"Model: give the path of a file that survey model has made, not {path!r:.80}"
        )
    try:
        with zipfile.ZipFile(path) as archive:
            for member in (TABLE, SERIES):
                if archive.getinfo(member).file_size > BYTES:
                    raise ValueError(f"{member} would unpack to more than {BYTES:,} bytes")
            table = json.loads(archive.read(TABLE))
            series = archive.read(SERIES)
        if not isinstance(table, dict):
            raise ValueError(f"{TABLE} holds no object")
    except (
        zipfile.BadZipFile,
        zlib.error,
        EOFError,
        OSError,
        KeyError,
        ValueError,
        RuntimeError,
    ) as error:
        if isinstance(error, FileNotFoundError):
            raise FileNotFoundError(
                f"{path}: there is no such file; name one that survey model has made"
            ) from None
        if getattr(error, "filename", None) is not None:  # it may not be read
            raise
        raise ValueError(
            f"{path}: this is not a model of survey ({error}); make one with survey model"
        ) from None
    return table, series


def _check(about, size):
    """Raise an error unless the table is what the format says of a file of `size` coefficients."""

    def need(right, what):
        if not right:
            raise ValueError(what)

    def numbers(values, count):
        return len(values) == count and all(
            type(v) in (int, float) and math.isfinite(v) for v in values
        )

    need(
        all(isinstance(about[key], str) for key in ("title", "scene", "options")),
        "title, scene, options",
    )
    need(not about.get("proof") or isinstance(about["proof"]["statement"], str), "proof")
    own, rule = about["parameters"], about["rule"]
    need(len(own) == 2 and all(p["name"].isidentifier() for p in own), "parameters")
    need(
        all(numbers([p["low"], p["high"]], 2) and p["low"] < p["high"] for p in own),
        "ends of the parameters",
    )
    names = [f["name"] for f in about["functions"]]
    known = {"hill": HALF, "trace": ("discriminant",), "danby": INVARIANTS}
    labels = known.get(rule, [f"c{k + 1}" for k in range(len(names))])
    need(rule in RULES and names and names == list(labels), "rule and functions")
    need(rule != "reciprocal" or len(names) <= 2, "rule and functions")
    need(all(isinstance(f["long_name"], str) for f in about["functions"]), "functions")
    dense = 0
    for panel in about["panels"]:
        low, high, first, terms = (panel[key] for key in ("low", "high", "first", "terms"))
        need(
            numbers(low, 2) and numbers(high, 2) and low[0] < high[0] and low[1] < high[1],
            "ends of a panel",
        )
        need(numbers(panel["bars"], len(names)) and min(panel["bars"]) >= 0, "bars of a panel")
        counts = [count for own in terms for count in own]
        need(
            len(terms) == len(names) and all(type(n) is int and 0 <= n <= TERMS for n in counts),
            "terms",
        )
        need(type(first) is int and 0 <= first <= size - sum(counts), "first of a panel")
        longest = max(map(len, terms))
        need(longest <= TERMS, "terms")
        dense += len(names) * longest * max(counts, default=1)
    need(about["panels"] and dense <= DENSE, "panels")


class _Panel:
    """One panel: `series` (F, n, m) of T_j in x by T_k in y, and `bars` (F)."""

    def __init__(self, table, numbers):
        self.low = table["low"]
        self.high = table["high"]
        self.bars = np.array(table["bars"])
        n = max(1, max(map(len, table["terms"])))
        m = max(max(terms, default=1) for terms in table["terms"])
        self.series = np.zeros((len(table["terms"]), n, m))
        at = table["first"]
        for own, terms in zip(self.series, table["terms"], strict=True):
            for j, count in enumerate(terms):
                own[j, :count] = numbers[at : at + count]
                at += count
        self.transposed = np.ascontiguousarray(np.swapaxes(self.series, 1, 2))

    def holds(self, values, side):
        return (values >= self.low[side]) & (values <= self.high[side])

    def tables(self, values, side):
        """T_k (n, N) at `values`, and their derivatives with respect to the parameter."""
        width = self.high[side] - self.low[side]
        x = ((values - self.low[side]) + (values - self.high[side])) / width
        table, slope = tables(x, self.series.shape[1 + side])
        slope *= 2.0 / width
        return table, slope


def tables(x, n):
    """T_0 ... T_(n-1) at x (N): (n, N); and their derivatives."""
    table, slope = np.empty((n, x.size)), np.zeros((n, x.size))
    table[0] = 1.0
    if n > 1:
        table[1], slope[1] = x, 1.0
    twice = 2.0 * x
    for k in range(2, n):
        np.multiply(twice, table[k - 1], out=table[k])
        table[k] -= table[k - 2]
        np.multiply(twice, slope[k - 1], out=slope[k])
        slope[k] += 2.0 * table[k - 1]
        slope[k] -= slope[k - 2]
    return table, slope


def _run(inside):
    """The indices that are True: a slice where they follow each other, else their numbers; None if
    there are none.
    """
    at = np.flatnonzero(inside)
    if not at.size:
        return None
    return slice(at[0], at[-1] + 1) if at[-1] - at[0] == at.size - 1 else at


class _Cells:
    """D as short series on the cells of a lattice that refines the panels, with its derivatives,
    and its bars.
    """

    def __init__(self, model, lattice):
        self.low, sizes = model.low, np.subtract(model.high, model.low)
        self.scale = FINE / sizes
        self._solve(model, lattice)
        at = [np.searchsorted(edges, low + (np.arange(FINE) + 0.5) / scale, side="right") - 1
              for edges, low, scale in zip(lattice, model.low, self.scale, strict=True)]  # fmt: skip
        self.cells = (at[0] * (lattice[1].size - 1)).astype(np.uint16), at[1].astype(np.uint16)

    def _solve(self, model, lattice):
        """Fill `series` (cells, 3 q, q): of D and its derivatives; and `bars` (cells), NaN where
        there is no panel.
        """
        q, (across, along) = CELLS, (edges.size - 1 for edges in lattice)
        self.middle, self.inverse = [], []
        for edges, number, axis in zip(lattice, (across, along), (1, 0), strict=True):
            middle, inverse = 0.5 * (edges[1:] + edges[:-1]), 2.0 / np.diff(edges)
            shape = (number, along) if axis == 1 else (across, number)
            self.middle.append(np.broadcast_to(np.expand_dims(middle, axis), shape).reshape(-1))
            self.inverse.append(np.broadcast_to(np.expand_dims(inverse, axis), shape).reshape(-1))
        self.series = np.zeros((across, along, 3, q, q))
        self.bars = np.full((across, along), np.nan)
        theta = np.pi * (np.arange(q) + 0.5) / q
        matrix = 2.0 / q * np.cos(np.outer(np.arange(q), theta))
        matrix[0] /= 2
        derive = np.polynomial.chebyshev.chebder(np.eye(q), axis=0)  # (q - 1, q)
        derive = np.vstack([derive, np.zeros(q)])
        for panel in model._panels:
            own, nodes = [], []
            for side, edges in enumerate(lattice):
                middle = 0.5 * (edges[1:] + edges[:-1])
                inside = np.flatnonzero(panel.holds(middle, side))
                own.append(inside)
                nodes.append(
                    middle[inside, None] + 0.5 * np.diff(edges)[inside, None] * np.cos(theta)
                )
            table = panel.tables(nodes[1].reshape(-1), 1)[0]
            sums = panel.series @ table
            for i, x in zip(own[0], nodes[0], strict=True):
                values = panel.tables(x, 0)[0].T @ sums  # (F, q, cells q)
                found = answer(model.rule, values, panel.bars, None, ("discriminant",), model.names)
                d, bar = (
                    found[name].reshape(q, own[1].size, q).swapaxes(0, 1)
                    for name in ("discriminant", "discriminant_error")
                )
                series = matrix @ d @ matrix.T
                size = abs(series)
                tail = 0.0
                for axis in (1, 2):
                    ends = size.sum(axis=3 - axis)
                    tail = tail + 2.0 * ends[:, -2:].sum(axis=1)
                rounding = EPS * (
                    size * (20.0 + 4.0 * np.add.outer(np.arange(q) ** 2, np.arange(q) ** 2))
                ).sum(axis=(1, 2))
                bars = 1.5 * bar.max(axis=(1, 2))
                self.series[i, own[1], 0] = series
                self.series[i, own[1], 1] = derive @ series * (2.0 / np.diff(lattice[0])[i])
                self.series[i, own[1], 2] = (
                    series @ derive.T * (2.0 / np.diff(lattice[1])[own[1], None, None])
                )
                self.bars[i, own[1]] = bars + tail + rounding
        self._shorten(self.series.reshape(-1, 3, q, q), self.bars.reshape(-1))

    def _shorten(self, series, bars):
        """Leave out of each cell the highest degrees, as long as they add to its bound by a tenth at most."""
        q = series.shape[-1]
        degree = np.maximum.outer(np.arange(q), np.arange(q))
        size = abs(series[:, 0])
        layers = np.stack(
            [size[:, degree == k].sum(axis=1) for k in range(q)] + [np.zeros(bars.size)], axis=1
        )
        rest = layers[:, ::-1].cumsum(axis=1)[:, ::-1]
        kept = np.maximum((rest > SHORTER * bars[:, None]).sum(axis=1), 2)
        self.bars = bars + 1.001 * rest[np.arange(bars.size), kept]
        self.series = [
            own[:, :k, :k].reshape(3 * k, k) for own, k in zip(series, kept, strict=True)
        ]

    def solve(self, x, y, out, lot):
        """Answer a `lot` (slice) of the points from their cells; returns those that stay undecided."""
        x, y = x[lot], y[lot]
        at = [np.clip((values - low) * scale, 0, FINE - 1).astype(np.int16)
              for values, low, scale in zip((x, y), self.low, self.scale, strict=True)]  # fmt: skip
        cell = self.cells[0][at[0]] + self.cells[1][at[1]]
        order = np.argsort(cell, kind="stable")
        ends = np.searchsorted(cell[order], np.arange(self.bars.size + 1))
        parts = 3 if len(out) > 3 else 1  # D and its derivatives
        found, x, y = np.empty((parts, x.size)), x[order], y[order]
        # memory that is used again: fresh pages cost more than the arithmetic
        tables, products = np.empty(2 * CELLS * PART), np.empty(parts * CELLS * PART)
        for c in np.flatnonzero(np.diff(ends)):
            q = self.series[c].shape[1]
            series = self.series[c][: parts * q]
            for first in range(ends[c], ends[c + 1], PART):
                part = slice(first, min(first + PART, ends[c + 1]))
                n = part.stop - first
                table = tables[: 2 * q * n].reshape(q, 2, n)
                sums = products[: parts * q * n].reshape(parts * q, n)
                for values, side in ((x, 0), (y, 1)):
                    np.subtract(values[part], self.middle[side][c], out=table[1, side])
                    table[1, side] *= self.inverse[side][c]
                _short_tables(table)
                np.matmul(series, table[:, 1], out=sums)
                np.einsum("pqn,qn->pn", sums.reshape(parts, q, n), table[:, 0], out=found[:, part])
        bars, values = self.bars[cell], out["discriminant"][lot]
        names = ("discriminant", *(name for name in out if "_by_" in name))
        for name, own in zip(names, found, strict=True):
            out[name][lot][order] = own
        out["discriminant_error"][lot] = bars
        size = np.abs(values)
        size -= 2.0
        out["verdict"][lot] = (size < -bars).view(np.int8) - (abs(size) <= bars).view(np.int8)
        open_points = (out["verdict"][lot] == UNDECIDED) | ~np.isfinite(
            out["discriminant_error"][lot]
        )
        return lot.start + np.flatnonzero(open_points)


def _lattice(model, side, pieces):
    """The edges of the panels along one side, and of their `pieces`."""
    edges = sorted({end for panel in model._panels for end in (panel.low[side], panel.high[side])})
    fine = [low + (high - low) * np.arange(pieces) / pieces for low, high in pairwise(edges)]
    return np.append(np.concatenate(fine), edges[-1])


def _short_tables(table):
    """T_2 ... into `table` (q, 2, N), whose second row holds the points, by T_(m+n) = 2 T_m T_n - T_|m-n|."""
    table[0], last, q = 1.0, 1, len(table)
    while last < q - 1:
        most = min(2 * last, q - 1)
        end = 2 * last - most - 1
        np.multiply(2.0 * table[last], table[1 : most - last + 1], out=table[last + 1 : most + 1])
        table[last + 1 : most + 1] -= table[last - 1 : end if end >= 0 else None : -1]
        last = most


def answer(rule, values, bars, slopes, wanted, names):
    """The outputs of points from the functions' `values` (F, ...), `bars` (F) and derivatives, by
    rule.

    A dict of `wanted` names, `X_error`, `X_by_NAME` and `verdict`; `slopes` (2, F, ...) or None.
    """
    return RULES[rule](values, bars, slopes, wanted, names)


def _product(a, b, bar_a, bar_b):
    """a b and its error bound."""
    value = a * b
    return value, bar_a * abs(b) + bar_b * abs(a) + (bar_a * bar_b + EPS * abs(value))


def _functions(values, bars, slopes, wanted, names, labels):
    """Those of the functions themselves that are wanted."""
    out = {}
    for f, label in enumerate(labels):
        if label in wanted:
            out[label], out[f"{label}_error"] = values[f], np.broadcast_to(bars[f], values[f].shape)
            if slopes is not None:
                out |= {
                    f"{label}_by_{name}": slope[f]
                    for name, slope in zip(names, slopes, strict=True)
                }
    return out


def _hill(values, bars, slopes, wanted, names):
    """y1, y1', y2, y2' at half a period: D = 2 + 4 y1' y2 = 4 y1 y2' - 2; unstable where y1' y2 > 0
    or y1 y2' < 0.
    """
    y1, dy1, y2, dy2 = values
    sine, sine_bar = _product(dy1, y2, bars[1], bars[2])
    cosine, cosine_bar = _product(y1, dy2, bars[0], bars[3])
    # signs of the factors: nothing cancels
    known = [abs(value) > bar for value, bar in zip(values, bars, strict=True)]
    both, others = known[0] & known[3], known[1] & known[2]
    up, down = (y1 > 0) == (dy2 > 0), (dy1 > 0) != (y2 > 0)
    out = _functions(values, bars, slopes, wanted, names, HALF)
    verdict = np.full(y1.shape, UNDECIDED, np.int8)
    verdict[both & others & up & down] = STABLE
    verdict[(both & ~up) | (others & ~down)] = UNSTABLE
    out["verdict"] = verdict
    if "discriminant" in wanted:
        by_sine = sine_bar <= cosine_bar
        out["discriminant"] = np.where(by_sine, 2.0 + 4.0 * sine, 4.0 * cosine - 2.0)
        out["discriminant_error"] = 4.0 * np.minimum(sine_bar, cosine_bar) + EPS * (
            2.0 + abs(out["discriminant"])
        )
        for name, slope in zip(names, slopes if slopes is not None else (), strict=False):
            one, other = slope[1] * y2 + dy1 * slope[2], slope[0] * dy2 + y1 * slope[3]
            out[f"discriminant_by_{name}"] = 4.0 * np.where(by_sine, one, other)
    if "exponent" in wanted:
        # sinh^2(exponent / 2) is the product that is positive where the point is unstable
        first = sine > -cosine
        square, bar = np.where(first, sine, -cosine), np.where(first, sine_bar, cosine_bar)
        out |= _exponent(square, bar, verdict)
        for name, slope in zip(names, slopes if slopes is not None else (), strict=False):
            one, other = slope[1] * y2 + dy1 * slope[2], -(slope[0] * dy2 + y1 * slope[3])
            out[f"exponent_by_{name}"] = _growth(np.where(first, one, other), square, verdict)
    return out


def _exponent(square, bar, verdict):
    """2 asinh sqrt(square) and its bound; exactly 0 where stable, anything from 0 on where undecided."""
    low, high = (
        2.0 * np.arcsinh(np.sqrt(np.maximum(square + side * bar, 0.0))) for side in (-1.0, 1.0)
    )
    value = 2.0 * np.arcsinh(np.sqrt(np.maximum(square, 0.0)))
    error = np.maximum(high - value, value - low) + 4.0 * EPS * value
    stable = verdict == STABLE
    return {
        "exponent": np.where(stable, 0.0, value),
        "exponent_error": np.where(stable, 0.0, error),
    }


def _growth(slope, square, verdict):
    """The derivative of 2 asinh sqrt(square): 0 where stable, NaN on edges."""
    with np.errstate(all="ignore"):
        return np.where(
            verdict == STABLE,
            0.0,
            np.where(square > 0, slope / np.sqrt(square * (1.0 + square)), np.nan),
        )


def _trace(values, bars, slopes, wanted, names):
    """D itself: unstable where |D| > 2."""
    d, bar = values[0], bars[0]
    out = _functions(values, bars, slopes, wanted, names, ("discriminant",))
    verdict = np.full(d.shape, UNDECIDED, np.int8)
    verdict[abs(d) < 2.0 - bar], verdict[abs(d) > 2.0 + bar] = STABLE, UNSTABLE
    out["verdict"] = verdict
    if "exponent" in wanted:
        square = 0.25 * (abs(d) - 2.0)
        out |= _exponent(square, np.broadcast_to(0.25 * bar + EPS, d.shape), verdict)
        for name, slope in zip(names, slopes if slopes is not None else (), strict=False):
            out[f"exponent_by_{name}"] = _growth(0.25 * np.sign(d) * slope[0], square, verdict)
    return out


def _danby(values, bars, slopes, wanted, names):
    """A, B, C, D, t of `libration_elliptic`: stable where both w are real, different and between -1 and 0."""
    (one, two, three, four, t), bar = values, bars[4]
    ab, ab_bar = _product(one, two, bars[0], bars[1])
    cd, cd_bar = _product(three, four, bars[2], bars[3])
    near, far = 2.0 * abs(t) * bar + 4.0 * ab_bar, 2.0 * abs(t - 2.0) * bar + 4.0 * cd_bar
    root, other = np.where(near <= far, t, t - 2.0), np.where(near <= far, ab, cd)
    k = root * root - 4.0 * other
    k_bar = (
        np.minimum(near, far)
        + bar * bar
        + EPS * (2.0 * root * root + 4.0 * abs(other) + 4.0 * abs(root))
    )
    verdict = np.full(t.shape, UNDECIDED, np.int8)
    verdict[(ab > ab_bar) & (cd > cd_bar) & (k > k_bar) & (t > bar) & (t - 2.0 < -bar)] = STABLE
    verdict[(ab < -ab_bar) | (cd < -cd_bar) | (k < -k_bar) | (t < -bar) | (t - 2.0 > bar)] = (
        UNSTABLE
    )
    out = _functions(values, bars, slopes, wanted, names, INVARIANTS) | {"verdict": verdict}
    if "a" in wanted:
        out["a"], out["a_error"] = 4.0 * t - 4.0, 4.0 * bar + EPS * (4.0 * abs(t) + 4.0)
        for name, slope in zip(names, slopes if slopes is not None else (), strict=False):
            out[f"a_by_{name}"] = 4.0 * slope[4]
    if "b" in wanted:
        by_ab = ab_bar <= cd_bar
        out["b"] = np.where(by_ab, 6.0 - 8.0 * t + 16.0 * ab, 8.0 * t - 10.0 + 16.0 * cd)
        rounding = EPS * (16.0 * abs(np.where(by_ab, ab, cd)) + 16.0 * abs(t) + 20.0)
        out["b_error"] = 16.0 * np.minimum(ab_bar, cd_bar) + 8.0 * bar + rounding
        for name, slope in zip(names, slopes if slopes is not None else (), strict=False):
            first = 16.0 * (slope[0] * two + one * slope[1]) - 8.0 * slope[4]
            second = 16.0 * (slope[2] * four + three * slope[3]) + 8.0 * slope[4]
            out[f"b_by_{name}"] = np.where(by_ab, first, second)
    return out


def _reciprocal(values, bars, slopes, wanted, names):
    """s + c1, or s^2 + c1 s + c2, s = l + 1 / l: stable where all s are real, different and between
    -2 and 2.
    """
    c, bar = values, bars
    if len(values) == 1:
        tests = [(2.0 - abs(c[0]), bar[0] + 0.0 * c[0])]
    else:
        square = c[0] * c[0]
        rounding = EPS * (2.0 * square + 8.0 * abs(c[1]))
        tests = [
            (square - 4.0 * c[1], 2.0 * abs(c[0]) * bar[0] + bar[0] ** 2 + 4.0 * bar[1] + rounding),
            (4.0 - 2.0 * abs(c[0]) + c[1], 2.0 * bar[0] + bar[1] + EPS * (8.0 + 4.0 * abs(c[0]) + 2.0 * abs(c[1]))),
            (4.0 - abs(c[0]), bar[0] + EPS * (4.0 + abs(c[0]))),
        ]  # fmt: skip
    return _functions(
        values, bars, slopes, wanted, names, [f"c{k + 1}" for k in range(len(values))]
    ) | {"verdict": _all(tests)}


def _all(tests):
    """Stable where every test (value, bar) is certainly positive, unstable where one is certainly
    negative.
    """
    verdict = np.full(np.shape(tests[0][0]), STABLE, np.int8)
    for value, bar in tests:
        verdict[~(value > bar)] = UNDECIDED
    for value, bar in tests:
        verdict[value < -bar] = UNSTABLE
    return verdict


def _schur(values, bars, slopes, wanted, names):
    """l^n + c1 l^(n-1) + ... + cn: stable where all l are inside the unit circle, by Schur's recursion."""
    n = len(values)
    p = [np.ones(values[0].shape), *values]
    e = [np.zeros(values[0].shape), *(bar + 0.0 * values[0] for bar in bars)]
    verdict = np.full(values[0].shape, UNDECIDED, np.int8)
    open_points = np.ones(values[0].shape, bool)
    with np.errstate(all="ignore"):
        for degree in range(n, 0, -1):
            lead, last = abs(p[0]), abs(p[degree])
            verdict[open_points & (last - e[degree] > lead + e[0])] = UNSTABLE
            open_points &= last + e[degree] < lead - e[0]
            q = [p[0] * p[i] - p[degree] * p[degree - i] for i in range(degree)]
            f = [
                _product(p[0], p[i], e[0], e[i])[1] + _product(p[degree], p[degree - i], e[degree], e[degree - i])[1]
                + EPS * abs(q[i]) for i in range(degree)
            ]  # fmt: skip
            scale = abs(q[0]) + 1e-300
            p, e = [one / scale for one in q], [one / scale * (1.0 + 4.0 * EPS) + EPS for one in f]
    verdict[open_points] = STABLE
    return _functions(values, bars, slopes, wanted, names, [f"c{k + 1}" for k in range(n)]) | {
        "verdict": verdict
    }


RULES = {
    "hill": _hill,
    "trace": _trace,
    "danby": _danby,
    "reciprocal": _reciprocal,
    "schur": _schur,
}
