"""What Jupyter shows of a survey: its title, axes and counts as an HTML table."""

from survey.file.labels import counts
from survey.wording import html_table

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
    return html_table(ds.attrs.get("title", ds.attrs["scene"]), [row for row in rows if row[1]])
