"""Importing is light, and the import rules hold."""

import subprocess
import sys
from pathlib import Path


def loaded_by(code):
    report = f"import sys; {code}; print(*sorted(sys.modules))"
    return subprocess.run(
        [sys.executable, "-c", report], capture_output=True, text=True, check=True
    ).stdout.split()


def test_importing_survey_loads_nothing_heavy():
    assert not {"numba", "numpy", "xarray", "dask", "matplotlib", "netCDF4"} & set(
        loaded_by("import survey")
    )


def test_nothing_that_a_first_point_alone_needs_is_loaded_before():
    assert not {"dask.array", "scipy.special", "matplotlib"} & set(
        loaded_by("import survey; survey.evaluate")
    )


def test_calls_load_what_they_need_alone():
    call = "survey.evaluate('satellite', k=0.5, rho=[1.0, 2.0])"
    code = f"import survey; {'; '.join([call] * 3)}"  # from the second on a dataset is copied
    assert not {"dask.array", "pydantic", "matplotlib"} & set(loaded_by(code))


def test_telling_what_a_file_contains_loads_no_compiler():
    path = Path(__file__).parent / "golden/mathieu.nc"
    code = (
        f"from survey import cli; cli.program.main(['info', {str(path)!r}], standalone_mode=False)"
    )
    assert "xarray" in (found := loaded_by(code)) and not {
        "numba",
        "dask.array",
        "matplotlib",
    } & set(found)


def test_a_run_loads_no_xarray_where_it_finds_no_curves():
    code = "from survey.sweep import edges_and_cells, engine, plan"
    assert not {"xarray", "pandas", "matplotlib"} & set(loaded_by(code))


def test_importing_a_scene_compiles_nothing():
    code = (
        "import gc, survey.scenes.satellite, survey.scenes.gyrostat; from numba.core.dispatcher import Dispatcher; "
        "all_ = [d for d in gc.get_objects() if isinstance(d, Dispatcher)]; "
        "ours = [d for d in all_ if d.py_func.__module__.startswith('survey')]; "
        "assert len(ours) > 20 and not any(d.signatures for d in ours)"
    )
    assert "numba" in loaded_by(code)


def test_the_import_rules_hold():
    linter = Path(sys.executable).with_name("lint-imports")
    checked = subprocess.run(
        [linter], cwd=Path(__file__).parent.parent, capture_output=True, text=True
    )
    assert checked.returncode == 0, checked.stdout
