"""A program for an NVIDIA GPU: every run has a thread of its own, and a warp is what a vector register is elsewhere.

The same operations as on a processor, rounded alike, and contracted nowhere: the same bits.
"""

import functools
from pathlib import Path
from typing import Any

import jax
import numpy as np
from llvmlite import binding

from simdjit.cache import cached
from simdjit.codegen import Head
from simdjit.cpu import parsed
from simdjit.cuda import Driver
from simdjit.graph import Unsupported

# Threads of a warp, which lie side by side in memory.
LANES = 32

# Threads of a block: so few that each may use as many registers as there are for one.
_BLOCK = 128

# The newest generation that LLVM writes plainly; later ones run its code, too.
_NEWEST = 90

_REGISTERS = ("ctaid", "ntid", "tid")
_MEMORIES = ("numbers", "carry", "series")


def _own(memory: str) -> str:
    """Lines that find a thread's group in a memory, and in there its numbers of 4 and of 8 bytes."""
    return f"""\
  %{memory}before = mul i64 %group, %{memory}size
  %{memory} = getelementptr i8, ptr %{memory}all, i64 %{memory}before
{_within(memory)}"""


def _within(base: str) -> str:
    return f"""\
  %{base}4 = getelementptr i8, ptr %{base}, i64 %before4
  %{base}8 = getelementptr i8, ptr %{base}, i64 %before8"""


_OWN = "\n".join(map(_own, _MEMORIES))

# Arguments: three memories and the bytes of a group in each; steps, steps between records, threads.
THREADS = Head(
    f"""\
define ptx_kernel void @run(ptr noalias %numbersall, ptr noalias %carryall, ptr noalias %seriesall,
    i64 %numberssize, i64 %carrysize, i64 %seriessize, i64 %steps, i64 %every, i64 %threads) {{
entry:
  %block = call i32 @llvm.nvvm.read.ptx.sreg.ctaid.x()
  %blocksize = call i32 @llvm.nvvm.read.ptx.sreg.ntid.x()
  %within = call i32 @llvm.nvvm.read.ptx.sreg.tid.x()
  %blocks = mul i32 %block, %blocksize
  %number = add i32 %blocks, %within
  %thread = zext i32 %number to i64
  %inside = icmp ult i64 %thread, %threads
  br i1 %inside, label %own, label %end
own:
  %group = udiv i64 %thread, {LANES}
  %lane = urem i64 %thread, {LANES}
  %before4 = shl i64 %lane, 2
  %before8 = shl i64 %lane, 3
{_OWN}
  br label %begin""",
    place=_within("row"),
    threads=True,
    functions=tuple(f"declare i32 @llvm.nvvm.read.ptx.sreg.{register}.x()" for register in _REGISTERS),
)


@functools.cache
def gpu() -> Driver | None:
    """The GPU that JAX sees; None where it sees none, or none of NVIDIA's."""
    if jax.default_backend() != "gpu":
        return None
    try:
        return Driver()
    except OSError:
        return None


class Kernel:
    """A program on a GPU; may be run by several threads at once.

    Args:
        assembly: LLVM's, of lanes that begin as THREADS.
        driver: of the GPU.
        cache: folder of compiled code; None for the default.

    Raises:
        Unsupported: it has remainders of division, which LLVM rounds on a GPU.
        OSError: the driver cannot make code of it.
    """

    def __init__(self, assembly: str, driver: Driver, cache: Path | None = None):
        if " = frem " in assembly:
            raise Unsupported("a remainder on a GPU")
        self._driver = driver
        self._function = driver.load(ptx(assembly, min(driver.generation, _NEWEST), cache), "run")

    def run(self, numbers: np.ndarray, carry: np.ndarray, series: np.ndarray, steps: int, every: int) -> None:
        """Run it for all groups of lanes at once; memories as `layout.Layout` makes them.

        Raises:
            OSError: the GPU has not enough memory, or fails.
        """
        memories, threads = (numbers, carry, series), len(numbers) * LANES
        sizes = [memory.nbytes // len(memory) for memory in memories]
        with self._driver.room([memory.nbytes for memory in memories]) as places:
            self._driver.put(numbers, places[0])
            self._driver.launch(self._function, -(-threads // _BLOCK), _BLOCK, [*places, *sizes, steps, every, threads])
            self._driver.get(places[1], carry)
            self._driver.get(places[2], series)


def ptx(assembly: str, generation: int, cache: Path | None = None) -> str:
    """Assembly of NVIDIA's for GPUs from a generation on, such as 90 for Hopper."""
    make = lambda: _target(generation).emit_assembly(parsed(assembly)).encode()
    return cached((assembly, generation, binding.llvm_version_info), ".ptx", make, cache).decode()


def _target(generation: int) -> Any:
    binding.initialize_all_targets()
    binding.initialize_all_asmprinters()
    triple = binding.Target.from_triple("nvptx64-nvidia-cuda")
    return triple.create_target_machine(cpu=f"sm_{generation}", opt=3)
