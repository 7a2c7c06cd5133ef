"""Machine code for this processor, kept from one process to the next."""

import ctypes
import hashlib
import os
from collections.abc import Callable
from typing import Any

from llvmlite import binding

from undertow.lanes.cache import cache_folder

# Arguments of a program: numbers, carry, series; ticks, ticks between looks.
_SIGNATURE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64)


class Code:
    """A compiled program; may be run by several threads at once.

    Args:
        assembly: LLVM's, with a function `run`.
    """

    def __init__(self, assembly: str):
        self._engine = binding.create_mcjit_compiler(binding.parse_assembly(""), _target())
        self._engine.add_object_file(binding.ObjectFileRef.from_data(_object(assembly)))
        self._engine.finalize_object()
        self.run: Callable[..., None] = _SIGNATURE(self._engine.get_function_address("run"))


def lanes_of(bits: int) -> int:
    """Numbers of so many bits in one vector register of this processor."""
    features = binding.get_host_cpu_features()
    register = 512 if features.get("avx512f") else 256 if features.get("avx2") else 128
    return register // bits


def _target() -> Any:
    """This processor; a new object each time, as every engine disposes of its own."""
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    name, features = binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()
    return binding.Target.from_default_triple().create_target_machine(cpu=name, features=features, opt=2, jit=True)


def _object(assembly: str) -> bytes:
    """Machine code, from an earlier process where there is some."""
    told = (assembly, binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten(), binding.llvm_version_info)
    kept = cache_folder() / f"{hashlib.sha256(repr(told).encode()).hexdigest()}.o"
    try:
        return kept.read_bytes()
    except OSError:
        pass
    module = binding.parse_assembly(assembly)
    module.verify()
    made = _target().emit_object(module)
    try:  # a cache that cannot be written is none
        kept.parent.mkdir(parents=True, exist_ok=True)
        part = kept.with_suffix(f".{os.getpid()}")
        part.write_bytes(made)
        part.replace(kept)
    except OSError:
        pass
    return made
