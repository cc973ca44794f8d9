"""What numba works out again and again while it compiles, remembered or left out while survey's
kernels are compiled: a quarter of the compiler's time.

The code that it makes is the same. For each a[i] of arrays it tries half a dozen rules for other
types first; where it looks for what is compiled already, it compares the compiler's flags, which
all have one hash, option by option, though nearly all are defaults; and it times each of the tens
of thousands of calls of LLVM, of which its events `numba:llvm_lock` tell nothing meanwhile.
"""

from functools import cache

from numba.core import event
from numba.core.targetconfig import TargetConfig
from numba.core.types.functions import BaseFunction

_MODULES = ("_operator", "builtins", "math")  # of functions that are asked for most
_LLVM = "numba:llvm_lock"
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


_OURS = {
    (TargetConfig, "__eq__"): _equal,
    (TargetConfig, "__hash__"): _hash,
    (BaseFunction, "get_call_type"): _call_type,
    (event, "start_event"): _unless_llvm(event.start_event),
    (event, "end_event"): _unless_llvm(event.end_event),
}
_USUAL = {(owner, name): getattr(owner, name) for owner, name in _OURS}
