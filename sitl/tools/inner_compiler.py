"""Compilation by numba of functions that live on in their callers, of parts kept to be linked, and of their ties.

By itself it optimises and translates each function anew in every function that calls it: a first start would take half
as long again. The code that flies is the same.
"""

from __future__ import annotations

from typing import Any

from llvmlite import binding  # type: ignore[import-untyped]
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, _pass_registry
from numba.core.errors import NumbaError

ENVIRONMENT = "_ZN08NumbaEnv"  # how the names of numba's own variables in machine code begin


# Passes that find nothing to do in code of scalars, named tuples and records.
IDLE = frozenset(
    {
        "DumpParforDiagnostics",
        "FindLiterallyCalls",
        "InlineClosureLikes",
        "InlineInlinables",
        "InlineOverloads",
        "LiteralPropagationSubPipelinePass",
        "LiteralUnroll",
        "MakeFunctionToJitFunction",
        "NoPythonSupportedFeatureValidation",
        "NopythonRewrites",
        "RewriteDynamicRaises",
        "WithLifting",
    }
)


class _Passes(PassManager):
    """Numba's own passes less the idle ones, and no clock about each: of a first start that is a seventh."""

    def __init__(self, state: Any) -> None:  # noqa: ANN401
        """Take those of numba's own pipeline."""
        whole = DefaultPassBuilder.define_nopython_pipeline(state)  # type: ignore[no-untyped-call]
        super().__init__(whole.pipeline_name)  # type: ignore[no-untyped-call]
        self.passes = [(kind, step) for kind, step in whole.passes if kind.__name__ not in IDLE]
        self.finalize()  # type: ignore[no-untyped-call]

    def run(self, state: Any) -> None:  # noqa: ANN401
        """Run them one after the other.

        Raises:
            NumbaError: What is to be compiled cannot be.
        """
        for kind, step in self.passes:
            one = _pass_registry.get(kind).pass_inst  # type: ignore[no-untyped-call]
            one.analysis = self._analysis
            try:
                one.run_initialization(state)
                one.run_pass(state)
                one.run_finalizer(state)
            except NumbaError as error:
                raise self._patch_error(f"Failed in {self.pipeline_name} mode pipeline (step: {step})", error)  # type: ignore[no-untyped-call] # noqa: B904 - it is the same error, with the step


class _NoMachineCode:
    """Stands for the code generator where numba would write into machine code that is not there."""

    def set_env(self, name: str, environment: Any) -> None:  # noqa: ANN401
        """Nothing keeps it: only Python objects would need it, which compiled flight code has none of."""


class _Inner(JITCodeLibrary):
    """Code that is linked into that of its callers and never called by itself: no machine code is made of it."""

    @property
    def codegen(self) -> _NoMachineCode:
        """See :class:`_NoMachineCode`."""
        return _NoMachineCode()

    def get_pointer_to_function(self, name: str) -> int:  # noqa: ARG002
        """There is none."""
        return 0

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]
        self._finalized = True


class _Part(_Inner):
    """Code that is kept for the whole it is linked into, in this process or another, with all its optimisation."""

    def serialize_using_object_code(self) -> tuple[str, str, tuple[bytes, bytes]]:
        """The kept code: that to be linked, and machine code of nothing but the variables that numba looks for."""
        module = self._get_module_for_linking()  # type: ignore[no-untyped-call]
        names = [variable.name for variable in module.global_variables if variable.name.startswith(ENVIRONMENT)]
        text = "\n".join(f'@"{name}" = common global ptr null' for name in names)
        empty = binding.parse_assembly(f'target triple = "{module.triple}"\n{text}\n')
        return self.name, "object", (self._codegen._tm.emit_object(empty), module.as_bitcode())  # noqa: SLF001


class _Whole(JITCodeLibrary):
    """Code around parts that are optimised already."""

    def _optimize_final_module(self) -> None:
        make = self._codegen._module_pass_manager  # noqa: SLF001 - as the code library that this one extends
        passes, builder = make(opt=0, loop_vectorize=False, slp_vectorize=False, cost="cheap")  # type: ignore[no-untyped-call]
        passes.run(self._final_module, builder)


class InnerCompiler(CompilerBase):
    """For code of which no machine code is made."""

    def define_pipelines(self) -> list[Any]:
        """The passes."""
        self.state.library = _Inner(self.state.targetctx.codegen(), self.state.func_id.func_qualname)  # type: ignore[no-untyped-call]
        return [_Passes(self.state)]


class PartCompiler(CompilerBase):
    """For code that is kept to be linked."""

    def define_pipelines(self) -> list[Any]:
        """The passes."""
        self.state.library = _Part(self.state.targetctx.codegen(), self.state.func_id.func_qualname)  # type: ignore[no-untyped-call]
        return [_Passes(self.state)]


class WholeCompiler(CompilerBase):
    """Numba's own passes, to code whose parts are not optimised once more."""

    def define_pipelines(self) -> list[Any]:
        """The passes."""
        self.state.library = _Whole(self.state.targetctx.codegen(), self.state.func_id.func_qualname)  # type: ignore[no-untyped-call]
        self.state.library.enable_object_caching()
        return [_Passes(self.state)]
