"""Functions that kernels call, as code that becomes machine code with theirs and never alone: optimising each
by itself took a sixth of the compiler's time.
"""

import numba
from numba.core import codegen
from numba.core.compiler import Compiler


class _Code(codegen.JITCodeLibrary):
    """The code of a function before LLVM's optimiser."""

    def _optimize_final_module(self):
        pass

    def _finalize_final_module(self):
        self._finalized = True


class Pipeline(Compiler):
    """numba's compiler, up to the code of LLVM."""

    def __init__(self, typingctx, targetctx, library, args, return_type, flags, locals):
        library = _Code(targetctx.codegen(), "inlined")
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        super().__init__(typingctx, targetctx, library, args, return_type, flags, locals)


def kept(dispatcher):
    """The dispatcher of a function that `Pipeline` compiles: kernels find its code there, and called from
    Python it is plain Python.
    """
    if numba.config.DISABLE_JIT:
        return dispatcher
    function = dispatcher.py_func

    def add_overload(result):
        arguments, libraries = tuple(result.signature.args), [result.library]
        dispatcher.targetctx.insert_user_function(function, result.fndesc, libraries)
        dispatcher.overloads[arguments] = result._replace(entry_point=function)

    dispatcher.add_overload = add_overload
    dispatcher._compile_for_args = lambda *_arguments, **_names: function
    return dispatcher
