"""Products of large matrices as loops over memory: written out, they would be more instructions than a cache holds."""

from typing import NamedTuple

from simdjit.graph import Graph, Node, Operation
from simdjit.instructions import Emitter, Table

# Products of two numbers from which on a loop is quicker than what is written out (benchmarks/against_xla.py).
FROM = 4000

# Rows and columns of the result that are summed side by side, where their number divides by it: 8 times 2 sums fit the
# registers. The more rows, the less often the second matrix, which does not fit the first cache, is read.
_BELOW = (8, 6, 5, 4, 3, 2, 1)
_BESIDE = (2, 1)

Matrix = list[list[Node]]


class Product(NamedTuple):
    """A product of two matrices: each result is a sum over `length`, one after another.

    Attributes:
        rows, columns: of the result.
        length: of a row of the first matrix and of a column of the second one.
        turned: whether the first matrix lies in memory column by column, and the second one row by row.
    """

    rows: int
    columns: int
    length: int
    turned: tuple[bool, bool]

    @property
    def operations(self) -> int:
        """Arithmetic ones."""
        return 2 * self.rows * self.columns * self.length


def product(graph: Graph, rows: Matrix, columns: Matrix) -> list[Node]:
    """Every row times every column.

    Args:
        graph: gets the operations.
        rows: of the first matrix.
        columns: of the second one, each as long as a row.
    """
    turned = (_lies_turned(graph, rows), _lies_turned(graph, columns))
    shape = Product(len(rows), len(columns), len(rows[0]), turned)
    tables = []
    for lines, across in zip((rows, columns), turned, strict=True):
        entries = [node for line in (zip(*lines, strict=True) if across else lines) for node in line]
        tables.append(graph.node(Operation("table", tuple(entries)), graph.types[entries[0]]))
    made = graph.node(Operation("product", tuple(tables), shape), graph.types[tables[0]])
    return [graph.node(Operation("part", (made,), i), graph.types[made]) for i in range(len(rows) * len(columns))]


def _lies_turned(graph: Graph, lines: Matrix) -> bool:
    """Whether numbers that follow one another in memory stand below one another."""
    if len(lines) < 2 or len(lines[0]) < 2:
        return False
    first, below = graph.operations[lines[0][0]], graph.operations[lines[1][0]]
    if first.name != below.name or first.operands != below.operands:
        return False
    if first.name == "part":
        return below.detail == first.detail + 1
    return first.name == "input" and below.detail == (first.detail[0], first.detail[1] + 1)


def emit(emitter: Emitter, left: Table, right: Table, shape: Product, dtype: str, name: str) -> Table:
    """Write the loops of a product.

    Args:
        emitter: gets the lines.
        one, other: the matrices.
        shape: of the product.
        dtype: of the numbers.
        name: begins the names of values and blocks.

    Returns:
        Where the results lie, row by row.
    """
    kind, lines = emitter.vector(dtype), emitter.lines
    times, add = ("fmul", "fadd") if dtype.startswith("float") else ("mul", "add")
    below = next(count for count in _BELOW if shape.rows % count == 0)
    beside = next(count for count in _BESIDE if shape.columns % count == 0)
    tile = [(a, b) for a in range(below) for b in range(beside)]
    result = emitter.room(f"%{name}", shape.rows * shape.columns, dtype)
    before = emitter.block
    emitter.enter(f"{name}row")
    lines.append(f"  %{name}i = phi i64 [ 0, %{before} ], [ %{name}in, %{name}rowend ]")
    lines.extend(f"  %{name}i{a} = add i64 %{name}i, {a}" for a in range(below))
    emitter.enter(f"{name}column")
    lines.append(f"  %{name}j = phi i64 [ 0, %{name}row ], [ %{name}jn, %{name}columnend ]")
    lines.extend(f"  %{name}j{b} = add i64 %{name}j, {b}" for b in range(beside))
    emitter.enter(f"{name}sum")
    lines.append(f"  %{name}k = phi i64 [ 0, %{name}column ], [ %{name}kn, %{name}sum ]")
    nothing = emitter.everywhere(-0.0 if times == "fmul" else 0, dtype)  # what changes no sum, not even a zero's sign
    for a, b in tile:
        at = f"{a}x{b}"
        lines.append(f"  %{name}s{at} = phi {kind} [ {nothing}, %{name}column ], [ %{name}n{at}, %{name}sum ]")
    for letter, table, index, count, size, turned in (
        ("x", left, "i", below, shape.rows, shape.turned[0]),
        ("y", right, "j", beside, shape.columns, shape.turned[1]),
    ):
        for a in range(count):
            prefix = f"{name}{letter}{a}"
            entry = _place(emitter, prefix, f"%{name}{index}{a}", f"%{name}k", size, shape.length, turned)
            emitter.at(table, entry, dtype, f"%{prefix}")
    for a, b in tile:
        at = f"{a}x{b}"
        lines.append(f"  %{name}p{at} = {times} {kind} %{name}x{a}, %{name}y{b}")
        lines.append(f"  %{name}n{at} = {add} {kind} %{name}s{at}, %{name}p{at}")
    _again(emitter, f"{name}k", 1, shape.length, f"{name}sum", f"{name}store")
    for a, b in tile:
        at = f"{a}x{b}"
        entry = _place(emitter, f"{name}z{at}", f"%{name}i{a}", f"%{name}j{b}", shape.rows, shape.columns, False)
        emitter.put(f"%{name}n{at}", result, entry, dtype, f"%{name}z{at}")
    emitter.enter(f"{name}columnend")
    _again(emitter, f"{name}j", beside, shape.columns, f"{name}column", f"{name}rowend")
    _again(emitter, f"{name}i", below, shape.rows, f"{name}row", f"{name}end")
    return result


def _place(emitter: Emitter, name: str, row: str, column: str, rows: int, columns: int, turned: bool) -> str:
    """Number of an entry in a table."""
    outer, inner, length = (column, row, rows) if turned else (row, column, columns)
    emitter.lines.append(f"  %{name}o = mul i64 {outer}, {length}")
    emitter.lines.append(f"  %{name}e = add i64 %{name}o, {inner}")
    return f"%{name}e"


def _again(emitter: Emitter, counter: str, step: int, most: int, block: str, after: str) -> None:
    """Count up, and go to a block again or on to the one after."""
    emitter.lines.append(f"  %{counter}n = add i64 %{counter}, {step}")
    emitter.lines.append(f"  %{counter}m = icmp slt i64 %{counter}n, {most}")
    emitter.lines.append(f"  br i1 %{counter}m, label %{block}, label %{after}")
    emitter.label(after)
