"""`ds.survey`: questions to a finished survey, in a notebook. Importing survey registers it, before
or after xarray.
"""

import contextlib
import warnings

import xarray as xr

from survey.errors import BadInput
from survey.file import schema
from survey.wording import plain, shown


@xr.register_dataset_accessor("survey")
class Survey:
    """A survey's dataset: its map, one point, the motion at that point. Answers are xarray or
    matplotlib objects.

    Works on the datasets of `survey.run`, `survey.open`, `survey.evaluate` and
    `xarray.open_dataset`, including lazy ones (`chunks={}`), of which only what is needed is
    loaded. Coordinates are numbers; the nearest point is used. Raises, in one line,
    survey.BadInput, or survey.Damaged where the dataset is not one that survey writes.
    """

    def __init__(self, ds):
        if "status" not in ds or "scene" not in ds.attrs:
            raise BadInput(
                "this dataset was not written by survey: it has no status, or no attribute scene "
                "(arithmetic drops attributes: xr.set_options(keep_attrs=True) keeps them)"
            )
        schema.refuse_stacked(ds, "this")
        schema.check(ds, complete=False)
        self._ds = ds

    def __repr__(self):
        names = [name for name in vars(type(self)) if not name.startswith("_")]
        scene = plain(self._ds.attrs["scene"])
        return (
            f"a survey of {scene}: ds.survey has {', '.join(names)}; help(ds.survey) documents them"
        )

    def _repr_html_(self):
        from survey.show import notebook

        return notebook.of_survey(self._ds)

    def map(
        self, var=None, ax=None, boundaries=True, style=None, width="single", *,
        x=None, y=None, cmap=None, vmin=None, vmax=None, robust=None,
    ):  # fmt: skip
        """Draw the stability map, or the variable `var`; along one axis, its curve and error band.

        `var`: a name, or booleans at the points, such as `a.survey.where("stable") &
        b.survey.where("stable")`. `x` and `y`: which axes are drawn, by default those in whose
        planes [boundaries] found curves (where they lie in other planes than the one that is drawn,
        a warning says so), or the first two with several values; other axes at their first value, the
        angle of Abel's equation at its last, unless a `slice` fixes them. `cmap`, `vmin`, `vmax`:
        colours of a variable of numbers; by default they span its values except 1 % at either end,
        where the colour bar has arrows (`robust=False`: all of them), and diverge about 0 where values
        have both signs; for a curve `vmin` and `vmax` are the ends of its axis.

        Solutions of Abel's equation at several angles are curves, one for each value of the first
        parameter, up to their turning points; at one angle
        (`ds.survey.slice(phi=1.0).survey.map("w")`) they are a map.

        `map("surfaces")` draws the surfaces of [boundaries] in three parameters, onto axes with
        projection="3d".

        Undecided, failed and outside points are marked and counted in the legend; points where the
        outputs are undefined are grey, listed by their status; edges of tongues are drawn where the
        file contains them, unless `boundaries` is False. Draws onto the matplotlib Axes `ax`, by
        default a new figure's, and returns it (`ax.figure.savefig("map.pdf")`). `style="paper"`:
        for print, hatched, without title, a single or double column wide; `survey plot --style
        paper` also embeds the fonts as journals require.
        """
        from survey.analysis import verdicts
        from survey.show import figures
        from survey.show.style import figure_size

        ds = self._ds
        if ax is not None and not hasattr(ax, "pcolormesh"):
            raise BadInput(
                f"ax = {shown(ax)}: give the Axes of a matplotlib figure, or None for a new one"
            )
        if not (var is None or isinstance(var, str)):
            ds = verdicts.combined(ds, var)
            var = "combined"
        colours = {"cmap": cmap, "vmin": vmin, "vmax": vmax, "robust": robust}
        with _settings(style):
            own = ax is None
            ax = _new_axes(figure_size(style, width), figures.projection_of(var)) if own else ax
            try:
                left_out = figures.onto(ax, ds, var, boundaries, style, (x, y), colours)
            except BaseException:
                if own:  # a notebook would show it, empty
                    _close(ax.figure)
                raise
        if left_out:
            warnings.warn(left_out, stacklevel=2)
        return ax

    def counts(self):
        """{"verdict" (if there is one), "status": {kind: number of points}}; a point without an
        answer counts, among the verdicts, by its status. A warning says where values of an axis
        repeat, as after `xr.concat`: their points count each time."""
        from survey.file import labels

        if again := labels.repeated(self._ds):
            warnings.warn(f"counts: {again}", stacklevel=2)
        return labels.counts(self._ds)

    def where(self, name):
        """True where the verdict, or the status, is `name` (a boolean DataArray):
        `ds.survey.where("stable")`.

        Masks of several surveys combine with `&`, `|` and `~`, and `map` draws the result. An
        undecided point is only in the mask of "undecided", so `~where("stable")` contains it.
        """
        from survey.analysis import verdicts

        return verdicts.where(self._ds, name)

    def names(self):
        """The verdict of every point as a word, its status where it has no answer: for `groupby`
        and legends.
        """
        from survey.analysis import verdicts

        return verdicts.names(self._ds)

    def point(self, **coords):
        """Everything known about the nearest point: a `survey.analysis.point.Point`; its `dataset`
        is the point's.
        """
        from survey.analysis import point

        return point.Point(point.nearest(self._ds, coords).load())

    def margin(self, **coords):
        """How far the nearest point is from the boundaries of stability: a Dataset along the
        dimension `parameter`.

        For each parameter along which the scene has boundaries, all others fixed: `value`, `edge` (the nearest
        boundary), `edge_error` (a bound), `distance` (edge less value) and `edge_class`. NaN where none was found
        within two hundred times 1 + |value|. They are exact, like those of `survey.edge`, and need
        no file of a map.
        """
        from survey.analysis import edge, point

        return edge.margin(point.nearest(self._ds, coords).load())

    def trajectory(self, time=None, figure=None, **coords):
        """Solve the nearest point in time and draw its motion, as its scene defines. Returns the
        motion, a Dataset.

        `time`: duration in the scene's independent variable; by default the scene chooses it. Draws
        into the matplotlib Figure or SubFigure `figure`, by default a new one; does not draw if it
        is False.
        """
        from survey.analysis import point, trajectory

        if not (figure is None or figure is False or hasattr(figure, "add_subplot")):
            raise BadInput(
                f"figure = {shown(figure)}: give a matplotlib Figure, None for a new one, or False for none"
            )
        found = trajectory.solve(point.nearest(self._ds, coords).load(), time)
        if figure is not False:
            from survey.show import portrait

            with _settings(None):
                portrait.draw(found, _new_figure() if figure is None else figure)
        return found

    def slice(self, **coords):
        """The survey at the values of some axes nearest to `coords`, such as a row of a map, which
        `survey.map()` draws as a curve with its error band. Returns a Dataset, lazy if this one is;
        a plane keeps the curves of [boundaries] that lie in it.
        """
        from survey.analysis import point

        return point.section(self._ds, coords)

    def boundary(self, kind=None, index=None):
        """Where the verdict changes: positions along the dimension `place`, as a Dataset.

        If the file contains boundaries ([boundaries] in the workflow): a coordinate per axis,
        `position_error`, `kind` (of boundary), `index` (of the tongue) and, if joined, `curve`;
        only those of one `kind` or `index` if given. Else the centres of the cells that [refine]
        left undecided, or midpoints between neighbouring points of different verdict, with X_error
        = half the cell's width or half their distance.
        """
        from survey.analysis import boundary

        return boundary.find(self._ds, kind, index)

    def zoom(self, num=None, output=None, **ranges):
        """A finer sweep of a part of the map, such as `zoom(k=(0.2, 0.3), num=200)`, with otherwise
        the same workflow.

        `num`: number of values along each axis with a range (by default as many as now; a dict
        gives one for each). Ranges may extend beyond the map, within the parameters' domains, with
        a warning. Returns the Dataset, in memory; with `output` it is written to that netCDF file
        by `survey.run`.
        """
        from survey.analysis import zoom

        return zoom.sweep(self._ds, ranges, num, output)

    def compare(self, other):
        """This survey minus `other` (a Dataset), at exactly common points.

        For each output X in both: `X_difference`, and `X_excess`, its size over the sum of both
        error bars (above 1 they contradict each other); `verdict_differs`. The attribute `summary`
        is the result in a line, `unlike` lists how the requests differ.
        """
        from survey.analysis import compare

        return compare.find(self._ds, other)

    def areas(self):
        """Area and fraction of the map of each verdict with error bars, as a Dataset along
        `area_verdict`.

        From the cells of [refine]; else from the points, where the error bar covers all area
        between neighbours that differ. Undecided is a verdict of its own. The attribute `areas` is
        the result in a line.
        """
        from survey.analysis import areas

        return areas.of_map(self._ds)


@contextlib.contextmanager
def _settings(style):
    """matplotlib's settings of a style, while something is drawn."""
    import matplotlib
    import matplotlib.pyplot as plt

    from survey.show.style import style_named

    # a notebook's backend, loaded within rc_context, would not show later figures
    plt.draw_if_interactive()
    with matplotlib.rc_context(style_named(style).rc):
        yield


def _new_axes(size, projection=None):
    import matplotlib.pyplot as plt

    return plt.figure(figsize=size, layout="constrained").subplots(
        subplot_kw={"projection": projection}
    )


def _close(figure):
    import matplotlib.pyplot as plt

    plt.close(figure)


def _new_figure():
    import matplotlib.pyplot as plt

    return plt.figure(figsize=(9.2, 4.6), layout="constrained")
