"""The page in the browser: the map, the point under the pointer, and the chosen point with its motion."""

import html
import time

import numpy as np
from bokeh import events
from bokeh.core.property.descriptors import UnsetValueError
from bokeh.layouts import column, row
from bokeh.models import (
    BasicTicker,
    Button,
    Checkbox,
    ColorBar,
    CustomJS,
    Div,
    InlineStyleSheet,
    Label,
    LinearColorMapper,
    Range1d,
    Select,
    Slider,
)
from bokeh.palettes import Viridis256
from bokeh.plotting import figure
from matplotlib.figure import Figure

from survey.errors import BadInput, SurveyError, Untrusted
from survey.file.labels import fill_of
from survey.request import trust
from survey.show import boundaries
from survey.viewer import finer, raster, widgets
from survey.viewer.shown import ShownMap

SIDE, WIDTH = 510, 470  # width in pixels of the column beside the map, and of its parts
# beside the map, or below it where the browser's window is narrow
STACK = "@media (max-width: 950px) {:host {flex-direction: column !important; overflow-y: auto}}"
STACKED = "@media (max-width: 950px) {:host {flex: none !important; height: 70vh !important; width: 100% !important}}"
QUIET = 300  # ms after the last move before a window is solved afresh
COPY = "Copy Python for this point"
SOON = 30  # ms: changes that follow each other faster are handled together
MOMENT = 0.4  # seconds of reading a large map between two pictures of it
# factor by which more must have been read for a new picture, as drawing takes time too
GROWTH = 1.5
RINGS = 100  # pixels with undecided or failed points: if there are fewer, each is ringed
RED = "#D40000"
CURVE_POINTS = 300_000  # curves with more points are thinned
UNTRUSTED = "no motion: the scene of this survey is a Python file that you have not run here before. Read it first."
CLICK = "Click a point of the map to see its motion and everything known about it."
# the model's name carries the link into the address bar
KEEP_LINK = "window.history.replaceState(null, '', '?' + cb_obj.name)"


class Page:
    """One page in a browser, on the survey `shown` (a `ShownMap`)."""

    def __init__(self, shown, document):
        self.map = shown
        self.document = document
        self.waiting = set()
        self.pointer = None
        self.share = 0.0  # of the map that had been read when it was last drawn
        # the ShownMap of the window solved afresh, of which view, and when
        self.finer = self.finer_of = self.timer = None
        self.not_finer = ""  # why it is not
        self.caption = _text(styles={"color": "#555555"})
        self.view = self._from_link(document.session_context.request.arguments)
        self._plot()
        self._side()
        sheet = InlineStyleSheet(css=STACK)
        document.add_root(
            row(self.plot, self.side, sizing_mode="stretch_both", stylesheets=[sheet])
        )
        document.title = shown.title
        self._fill()
        self.changed()
        if self.view.point is not None:
            self.choose(self.view.point)

    def _from_link(self, arguments):
        query = [
            f"{key}={values[0].decode()}"
            for key, values in arguments.items()
            if not key.startswith("bokeh-")
        ]
        try:
            self.complaint = ""
            return self.map.read("&".join(query))
        except BadInput as error:
            self.complaint = f"the link cannot be opened: {error}; "
            return self.map.read("")

    def _plot(self):
        axes = self.map.axes
        ranges = [
            Range1d(*ends, bounds=axis.ends, reset_start=axis.ends[0], reset_end=axis.ends[1])
            for ends, axis in zip(self.view.window, axes, strict=True)
        ]
        scales = ["log" if axis.log else "linear" for axis in axes]
        plot = self.plot = figure(
            x_range=ranges[0], y_range=ranges[1], x_axis_type=scales[0], y_axis_type=scales[1],
            tools="pan,wheel_zoom,box_zoom,reset,save", active_scroll="wheel_zoom",
            background_fill_color=raster.BACKGROUND, sizing_mode="stretch_both", min_width=300, min_height=300,
            stylesheets=[":host(:focus) {outline: none}", STACKED],
        )  # fmt: skip
        plot.xaxis.axis_label, plot.yaxis.axis_label = (
            widgets.label(self.map.ds[dim]) for dim in self.map.dims
        )
        plot.grid.visible, plot.toolbar.logo = False, None
        empty = {"x": [], "y": []}
        self.image = plot.image_rgba(
            source=empty | {"image": [], "dw": [], "dh": []}, **widgets.IMAGE
        ).data_source
        self.over = plot.image_rgba(
            source=empty | {"image": [], "dw": [], "dh": []}, **widgets.IMAGE
        ).data_source
        found = boundaries.curves_of(self.map.ds) if "curve_count" in self.map.ds else ()
        self.curves = {name: widgets.curve(plot, name) for name in found}
        style = {"size": 9, "line_color": RED, "line_width": 2, "fill_color": "colour"}
        self.rings = plot.scatter("x", "y", source=empty | {"colour": []}, **style).data_source
        style = {"size": 20, "marker": "circle_x", "line_color": "white", **widgets.HOLLOW}
        self.chosen = plot.scatter("x", "y", source=dict(empty), **style).data_source
        plot.scatter(
            "x", "y", source=self.chosen, **style | {"line_color": "black", "line_width": 1}
        )
        self.near = Label(**widgets.LABEL)
        self.bar = ColorBar(color_mapper=LinearColorMapper(Viridis256), visible=False)
        plot.add_layout(self.near)
        plot.add_layout(self.bar, "right")
        self._listen()

    def _listen(self):
        plot = self.plot
        for ends in (plot.x_range, plot.y_range):
            _on(ends, ("start", "end"), lambda: self.soon(self.changed))
        _on(plot, ("inner_width", "inner_height"), lambda: self.soon(self.draw))
        plot.on_event(events.MouseMove, self._moved)
        plot.on_event(events.MouseLeave, self._left)
        plot.on_event(events.Tap, self._tapped)
        plot.js_on_change("name", CustomJS(code=KEEP_LINK))

    def _fill(self):
        """Show the boundaries in the plane that is drawn."""
        if not self.curves:
            return
        others = {
            dim: at
            for dim, at in self.view.others.items()
            if dim in self.map.ds[self.view.name].dims
        }
        ds = boundaries.in_plane(self.map.ds, self.map.ds[self.view.name].isel(others))
        x, y = (ds[f"curve_{dim}"].values for dim in self.map.dims)
        thin = max(1, x.size // CURVE_POINTS)
        found = boundaries.curves_of(ds)
        for name, curve in self.curves.items():
            parts = [slice(part.start, part.stop, thin) for part in found.get(name, [])]
            points = [x[part] for part in parts], [y[part] for part in parts]
            if "marker" in boundaries.CURVES[name][1]:
                points = [np.concatenate([*values, []]) for values in points]
            curve.data_source.data = dict(zip("xy", points, strict=True))

    def _side(self):
        ds, view = self.map.ds, self.view
        self.variable = Select(
            title="variable", value=view.name, options=self.map.names, width=WIDTH
        )
        _on(self.variable, ("value",), self.changed)
        label = "; ".join(
            dict.fromkeys(boundaries.CURVES[name][0] for name in self.curves)
        ).replace("\n", " ")
        self.edges = Checkbox(label=label, active=view.boundaries, visible=bool(self.curves))
        _on(self.edges, ("active",), self.changed)
        self.sliders = {
            dim: Slider(
                title=widgets.literal(dim),
                start=0,
                end=ds.sizes[dim] - 1,
                value=at,
                width=WIDTH,
                format=widgets.labels(ds[dim].values),
            )
            for dim, at in view.others.items()
            if ds.sizes[dim] > 1
        }
        for slider in self.sliders.values():
            _on(slider, ("value",), self.changed)
            _on(slider, ("value",), self._fill)
            _on(slider, ("value_throttled",), lambda: self.choose(self.view.point))
        title = f"<b>{html.escape(self.map.title)}</b><br>{html.escape(self.map.options)}"
        self.legend, self.motion, self.known, self.source = (_text() for _ in range(4))
        self.motion.text, self.untrusted = CLICK, None
        self.read = Button(label="Show the file", visible=False)
        self.run = Button(
            label="I have read it: allow it to run until survey view ends",
            button_type="warning",
            visible=False,
        )
        self.read.on_event(events.ButtonClick, lambda _: self.show_source())
        self.run.on_event(events.ButtonClick, lambda _: self.trust())
        self.copy = Button(label=COPY, visible=False)
        self.copy.js_on_event(
            events.ButtonClick, CustomJS(args={"copy": self.copy}, code=widgets.COPYING)
        )
        self.python = _text()
        texts = [self.legend, self.caption, self.motion, self.read, self.source, self.run]
        texts += [self.copy, self.python, self.known]
        parts = [_text(text=title), self.variable, *self.sliders.values(), self.edges, *texts]
        style = {"overflow-x": "hidden", "overflow-y": "auto", "padding-left": "10px"}
        self.side = column(*parts, width=SIDE, sizing_mode="stretch_height", styles=style)

    def soon(self, function):
        """Call the method once, shortly, however often this is requested until then."""
        if function.__name__ in self.waiting:
            return
        self.waiting.add(function.__name__)

        def call():
            self.waiting.discard(function.__name__)
            function()

        self.document.add_timeout_callback(call, SOON)

    def changed(self):
        """Apply what the user has chosen, and draw it."""
        view, plot, ds = self.view, self.plot, self.map.ds
        view.name, view.boundaries = self.variable.value, self.edges.active
        view.window = [(ends.start, ends.end) for ends in (plot.x_range, plot.y_range)]
        for dim, slider in self.sliders.items():
            view.others[dim] = int(slider.value)
            slider.visible = dim in (*ds.status.dims, *ds[view.name].dims)
        for curve in self.curves.values():
            curve.visible = view.boundaries
        if self.finer_of != self._key():
            self.finer, self.finer_of, self.not_finer = None, None, ""
        self.soon(self.draw)
        self.soon(self.describe)

    def _key(self):
        """What a window that is solved afresh depends on."""
        view = self.view
        return view.name, tuple(view.window), tuple(view.others.items())

    def later(self):
        """Solve the window afresh once it has not been moved for a moment."""
        if self.timer is not None:
            self.document.remove_timeout_callback(self.timer)
        self.timer = self.document.add_timeout_callback(self.solve_window, QUIET)

    def solve_window(self):
        """Solve the visible window afresh, and draw it over the map."""
        self.timer = None
        try:
            found = finer.of_window(self.map, self.view)
            self.finer = ShownMap("the window", found)
        except Untrusted:
            self.not_finer = "not solved afresh: its scene has not been allowed to run"
        except SurveyError as error:
            self.not_finer = f"not solved afresh: {error}"
        self.finer_of = self._key()
        self.soon(self.draw)
        self.soon(self.describe)

    def draw(self):
        """Draw the visible window of the map and its legend, explain the pixels, update the link, and
        go on reading if necessary.
        """
        layer = self.map.layer(self.view)
        try:
            sizes = self.plot.inner_width, self.plot.inner_height
        except UnsetValueError:  # the browser has not sent it yet
            return
        xs, ys = (
            axis.pixels(*window, size)
            for axis, window, size in zip(self.map.axes, self.view.window, sizes, strict=True)
        )
        if xs is None or ys is None:
            return
        mask, value = layer.pixels(xs, ys)
        image, kinds = raster.paint(mask, value, layer)
        (left, right), (low, high) = xs.ends, ys.ends
        self.image.data = {
            "x": [left],
            "y": [low],
            "dw": [right - left],
            "dh": [high - low],
            "image": [image],
        }
        kinds = self._over(layer, sizes) or self._ring(mask, layer, kinds, xs, ys) or kinds
        self._legend(layer, kinds, value is not None and (np.isnan(value) & (mask == 0)).any())
        caption = self.complaint
        if max(xs.points, ys.points) > 1:
            shows = "its rarest kind" if layer.flagged else "the value largest in magnitude"
            caption += (
                f"a pixel represents up to {xs.points} × {ys.points} points and shows {shows}"
            )
        if self.finer:
            number = " × ".join(str(axis.values.size) for axis in self.finer.axes)
            caption = f"{self.complaint}this window is solved afresh, {number} points; the link shows the same"
        elif self.not_finer:
            caption += f"{'; ' * bool(caption)}{self.not_finer}"
        elif finer.wanted(self.map, self.view):
            caption = (
                f"{self.complaint}narrower than the map's grid: solving this window afresh ..."
            )
            self.later()
        if layer.waits(xs, ys):
            self.share = layer.overview.share
            caption = f"an overview, {self.share:.0%} of {layer.variable.size:,} points read; {caption} ..."
            self.soon(self.refine)
        self.caption.update(text=html.escape(caption), visible=bool(caption))
        self.plot.name = self.map.link(self.view)

    def refine(self):
        """Read some more of the map, and draw it again."""
        overview, end = self.map.layer(self.view).overview, time.monotonic() + MOMENT
        while overview.read() and time.monotonic() < end:
            pass
        self.soon(self.draw if overview.share >= min(1.0, GROWTH * self.share) else self.refine)

    def _over(self, base, sizes):
        """Draw the window that is solved afresh in the colours of the map's layer; {kind: pixels},
        or None without.
        """
        self.over.data = {"x": [], "y": [], "dw": [], "dh": [], "image": []}
        if not self.finer:
            return None
        axes = self.finer.axes
        xs, ys = (
            axis.pixels(*w, size)
            for axis, w, size in zip(axes, self.view.window, sizes, strict=True)
        )
        layer = self.finer.layer(self.finer.like(self.view))
        mask, value = layer.pixels(xs, ys)
        image, kinds = raster.paint(mask, value, layer, None if layer.flagged else base.limits)
        (left, right), (low, high) = xs.ends, ys.ends
        self.over.data = {
            "x": [left],
            "y": [low],
            "dw": [right - left],
            "dh": [high - low],
            "image": [image],
        }
        self._ring(mask, layer, kinds, xs, ys)
        return kinds

    def _ring(self, mask, layer, kinds, xs, ys):
        """Ring the pixels with undecided or failed points, where these are few."""
        few = [kind for kind in ("undecided", "failed") if 0 < kinds.get(kind, 0) <= RINGS]
        marked = [(*np.nonzero(mask & layer.bits[kind]), layer.colours[kind]) for kind in few]
        self.rings.data = {
            "x": [x for _, j, _ in marked for x in xs.middles[j]],
            "y": [y for i, _, _ in marked for y in ys.middles[i]],
            "colour": [colour for i, _, colour in marked for _ in i],
        }

    def _legend(self, layer, kinds, empty):
        """Show the visible kinds with their share of the map, or the colour bar. `empty`: have some
        pixels no value?
        """
        ds, name = self.map.ds, self.view.name
        shares = self.map.shares(name)
        entries = [
            (kind, colour, shares.get(kind, ""))
            for kind, colour in layer.colours.items()
            if kind in kinds
        ]
        entries += [("does not apply", raster.NOT_APPLY, "")] if empty else []
        self.legend.update(text=widgets.legend(entries), visible=bool(entries))
        self.bar.visible = not layer.flagged
        if not layer.flagged:
            self.bar.color_mapper.update(low=layer.limits[0], high=layer.limits[1])
            self.bar.title = widgets.label(ds[name], tex=False)
            whole = fill_of(ds[name]) is not None
            self.bar.ticker = BasicTicker(min_interval=1 if whole else 0)

    def _moved(self, event):
        if event.x is not None:
            self.pointer = event.x, event.y
            self.soon(self.describe)

    def _left(self, _):
        self.pointer, self.near.visible = None, False

    def describe(self):
        """Show what is known about the point under the pointer, on the side where there is space."""
        shown, point = self._nearest(*self.pointer) if self.pointer else (None, None)
        if point is None:
            self.near.visible = False
            return
        (x, y), text = self.pointer, "\n".join(map(widgets.literal, shown.under(self.view, point)))
        left, low = (
            np.mean(axis.scaled(np.array(window))) < axis.scaled(at)
            for axis, window, at in zip(self.map.axes, self.view.window, (x, y), strict=True)
        )
        self.near.update(
            x=x, y=y, text=text, visible=True, anchor=f"{'top' if low else 'bottom'}_{'right' if left else 'left'}",
            x_offset=-12 if left else 12, y_offset=-12 if low else 12,
        )  # fmt: skip

    def _nearest(self, x, y):
        """(the ShownMap, and indices of the point of it in whose cell the position lies), the window's
        before the map's.
        """
        for shown in (self.finer, self.map):
            point = (
                [axis.nearest(at) for axis, at in zip(shown.axes, (x, y), strict=True)]
                if shown
                else [None]
            )
            if None not in point:
                return shown, tuple(point)
        return None, None

    def _tapped(self, event):
        shown, point = self._nearest(event.x, event.y)
        self.choose(shown.position(point) if shown else None)

    def choose(self, position):
        """Choose a point by its position (None: ignored) and solve it in time."""
        if position is None:
            return
        self.view.point = x, y = position
        self.chosen.data = {"x": [x], "y": [y]}
        self.plot.name = self.map.link(self.view)
        self.motion.text, self.known.text = "solving this point in time ...", ""
        self.copy.visible, self.python.text = False, ""
        self._ask(None)
        self.soon(self.solve)

    def solve(self):
        """Show the motion at the chosen point, and everything known about it."""
        coords, survey = self.map.coords(self.view), self.map.ds.survey
        try:
            if coords is None:
                survey = finer.of_point(self.map, self.view).survey
                coords = {}  # which stays None where that is refused
            drawn = Figure(figsize=(6.8, 3.6), layout="constrained")
            survey.trajectory(figure=drawn, **coords)
            self.motion.text = widgets.picture(drawn)
        except Untrusted as untrusted:
            self._ask(untrusted)
            self.motion.text = UNTRUSTED
        except SurveyError as error:
            self.motion.text = f"no motion: {html.escape(str(error))}"
        if coords is None:  # what the file holds nearest to it
            x, y = self.view.point
            self.view.point = self.map.position(
                tuple(a.nearest(v) for a, v in zip(self.map.axes, (x, y), strict=True))
            )
            coords = self.map.coords(self.view)
        point = survey.point(**coords)
        self.known.text = point._repr_html_()
        self.copy.update(label=COPY, tags=[point.python], visible=True)
        self.python.text = widgets.code(point.python)

    def _ask(self, untrusted):
        """Offer to read the file of an untrusted scene (an Untrusted), or nothing (None)."""
        self.untrusted, self.source.text = untrusted, ""
        self.read.visible, self.run.visible = untrusted is not None, False

    def show_source(self):
        """Show the file of an untrusted scene, and offer to run it."""
        if self.untrusted:
            self.source.text = widgets.text_of(
                self.untrusted.path, self.untrusted.digest, self.untrusted.text
            )
            self.read.visible, self.run.visible = False, True

    def trust(self):
        """Allow exactly the text that is shown to run, and solve the point."""
        if self.untrusted and self.run.visible:
            trust.allow(self.untrusted.digest)
            self.choose(self.view.point)


def _text(**properties):
    """A piece of HTML beside the map, in which dollars are not TeX."""
    return Div(width=WIDTH, disable_math=True, **properties)


def _on(model, properties, call):
    """Call the function whenever one of the model's properties changes."""
    for name in properties:
        model.on_change(name, lambda attr, old, new: call())
