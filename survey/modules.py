"""Names resolve to modules: a scene or a method is found by its file name; no list is kept by hand."""

import sys
from difflib import get_close_matches
from importlib import import_module
from pkgutil import iter_modules

from survey.errors import BadInput
from survey.wording import listed, short, shown

OTHER_WORDS = {  # that users of other programs know
    **dict.fromkeys(("tol", "tolerance", "atol", "accuracy", "precision"), "rtol"),
    **dict.fromkeys(("integrator", "solver"), "method"),
    **dict.fromkeys(("outputs", "output"), "variables"),
    "trace": "discriminant",
    **dict.fromkeys(("growth", "growth_rate", "lyapunov_exponent", "floquet_exponent"), "exponent"),
    **dict.fromkeys(("stability", "stable"), "verdict"),
    **dict.fromkeys(("n", "points", "count", "step"), "num"),
    **dict.fromkeys(("min", "low", "begin"), "start"),
    **dict.fromkeys(("max", "high", "end"), "stop"),
    "scale": "spacing",
    **dict.fromkeys(("file", "filename"), "path"),
    "eccentricity": "e",
    "mass_ratio": "mu",
    "modulus": "k",
}


def names(package):
    """Sorted names of the modules in `package` (an imported package)."""
    return sorted(module.name for module in iter_modules(package.__path__))


def load(package, name, what, further=()):
    """The module `name` of `package`; raises BadInput, naming the nearest, if there is none.

    `further`: names that are allowed, too, and found elsewhere.
    """
    if not isinstance(name, str):
        raise BadInput(unknown(what, name, [*names(package), *further]))
    path = f"{package.__name__}.{name}"
    # the folder is not read again for every block
    if str(name).isidentifier() and path in sys.modules:
        return import_module(path)  # waits for another thread that has begun to import it
    known = names(package)
    if name not in known:
        raise BadInput(unknown(what, name, [*known, *further]))
    return import_module(path)


def unknown(what, name, known, more=()):
    """One line for an unknown name: what it should name, the nearest known one, and those that are
    allowed.

    `more`: names that stand elsewhere and may be meant, too.
    """
    by_lower = {other.lower(): other for other in (*more, *known)}
    text = short(name if isinstance(name, str) else shown(name)).lower()
    near = _nearest(text, by_lower)
    hint = f"; did you mean {by_lower[near]!r}?" if near else ""
    return f"unknown {what} {shown(name)}{hint} (allowed: {listed(known) or 'none'})"


def _nearest(text, known):
    """The known name that is meant: another word for it, one that begins so or is spelt alike; else None."""
    other = OTHER_WORDS.get(text)
    if other in known:
        return other
    begun = [name for name in known if len(text) > 2 and name.startswith(text)]
    return next(iter(begun or get_close_matches(text, known, n=1, cutoff=0.5)), None)
