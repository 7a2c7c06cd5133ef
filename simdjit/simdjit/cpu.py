"""Machine code for this processor."""

import ctypes
import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import numpy as np
from llvmlite import binding

from simdjit.cache import cached
from simdjit.graph import Unsupported

# Arguments of a program: numbers, carry, series; steps, steps between records.
_SIGNATURE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64)

# Whether code is compiled thoroughly; "later" where it turns out to be run often.
Optimize = bool | Literal["later"]

# Seconds that briefly compiled code has run, after which a thread compiles it thoroughly as soon as it is called again.
# Where a command calls it once or twice nothing is gained; somebody who moves a slider calls it hundreds of times.
_LONG = 0.1


class Code:
    """A compiled program; may be run by several threads at once.

    Args:
        assembly: LLVM's, with a function `run`.
        cache: folder of compiled code; None for the default.
        sparing: order instructions so that few registers are needed, rather than so that none waits for another one.
        optimize: see `loop.Loop`.
    """

    def __init__(self, assembly: str, cache: Path | None = None, sparing: bool = False, optimize: Optimize = True):
        may_optimize = os.environ.get("SIMDJIT_OPTIMIZATION") != "0"
        self._compile = lambda level: self._load(_object(assembly, cache, sparing, level), level)
        self._brief, self._spent = may_optimize and optimize == "later", 0.0
        self._engines: list[Any] = []  # another thread may still run the code of an earlier one
        self._compile(_THOROUGH if may_optimize and optimize is True else _BRIEF)

    def _load(self, code: bytes, level: int) -> None:
        engine = binding.create_mcjit_compiler(binding.parse_assembly(""), _target(level))
        engine.add_object_file(binding.ObjectFileRef.from_data(code))
        engine.finalize_object()
        self._engines.append(engine)
        self._run: Callable[..., None] = _SIGNATURE(engine.get_function_address("run"))

    def run(self, numbers: np.ndarray, carry: np.ndarray, series: np.ndarray, steps: int, every: int) -> None:
        """Run it for every group of lanes; memories as `layout.Layout` makes them."""
        if self._brief and self._spent > _LONG:
            self._brief = False
            threading.Thread(target=self._compile, args=(_THOROUGH,)).start()
        began = time.perf_counter()
        for group in range(len(numbers)):
            self._run(*(memory[group].ctypes.data for memory in (numbers, carry, series)), steps, every)
        self._spent += time.perf_counter() - began

    def repeated(self, numbers: np.ndarray, carry: np.ndarray, series: np.ndarray) -> Callable[[], None]:
        """A function that records one instant of all groups, with as little ado as possible."""
        memories = numbers, carry, series
        at = lambda group: [ctypes.c_void_p(memory[group].ctypes.data) for memory in memories]
        run, steps, every = self._run, ctypes.c_int64(0), ctypes.c_int64(1)
        first, *others = map(at, range(len(numbers)))

        def again(kept: tuple[Any, ...] = (self, *memories)) -> None:  # nothing of it may be freed
            run(*first, steps, every)
            for places in others:
                run(*places, steps, every)

        return again


def simd_width(bits: int) -> int:
    """Numbers of so many bits in one vector register of this processor."""
    features = binding.get_host_cpu_features()
    register = 512 if features.get("avx512f") else 256 if features.get("avx2") else 128
    return register // bits


# How hard LLVM tries: level 0 takes a sixth to a third of the time for code that runs half as long again. Results have
# the same bits at both levels, as programs ask for IEEE arithmetic as it is written.
_BRIEF, _THOROUGH = 0, 2


def _target(level: int) -> Any:
    """This processor; a new object each time, as every engine disposes of its own."""
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    name, features = binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()
    triple = binding.Target.from_default_triple()
    return triple.create_target_machine(cpu=name, features=features, opt=level, jit=True)


def parsed(assembly: str) -> binding.ModuleRef:
    """LLVM's module of an assembly, verified.

    Raises:
        Unsupported: LLVM refuses it.
    """
    try:
        module = binding.parse_assembly(assembly)
        module.verify()
    except RuntimeError as error:
        raise Unsupported(f"LLVM refuses the program ({' '.join(str(error).split())[:200]})") from error
    return module


def _object(assembly: str, cache: Path | None, sparing: bool, level: int) -> bytes:
    processor = binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten(), binding.llvm_version_info
    return cached((assembly, *processor, sparing, level), ".o", lambda: _compiled(assembly, sparing, level), cache)


# LLVM's list scheduling that reduces registers, bottom up. In long programs most numbers lie in memory, and this order
# leaves fewer of them there: a step of 25 000 operations takes a sixth to a third less.
# LLVM ends the process at a switch that it does not know, so a later one is left as it is.
_SPARING, _USUAL = "-pre-RA-sched=list-burr", "-pre-RA-sched=default"
_LAST_KNOWN = 22


def _compiled(assembly: str, sparing: bool, level: int) -> bytes:
    module, target = parsed(assembly), _target(level)
    if not sparing or binding.llvm_version_info[0] > _LAST_KNOWN:
        return target.emit_object(module)
    binding.set_option("simdjit", _SPARING)  # of the whole process, so it is set back at once
    try:
        return target.emit_object(module)
    finally:
        binding.set_option("simdjit", _USUAL)
