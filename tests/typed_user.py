"""What a type checker says of a user's program; read by mypy, never run. An ignore that is not
needed is an error.
"""

from typing import assert_type

import numpy as np
import xarray as xr

import survey


def calls(u: float) -> None:
    ds = survey.evaluate(
        "satellite", k=np.linspace(0.0, 0.9, 3), rho=1.0, body="prolate", rtol=1e-8
    )
    assert_type(ds, xr.Dataset)
    survey.evaluate(
        "mathieu", a=[1.0, 2.0], q=xr.DataArray([0.1, 0.2], dims="a"), variables="verdict"
    )
    survey.evaluate(survey.hill(lambda u, p: u + p[0], period=1.0, parameters=("a",)), a=1.0)
    survey.evaluate(
        survey.abel(lambda phi, p: p[0], lambda phi, p: -phi, parameters=("a",)), a=1.0, t=1.0
    )
    cycles = survey.orbit(
        lambda t, x, p, out: -x, states="x", period=1.0, parameters=("a",), start=(0.0,)
    )
    survey.evaluate(cycles, a=1.0)
    assert_type(survey.run("sweep.toml", workers=4), xr.Dataset)
    assert_type(survey.run({"scene": "mathieu", "axes": {"a": 1.0, "q": 0.1}}), xr.Dataset)
    assert_type(survey.open("map.nc"), xr.Dataset)
    assert_type(survey.scenes(), dict[str, str])
    assert_type(survey.BadInput.exit_code, int)


def mistakes() -> None:
    survey.evaluate("mathieu", rtol="small")  # type: ignore[arg-type]
    survey.evaluate(7, a=1.0)  # type: ignore[arg-type]
    survey.run("sweep.toml", worker=4)  # type: ignore[call-arg]
    survey.hill(1.0, period=1.0, parameters=("a",))  # type: ignore[arg-type]
    survey.explore("map.nc")  # type: ignore[attr-defined]
