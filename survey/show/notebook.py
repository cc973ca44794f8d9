"""What Jupyter shows of a survey: its title, axes and counts as an HTML table."""

import html

from survey.file.labels import counts
from survey.wording import plain

# Classes that Jupyter and Sphinx leave alone: dollars in untrusted text are not TeX.
NO_FORMULAS = "tex2jax_ignore mathjax_ignore"
MOST_COUNTED = 10**7  # points: those of a larger survey are not read only to be shown


def of_survey(ds):
    """A table of what a survey holds."""
    rows = [("scene", ds.attrs["scene"]), ("options", ds.attrs.get("options", ""))]
    for dim in ds.status.dims:
        values = f"{ds[dim].values[0]} to {ds[dim].values[-1]}, " if dim in ds.coords else ""
        rows.append((str(dim), f"{values}{ds.sizes[dim]:,} values"))
    rows += [
        (str(name), f"{float(c):.6g}")
        for name, c in ds.coords.items()
        if c.ndim == 0 and c.dtype.kind in "fi"
    ]
    if ds.status.size <= MOST_COUNTED:
        rows += [(what, ", ".join(f"{name}: {n:,}" for name, n in number.items() if n))
                 for what, number in counts(ds).items()]  # fmt: skip
    return table(ds.attrs.get("title", ds.attrs["scene"]), [row for row in rows if row[1]])


def table(title, rows):
    """An HTML table of rows of text, which may be untrusted."""
    body = "".join("<tr>" + "".join(_cell(text) for text in row) + "</tr>" for row in rows)
    return f"<div class='{NO_FORMULAS}'><table><caption>{html.escape(plain(title))}</caption>{body}</table></div>"


def _cell(text):
    return f"<td style='text-align:left;vertical-align:top'>{html.escape(plain(str(text)))}</td>"
