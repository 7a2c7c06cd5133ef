"""Nodes as instructions of LLVM's assembly: every scalar of the graph is a vector with one entry per lane."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from simdjit.graph import BOOL, I64, Graph, Node

# Numbers of a program lie in slots of this many bytes per lane, whatever their type.
SLOT = 8

_TYPES = {
    "float64": "double",
    "float32": "float",
    "int64": "i64",
    "uint64": "i64",
    "int32": "i32",
    "uint32": "i32",
    BOOL: "i1",
}

_FLOATS = {
    "add": "fadd {T} {0}, {1}",
    "sub": "fsub {T} {0}, {1}",
    "mul": "fmul {T} {0}, {1}",
    "fma": "call {T} @llvm.fma.{N}({T} {0}, {T} {1}, {T} {2})",
    "div": "fdiv {T} {0}, {1}",
    "rem": "frem {T} {0}, {1}",
    "neg": "fneg {T} {0}",
    "copysign": "call {T} @llvm.copysign.{N}({T} {0}, {T} {1})",
    "abs": "call {T} @llvm.fabs.{N}({T} {0})",
    "sqrt": "call {T} @llvm.sqrt.{N}({T} {0})",
    "floor": "call {T} @llvm.floor.{N}({T} {0})",
    "ceil": "call {T} @llvm.ceil.{N}({T} {0})",
    "round": "call {T} @llvm.rint.{N}({T} {0})",
    "ne": "fcmp une {T} {0}, {1}",
    **{name: f"fcmp o{name} {{T}} {{0}}, {{1}}" for name in ("lt", "le", "gt", "ge", "eq")},
}
_INTEGERS = {
    "add": "add {T} {0}, {1}",
    "sub": "sub {T} {0}, {1}",
    "mul": "mul {T} {0}, {1}",
    "div": "{s}div {T} {0}, {1}",
    "rem": "{s}rem {T} {0}, {1}",
    "neg": "sub {T} zeroinitializer, {0}",
    "and": "and {T} {0}, {1}",
    "or": "or {T} {0}, {1}",
    "xor": "xor {T} {0}, {1}",
    "shift_left": "shl {T} {0}, {1}",
    "shift_right": "{shift} {T} {0}, {1}",
    "eq": "icmp eq {T} {0}, {1}",
    "ne": "icmp ne {T} {0}, {1}",
    **{name: f"icmp {{s}}{name} {{T}} {{0}}, {{1}}" for name in ("lt", "le", "gt", "ge")},
}


class Table(NamedTuple):
    """Numbers in memory.

    Attributes:
        base: name of an address.
        first: bytes from there to the first entry.
        step: bytes from an entry to the next one.
        apart: bytes from a lane's number to the next lane's; 0 where all lanes share one.
    """

    base: str
    first: int
    step: int
    apart: int


class Emitter:
    """Lines of assembly.

    Args:
        graph: what they compute.
        lanes: runs side by side in memory.
        width: of them in one vector: all, or 1 where each has a thread of its own.

    Attributes:
        lines: so far.
        functions: declarations of what they call, of LLVM's.
        constants, rooms: what they need besides: tables of constants, and room for tables.
        called: names, types and widths of functions of `calls`.
        block: the one that the lines are in.
    """

    def __init__(self, graph: Graph, lanes: int, width: int):
        self.graph, self.width, self._lanes = graph, width, lanes
        self.lines: list[str] = []
        self.functions: set[str] = set()
        self.constants: list[str] = []
        self.rooms: list[str] = []
        self.called: set[tuple[str, str, int]] = set()
        self.block = "begin"

    def vector(self, dtype: str) -> str:
        """LLVM's name of a vector of a type."""
        return f"<{self.width} x {_TYPES[dtype]}>"

    def taken(self) -> str:
        """The lines so far; the next ones begin anew."""
        lines, self.lines = self.lines, []
        return "\n".join(lines)

    def label(self, block: str) -> None:
        """What follows is another block."""
        self.lines.append(f"{block}:")
        self.block = block

    def enter(self, block: str) -> None:
        """Go on in another block."""
        self.lines.append(f"  br label %{block}")
        self.label(block)

    def fork(self, test: str, block: str, otherwise: str, name: str) -> None:
        """Go on in a block where a truth holds in any lane, else in another one."""
        kind = self.vector(BOOL)
        self.functions.add(f"declare i1 @llvm.vector.reduce.or.v{self.width}i1({kind})")
        self.line(f"call i1 @llvm.vector.reduce.or.v{self.width}i1({kind} {test})", f"%{name}")
        self.lines.append(f"  br i1 %{name}, label %{block}, label %{otherwise}")
        self.label(block)

    def joined(self, dtype: str, ways: Mapping[str, str], name: str) -> str:
        """A value that depends on the block that one comes from."""
        pairs = ", ".join(f"[ {value}, %{block} ]" for block, value in ways.items())
        return self.line(f"phi {self.vector(dtype)} {pairs}", name)

    def choice(self, test: str, if_true: str, if_false: str, dtype: str, name: str) -> str:
        """One or the other, lane by lane."""
        kind = self.vector(dtype)
        return self.line(f"select {self.vector(BOOL)} {test}, {kind} {if_true}, {kind} {if_false}", name)

    def line(self, text: str, name: str) -> str:
        """A line that gives a value its name."""
        self.lines.append(f"  {name} = {text}")
        return name

    def load(self, base: str, slot: int, dtype: str, name: str) -> str:
        """What lies in a slot."""
        stored = I64 if dtype == BOOL else dtype
        address = self._place(base, slot, stored, name)
        loaded = name if stored == dtype else f"{name}w"
        self.line(f"load {self.vector(stored)}, {address}", loaded)
        return (
            loaded if loaded == name else self.line(f"trunc {self.vector(I64)} {loaded} to {self.vector(BOOL)}", name)
        )

    def store(self, value: str, dtype: str, base: str, slot: int, name: str) -> None:
        """Put a value into a slot."""
        stored = I64 if dtype == BOOL else dtype
        if stored != dtype:
            value = self.line(f"zext {self.vector(dtype)} {value} to {self.vector(stored)}", f"{name}w")
        address = self._place(base, slot, stored, name)
        self.lines.append(f"  store {self.vector(stored)} {value}, {address}")

    def _place(self, base: str, slot: int, dtype: str, name: str) -> str:
        """Where the numbers of a slot lie; a thread finds its own beyond a base of its own."""
        size = np.dtype(dtype).itemsize
        base, align = (base, SLOT * self.width) if self.width == self._lanes else (f"{base}{size}", size)
        self.line(f"getelementptr i8, ptr {base}, i64 {slot * SLOT * self._lanes}", f"{name}p")
        return f"ptr {name}p, align {align}"

    def operation(self, node: Node, operands: Sequence[str], name: str) -> None:
        """Do what a node says."""
        what, given, _ = self.graph.operations[node]
        dtype, before = self.graph.types[node], self.graph.types[given[-1]]
        if what == "call":
            called, kind = self.graph.operations[node].detail, self.vector(dtype)
            self.called.add((called, dtype, self.width))
            self.line(f"call {kind} @{called}.{dtype}.{self.width}({kind} {operands[0]})", name)
        elif what == "select":
            self.choice(operands[0], operands[1], operands[2], dtype, name)
        elif what == "bits":
            self.line(f"bitcast {self.vector(before)} {operands[0]} to {self.vector(dtype)}", name)
        elif what == "convert":
            self._convert(before, dtype, operands[0], name)
        else:
            templates = _FLOATS if before.startswith("float") else _INTEGERS
            signed = before.startswith("int")
            short = f"v{self.width}f{before[5:]}"
            words = {"T": self.vector(before), "N": short, "s": "s" if signed else "u"}
            text = templates[what].format(*operands, shift="ashr" if signed else "lshr", **words)
            if text.startswith("call"):
                called = text.split("(")[0].split("@")[1]
                kinds = ", ".join([self.vector(before)] * len(operands))
                self.functions.add(f"declare {self.vector(before)} @{called}({kinds})")
            self.line(text, name)

    def table(self, entries: Sequence[Node], values: Sequence[str], name: str) -> Table:
        """Entries in memory: where they lie already, or among the program's constants, or in room made for them."""
        graph, dtype = self.graph, self.graph.types[entries[0]]
        size = np.dtype(dtype).itemsize
        operations = [graph.operations[node] for node in entries]
        if all(operation.name == "constant" for operation in operations):
            label = f"@table{len(self.constants)}"
            texts = ", ".join(f"{_TYPES[dtype]} {self._number(graph.value(node), dtype)}" for node in entries)
            self.constants.append(f"{label} = internal constant [{len(entries)} x {_TYPES[dtype]}] [{texts}]")
            return Table(label, 0, size, 0)
        table = self.room(name, len(entries), dtype)
        for i, value in enumerate(values):
            self.put(value, table, str(i), dtype, f"{name}p{i}")
        return table

    def room(self, name: str, entries: int, dtype: str) -> Table:
        """Room for so many entries of every lane."""
        size = np.dtype(dtype).itemsize
        self.rooms.append(f"  {name}room = alloca [{entries} x {self.vector(dtype)}], align {size * self.width}")
        return Table(f"{name}room", 0, size * self.width, size)

    def put(self, value: str, table: Table, index: str, dtype: str, name: str) -> None:
        """Put a value into a room, at a place that is the same for all lanes."""
        self.line(f"mul i64 {index}, {table.step}", f"{name}m")
        self.line(f"getelementptr i8, ptr {table.base}, i64 {name}m", f"{name}a")
        self.lines.append(f"  store {self.vector(dtype)} {value}, ptr {name}a, align {table.step}")

    def at(self, table: Table, index: str, dtype: str, name: str) -> None:
        """What stands in a table at a place that is the same for all lanes."""
        kind, size = self.vector(dtype), np.dtype(dtype).itemsize
        self.line(f"mul i64 {index}, {table.step}", f"{name}m")
        self.line(f"add i64 {name}m, {table.first}", f"{name}f")
        self.line(f"getelementptr i8, ptr {table.base}, i64 {name}f", f"{name}a")
        if table.apart:
            self.line(f"load {kind}, ptr {name}a, align {size * self.width}", name)
        else:
            self.line(f"load {_TYPES[dtype]}, ptr {name}a, align {size}", f"{name}l")
            self.splat(f"{name}l", dtype, name)

    def everywhere(self, value: float, dtype: str) -> str:
        """A number, the same in every lane."""
        return f"splat ({_TYPES[dtype]} {self._number(value, dtype)})"

    def stored(self, entries: Sequence[Node]) -> Table | None:
        """Where entries lie one after another among a program's numbers or its carry; None where they do not.

        Only the slots of a vector are aligned like one; a thread finds its own number in each.
        """
        operations = [self.graph.operations[node] for node in entries]
        if any(operation.name != "input" or operation.detail[0] not in ("number", "carry") for operation in operations):
            return None
        kind, first = operations[0].detail
        if [operation.detail for operation in operations] != [(kind, first + i) for i in range(len(operations))]:
            return None
        size = np.dtype(self.graph.types[entries[0]]).itemsize
        base = "%numbers" if kind == "number" else "%carry"
        base = base if self.width == self._lanes else f"{base}{size}"
        return Table(base, first * SLOT * self._lanes, SLOT * self._lanes, size)

    def entry(self, table: Table, index: str, dtype: str, name: str) -> None:
        """What stands in a table at a place of each lane's own."""
        integers, kind = self.vector(I64), self.vector(dtype)
        before = ", ".join(f"i64 {table.first + lane * table.apart}" for lane in range(self.width))
        self.line(f"mul {integers} {index}, splat (i64 {table.step})", f"{name}m")
        self.line(f"add {integers} {name}m, <{before}>", f"{name}a")
        value = "poison"
        for lane in range(self.width):
            self.line(f"extractelement {integers} {name}a, i64 {lane}", f"{name}i{lane}")
            self.line(f"getelementptr i8, ptr {table.base}, i64 {name}i{lane}", f"{name}q{lane}")
            self.line(f"load {_TYPES[dtype]}, ptr {name}q{lane}, align {np.dtype(dtype).itemsize}", f"{name}v{lane}")
            last = name if lane == self.width - 1 else f"{name}w{lane}"
            value = self.line(f"insertelement {kind} {value}, {_TYPES[dtype]} {name}v{lane}, i64 {lane}", last)

    def _convert(self, before: str, dtype: str, operand: str, name: str) -> None:
        from_float, to_float = before.startswith("float"), dtype.startswith("float")
        wider = np.dtype(dtype).itemsize - (0 if before == BOOL else np.dtype(before).itemsize)
        if from_float and not to_float:  # out of range it gives the nearest
            sign = "s" if dtype.startswith("int") else "u"
            call = f"llvm.fpto{sign}i.sat.v{self.width}{_TYPES[dtype]}.v{self.width}f{before[5:]}"
            self.functions.add(f"declare {self.vector(dtype)} @{call}({self.vector(before)})")
            self.line(f"call {self.vector(dtype)} @{call}({self.vector(before)} {operand})", name)
            return
        if wider == 0 and not to_float:
            word = "bitcast"
        elif from_float:
            word = "fpext" if wider > 0 else "fptrunc"
        elif to_float:
            word = "sitofp" if before.startswith("int") else "uitofp"
        elif wider > 0:
            word = "sext" if before.startswith("int") else "zext"
        else:
            word = "trunc"
        self.line(f"{word} {self.vector(before)} {operand} to {self.vector(dtype)}", name)

    def constant(self, node: Node) -> str:
        """A constant, the same in every lane."""
        return self.everywhere(self.graph.value(node), self.graph.types[node])

    def listed(self, numbers: Sequence[Any], dtype: str, width: int) -> str:
        """Constants, one per lane; the last one fills what is left."""
        filled = [*numbers, *[numbers[-1]] * (width - len(numbers))]
        return "<" + ", ".join(f"{_TYPES[dtype]} {self._number(number, dtype)}" for number in filled) + ">"

    def spread(self, value: str, dtype: str, width: int, name: str) -> str:
        """A number of a single run in every lane."""
        kind = f"<1 x {_TYPES[dtype]}>"
        return self.line(f"shufflevector {kind} {value}, {kind} poison, <{width} x i32> zeroinitializer", name)

    def gathered(self, values: Sequence[str], dtype: str, width: int, name: str) -> str:
        """Numbers of a single run, one per lane; the last one fills what is left."""
        scalar, kind = _TYPES[dtype], f"<{width} x {_TYPES[dtype]}>"
        vector = self.spread(values[-1], dtype, width, f"{name}s") if len(values) < width else "poison"
        for lane, value in enumerate(values):
            self.line(f"extractelement <1 x {scalar}> {value}, i64 0", f"{name}e{lane}")
            last = name if lane == len(values) - 1 else f"{name}i{lane}"
            vector = self.line(f"insertelement {kind} {vector}, {scalar} {name}e{lane}, i64 {lane}", last)
        return vector

    def taken_out(self, vector: str, lane: int, width: int, dtype: str, name: str) -> str:
        """The number in one lane."""
        kind = f"<{width} x {_TYPES[dtype]}>"
        return self.line(f"shufflevector {kind} {vector}, {kind} poison, <1 x i32> <i32 {lane}>", name)

    @staticmethod
    def _number(value: Any, dtype: str) -> str:
        # LLVM writes numbers of single precision by the digits of the double that they are.
        return f"0x{np.float64(value).view(np.uint64):016X}" if dtype.startswith("float") else str(value).lower()

    def splat(self, scalar: str, dtype: str, name: str) -> str:
        """A number of the program in every lane."""
        kind = self.vector(dtype)
        self.line(f"insertelement {kind} poison, {_TYPES[dtype]} {scalar}, i64 0", f"{name}s")
        return self.line(f"shufflevector {kind} {name}s, {kind} poison, <{self.width} x i32> zeroinitializer", name)
