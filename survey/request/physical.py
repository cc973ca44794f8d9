"""Physical input: degrees, moments of inertia, masses or named bodies in place of a scene's own
parameters.

GM: R. S. Park et al., Astronomical Journal 161 (2021) 105 (DE440), table 2; of Mars and beyond with
their moons, of the Earth without. Eccentricities: E. M. Standish, Keplerian elements for
approximate positions of the major planets, JPL (J2000), for the Sun and the Earth that of the
barycentre with the Moon; of the Moon's orbit, the mean.
"""

import numpy as np

from survey import modules
from survey.errors import BadInput
from survey.wording import listed, shown

GM = {  # km^3 / s^2
    "Sun": 132712440041.279419, "Mercury": 22031.868551, "Venus": 324858.592, "Earth": 398600.435507,
    "Moon": 4902.800118, "Mars": 42828.375816, "Jupiter": 126712764.1, "Saturn": 37940584.8418, "Uranus": 5794556.4,
    "Neptune": 6836527.10058,
}  # fmt: skip
ECCENTRICITY = {
    "Sun-Mercury": 0.20563593, "Sun-Venus": 0.00677672, "Sun-Earth": 0.01671123, "Sun-Mars": 0.0933941,
    "Sun-Jupiter": 0.04838624, "Sun-Saturn": 0.05386179, "Sun-Uranus": 0.04725744, "Sun-Neptune": 0.00859048,
    "Earth-Moon": 0.0549,
}  # fmt: skip
DEGREES = "_deg"  # after the name of an angle
MASSES, MOMENTS = ("m1", "m2"), ("A", "B", "C")


def resolved(scene, given):
    """The parameters {name: value} with physical input in the scene's own terms; others unchanged.

    Values are numbers, arrays (which get their dimension's name) or DataArrays. Raises BadInput.
    """
    names = {p.name: p for p in scene.PARAMETERS}
    found = {}
    for key, value in given.items():
        angle = key.removesuffix(DEGREES)
        if key not in names and key != angle and angle in names and names[angle].units == "rad":
            found |= _put(given, {angle: _of(value, key, np.radians)})
            if key in found[angle].coords:
                about = {
                    "long_name": names[angle].long_name,
                    "symbol": names[angle].symbol,
                    "units": "degree",
                }
                found[angle].coords[key].attrs.update(about)
        else:
            found[key] = value
    if not _of_this_package(scene):  # the same names may mean anything
        return found
    if "mu" in names and "body" in found:
        found |= _put(found, _of_body(found.pop("body"), "e" in names and "e" not in found))
    if "mu" in names and "m1" not in names and set(MASSES) & set(found):
        found |= _put(found, {"mu": _ratio(*_taken(found, MASSES))})
    if "inertia_ratio" in names and not set(MOMENTS) & set(names) and set(MOMENTS) & set(found):
        found |= _put(found, {"inertia_ratio": _axial(*_taken(found, MOMENTS))})
    return found


def _of_this_package(scene):
    return getattr(scene, "__name__", "").startswith("survey.scenes.")


def _put(given, new):
    for key in new:
        if key in given:
            raise BadInput(
                f"{key} is given twice, by itself and by physical input; give only one of them"
            )
    return new


def _taken(found, names):
    missing = [name for name in names if name not in found]
    if missing:
        raise BadInput(f"{missing[0]} is missing: give all of {', '.join(names)}")
    return [_of(found.pop(name), name, lambda x: x) for name in names]


def _of(value, name, function):
    """`function` of a number, an array along the dimension `name`, or a DataArray."""
    import xarray as xr  # takes a quarter of a second, and a run of a workflow needs none of it

    try:
        array = value if isinstance(value, xr.DataArray) else np.asarray(value, float)
        if not isinstance(array, xr.DataArray):
            array = xr.DataArray(
                array, {name: array} if array.ndim == 1 else {}, (name,) if array.ndim == 1 else ()
            )
        return function(array.astype(float))
    except (TypeError, ValueError):
        raise BadInput(
            f"{name} = {shown(value)}: it must be a real number or an array of real numbers"
        ) from None


def _ratio(m1, m2):
    """mu of two masses, in any unit: that of the smaller over their sum."""
    if not bool((m1 > 0).all() and (m2 > 0).all()):
        raise BadInput("m1 and m2: masses must be positive")
    return np.minimum(m1, m2) / (m1 + m2)


def _axial(a, b, c):
    """Iz / I of a body with two equal moments of inertia, in any unit."""
    for name, moment in zip(MOMENTS, (a, b, c), strict=True):
        if not bool((moment >= 0).all()):
            raise BadInput(
                f"{name} = {shown(float(moment.min()))}: a moment of inertia must be positive, or 0"
            )
    if not bool(((a <= b + c) & (b <= a + c) & (c <= a + b)).all()):
        raise BadInput(
            "A, B, C: no body has these moments of inertia: none may exceed the sum of the two others"
        )
    for one, other, axial in ((a, b, c), (b, c, a), (a, c, b)):
        if bool(((one == other) & (one > 0)).all()):
            return axial / one
    raise BadInput(
        "A, B, C: two moments of inertia must be equal and positive, as this scene's body has an axis of symmetry"
    )


def _of_body(body, with_eccentricity):
    """mu, and e if it is wanted, of named bodies, along the dimension `body` if there are several."""
    import xarray as xr

    names = np.asarray(body)
    for name in names.ravel():
        if str(name) not in ECCENTRICITY:
            raise BadInput(f"body: {modules.unknown('pair', str(name), list(ECCENTRICITY))}")
    pairs = [str(name).split("-") for name in names.ravel()]
    if isinstance(body, xr.DataArray):
        coordinates, dims = body.coords, body.dims
    else:
        dims = ("body",) if names.ndim else ()
        coordinates = {"body": (dims, names)}

    def along(values):
        return xr.DataArray(np.reshape(values, names.shape), coordinates, dims)

    found = {"mu": along([GM[small] / (GM[great] + GM[small]) for great, small in pairs])}
    if with_eccentricity:
        found["e"] = along([ECCENTRICITY[f"{great}-{small}"] for great, small in pairs])
    return found


def hint(parameter, value, given=()):
    """What to add to a complaint about an angle that looks like degrees, or that was `given` in degrees."""
    if f"{parameter.name}{DEGREES}" in given:
        return f" (rad); {parameter.name}{DEGREES} is {np.degrees(value):g}"
    largest = max(abs(parameter.minimum), abs(parameter.maximum))
    if parameter.units == "rad" and np.isfinite(largest) and largest < abs(value) <= 360.0:
        return f" (rad); if it is in degrees, give {parameter.name}{DEGREES} = {value:g}"
    return ""


def words(scene):
    """The names of physical input that the scene takes."""
    return {name for names in described(scene) for name in names.split(", ")}


def meant(scene, word):
    """The scene's parameters in whose place this physical input stands; [] for any other word."""
    if word not in words(scene):
        return []
    angle = word.removesuffix(DEGREES)
    names = {"body": ("mu", "e")} | dict.fromkeys(MASSES, ("mu",))
    names |= dict.fromkeys(MOMENTS, ("inertia_ratio",))
    return [p for p in scene.PARAMETERS if p.name in names.get(word, (angle,))]


def described(scene):
    """Sentences on what the scene takes in place of its parameters, {names: words}."""
    names = {p.name: p for p in scene.PARAMETERS}
    angles = {f"{key}{DEGREES}": f"{p.long_name} in degrees, instead of {key}" for key, p in names.items()
              if p.units == "rad"}  # fmt: skip
    if not _of_this_package(scene):
        return angles
    if "mu" in names:
        angles |= {
            "body": f"instead of mu{' and e' if 'e' in names else ''}: {listed(ECCENTRICITY)}"
        }
        angles |= {"m1, m2": "masses in any unit, instead of mu"} if "m1" not in names else {}
    if "inertia_ratio" in names and not set(MOMENTS) & set(names):
        angles |= {
            "A, B, C": "moments of inertia in any unit, two of them equal, instead of inertia_ratio"
        }
    return angles
