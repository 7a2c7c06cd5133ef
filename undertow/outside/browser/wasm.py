"""A program of a system as WebAssembly, compiled by the C compiler of the package `ziglang`."""

import ctypes
import importlib.util
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from undertow.core.errors import BadInput
from undertow.outside.export.c_program import CProgram, Field

_CTYPES: Mapping[str, Any] = {
    "bool": ctypes.c_bool,
    "float64": ctypes.c_double,
    "float32": ctypes.c_float,
    "int64": ctypes.c_int64,
    "uint64": ctypes.c_uint64,
    "int32": ctypes.c_int32,
    "uint32": ctypes.c_uint32,
}

# A restart or a change of numbers writes a state of its own: of it the page takes what the seed realizes.
_MEMORY = """\
#include "{name}.h"

static {name}_state state, started;
static {name}_input input;
static {name}_output output;

void *state_address(void) {{ return &state; }}
void *started_address(void) {{ return &started; }}
void *input_address(void) {{ return &input; }}
void *output_address(void) {{ return &output; }}
void start(void) {{ {name}_start(&started, &input, &output); }}
void step(void) {{ {name}_step(&state, &input, &output); }}
"""
EXPORTED = ("state_address", "started_address", "input_address", "output_address", "start", "step")

# wasm32-wasi has the libm that C99 asks for, with an `fma` that rounds once; the module imports nothing of WASI.
_OPTIONS = ("-target", "wasm32-wasi", "-mexec-model=reactor", "-std=c99", "-O2", "-Wl,--strip-all")
_STACK = 1 << 20  # bytes; a supervised step takes some 40 kB


def check_wasm_compiler() -> None:
    """Check that the package `ziglang` is installed.

    Raises:
        BadInput: it is not.
    """
    if importlib.util.find_spec("ziglang") is None:
        hint = "In the folder of undertow, run: pip install -c constraints.txt '.[wasm]'"
        raise BadInput("--wasm", "have a compiler", "without one: the package ziglang is not installed", hint=hint)


def memory_source(name: str) -> str:
    """C that holds state, input and output of the program `name`, and takes its steps without arguments."""
    return _MEMORY.format(name=name)


def compiled_to_wasm(program: CProgram) -> bytes:
    """The program as a WebAssembly module that imports nothing.

    Raises:
        BadInput: there is no compiler, or it fails.
    """
    check_wasm_compiler()
    name = program.system.name
    with tempfile.TemporaryDirectory() as folder_name:
        folder = Path(folder_name)
        sources = {f"{name}.h": program.header(), f"{name}.c": program.text(), "memory.c": memory_source(name)}
        for file_name, text in sources.items():
            (folder / file_name).write_text(text, encoding="utf-8")
        exports = [f"-Wl,--export={function}" for function in EXPORTED]
        command = [sys.executable, "-m", "ziglang", "cc", *_OPTIONS, *exports, f"-Wl,-z,stack-size={_STACK}"]
        command += ["-o", "program.wasm", f"{name}.c", "memory.c"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            message = (done.stderr.strip().splitlines() or ["no message"])[-1]
            raise BadInput("--wasm", "be compiled by ziglang", f"not: {message}")
        return (folder / "program.wasm").read_bytes()


class StructLayout(NamedTuple):
    """Where the members of a struct lie in memory.

    Attributes:
        bytes: of the struct.
        members: by name, offset in bytes, type and count of numbers.
    """

    bytes: int
    members: dict[str, dict[str, Any]]


def layout_of(members: list[Field]) -> StructLayout:
    """The layout of a struct: WebAssembly aligns numbers to their size, as the processors do that undertow runs on."""
    sized = [member for member in members if member.size]
    types = [(member.name, _CTYPES[member.dtype] * member.size) for member in sized]
    struct = type("Struct", (ctypes.Structure,), {"_fields_": types})
    places = {
        member.name: {"offset": getattr(struct, member.name).offset, "type": member.dtype, "count": member.size}
        for member in sized
    }
    return StructLayout(ctypes.sizeof(struct), places)
