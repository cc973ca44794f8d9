"""`ds.survey`: what a finished survey is asked in a notebook. Importing survey registers it, before or after xarray."""

import xarray as xr

from survey.errors import BadInput


@xr.register_dataset_accessor("survey")
class Survey:
    """A survey's dataset: its map, one point, the motion at that point. Answers are xarray or matplotlib objects.

    Works on the datasets of `survey.run`, `survey.open`, `survey.evaluate` and of `xarray.open_dataset`, lazy ones
    (`chunks={}`) too, of which only what is asked for is loaded. Coordinates are numbers, the nearest point is taken.
    Raises survey.BadInput in one line.
    """

    def __init__(self, ds):
        if "status" not in ds or "scene" not in ds.attrs:
            raise BadInput(
                "this dataset was not written by survey: it has no status, or no attribute scene "
                "(arithmetic drops attributes: xr.set_options(keep_attrs=True) keeps them)"
            )
        self._ds = ds

    def map(self, var=None, ax=None, boundaries=True):
        """Draw the stability map, or the variable `var`; along one axis, its curve and error band.

        Undecided, failed and outside points are marked and counted in the legend; edges of tongues are drawn where
        the file holds them, unless `boundaries` is False. Draws onto the matplotlib Axes `ax`, by default a new
        figure's, and returns it (`ax.figure.savefig("map.pdf")`).
        """
        from survey import figures

        ax = _new_axes(figures.SIZE) if ax is None else ax
        figures.onto(ax, self._ds, var, boundaries)
        return ax

    def point(self, **coords):
        """Everything known of the nearest point: a `survey.analysis.point.Point`, whose `dataset` is the point's."""
        from survey.analysis import point

        return point.Point(point.nearest(self._ds, coords).load())

    def trajectory(self, time=None, figure=None, **coords):
        """Solve the nearest point in time and draw its motion, as its scene defines. Returns the motion, a Dataset.

        `time` is how long, in the scene's independent variable; the scene knows what suits. Draws into the matplotlib
        Figure or SubFigure `figure`, by default a new one; not at all if it is False.
        """
        from survey.analysis import point, portrait, trajectory

        found = trajectory.solve(point.nearest(self._ds, coords).load(), time)
        if figure is not False:
            portrait.draw(found, _new_figure() if figure is None else figure)
        return found


def _new_axes(size):
    import matplotlib.pyplot as plt

    return plt.figure(figsize=size, layout="constrained").subplots()


def _new_figure():
    import matplotlib.pyplot as plt

    return plt.figure(figsize=(9.2, 4.6), layout="constrained")
