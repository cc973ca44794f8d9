"""What numba works out again and again while it compiles, remembered or left out while survey's
kernels are compiled: a third of the compiler's time.

The code that it makes is the same, but for what LLVM inlines. For each a[i] of arrays numba tries half a
dozen rules for other types first; where it looks for what is compiled already, it compares the compiler's
flags, which all have one hash, option by option, though nearly all are defaults; functions that it has in
Python itself, such as np.empty, it compiles anew for each set of flags; after each pass it works out again
which variables live where, though the next pass changes that; and it times each of the tens of thousands
of calls of LLVM, of which its events `numba:llvm_lock` tell nothing meanwhile.
"""

from functools import cache

import numba
from numba.core import event
from numba.core.postproc import PostProcessor, VariableLifetime
from numba.core.targetconfig import ConfigStack, TargetConfig
from numba.core.transforms import canonicalize_cfg
from numba.core.types.functions import BaseFunction
from numba.core.typing.templates import _OverloadFunctionTemplate

from survey.kernels import of_callers

_MODULES = ("_operator", "builtins", "math")  # of functions that are asked for most
_LLVM = "numba:llvm_lock"
_HANDED_ON = (
    "error_model",
    "fastmath",
    "nrt",
    "boundscheck",
)  # flags, to functions that are called
_known = {}


def begin():
    """From here on numba remembers."""
    for (owner, name), ours in _OURS.items():
        setattr(owner, name, ours)


def end():
    """From here on numba does as usual."""
    for (owner, name), usual in _USUAL.items():
        setattr(owner, name, usual)


def _equal(self, other):
    """Options that neither of two sets has are the same defaults."""
    if type(self) is not type(other):
        return _USUAL[TargetConfig, "__eq__"](self, other)
    one, two = self._values, other._values
    return one == two or all(getattr(self, name) == getattr(other, name) for name in {**one, **two})


def _hash(self):
    """A number that depends on the names of the options, not on their values, as in numba."""
    return _hash_of(type(self))


@cache
def _hash_of(kind):
    return hash(tuple(sorted(kind.options)))


def _call_type(self, context, args, kws):
    """The signature of a call with arguments of these types."""
    function = self.key[0]
    if kws or getattr(function, "__module__", None) not in _MODULES:
        return _USUAL[BaseFunction, "get_call_type"](self, context, args, kws)
    asked = self, context, tuple(args)  # a function to which a rule is added is another one
    signature = _known.get(asked)
    if signature is None:
        signature = _USUAL[BaseFunction, "get_call_type"](self, context, args, kws)
        # else numba has compiled something for this call, which it notes at each call
        if self.get_impl_key(signature) is function:
            _known[asked] = signature
    return signature


def _unless_llvm(broadcast):
    def called(kind, *data, **more):
        if kind != _LLVM:
            broadcast(kind, *data, **more)

    return called


def _of_callers(**options):
    return lambda function: of_callers.kept(
        numba.jit(function, **options, pipeline_class=of_callers.Pipeline)
    )


def _shared(self, args, kws):
    """The function that numba compiles for a call of one of its own, such as np.empty or max, with these types.
    It would compile it for each set of flags, though few matter, and make machine code of each that is
    never called.
    """
    flags = ConfigStack.top_or_none()
    if flags is None:
        return _USUAL[_OverloadFunctionTemplate, "_get_impl"](self, args, kws)
    count = tuple(str(getattr(flags, name)) for name in _HANDED_ON)
    asked = self.context, tuple(args), tuple(kws.items()), count
    if asked in self._impl_cache:
        return self._impl_cache[asked]
    flags = flags.copy()
    # max and min, else loops with them are no vector code; not np.empty, which is long
    flags.forceinline = getattr(self.key, "__module__", None) == "builtins"
    self._get_jit_decorator = lambda: _of_callers
    with ConfigStack().enter(flags):
        return self._build_impl(asked, args, kws)


def _post_processed(self, emit_dels=False, extend_lifetimes=False):
    """Which variables live where is found when it is asked for: after most passes of the compiler nothing asks
    before the next one changes it. Generators and object mode need more, and are worked through as usual.
    """
    function, flags = self.func_ir, ConfigStack.top_or_none()
    objects = flags is not None and (flags.enable_pyobject or flags.force_pyobject)
    if function.is_generator or objects:
        _USUAL[PostProcessor, "run"](self, emit_dels, extend_lifetimes)
        return
    function.blocks = canonicalize_cfg(function.blocks)
    function.variable_lifetime, function.generator_info = VariableLifetime(function.blocks), None
    if emit_dels:
        self._insert_var_dels(extend_lifetimes=extend_lifetimes)


_OURS = {
    (TargetConfig, "__eq__"): _equal,
    (TargetConfig, "__hash__"): _hash,
    (BaseFunction, "get_call_type"): _call_type,
    (_OverloadFunctionTemplate, "_get_impl"): _shared,
    (PostProcessor, "run"): _post_processed,
    (event, "start_event"): _unless_llvm(event.start_event),
    (event, "end_event"): _unless_llvm(event.end_event),
}
# From the oldest to the newest version of numba with which this was tried: others do as usual.
if not (0, 61) <= numba.version_info.short <= (0, 68):
    _OURS.clear()
_USUAL = {(owner, name): getattr(owner, name) for owner, name in _OURS}
