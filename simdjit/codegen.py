"""LLVM's assembly of a whole program: the first carry, then step after step, with records at intervals."""

from collections.abc import Sequence
from typing import NamedTuple

from simdjit.calls import ARGUMENT, FORMULAS
from simdjit.graph import I64, Graph, Node, Operation, Region
from simdjit.instructions import SLOT, Emitter, Table
from simdjit.matrix_loop import emit
from simdjit.scalar import Scalar

STEP = "step"


class Sections(NamedTuple):
    """What is stored where: one node per slot.

    Attributes:
        start: first carry, of numbers.
        step: next carry, of numbers, the carry and the number of the step.
        record: what is recorded, of the same.
    """

    start: Sequence[Node]
    step: Sequence[Node]
    record: Sequence[Node]


class Head(NamedTuple):
    """How a program begins: from its arguments to %numbers, %carry and %series in their slots, %steps, %every.

    Attributes:
        text: up to block `begin`; may leave by block `end`.
        place: where in %row, the slots of one record, a thread finds its own.
        threads: whether every lane is a thread; a vector otherwise holds all lanes.
        functions: what it calls.
    """

    text: str
    place: str = ""
    threads: bool = False
    functions: tuple[str, ...] = ()


# Arguments: numbers, carry and series; steps in all; steps between records, 0 for none.
VECTORS = Head("""\
define void @run(ptr noalias %numbers, ptr noalias %carry, ptr noalias %series, i64 %steps, i64 %every) {
entry:
  br label %begin""")

_FRAME = """\
{constants}
{head}
begin:
{rooms}
{start}
  br label %started
started:
  %recording = icmp ne i64 %every, 0
  br i1 %recording, label %record, label %straight
straight:
  br label %step
record:
  %first = phi i64 [ 0, %started ], [ %next, %paused ]
  %row = phi ptr [ %series, %started ], [ %later, %paused ]
{place}
{record}
  %nextrow = getelementptr i8, ptr %row, i64 {row}
  %then = add i64 %first, %every
  %early = icmp slt i64 %then, %steps
  %stop = select i1 %early, i64 %then, i64 %steps
  %more = icmp slt i64 %first, %steps
  br i1 %more, label %go, label %end
go:
  br label %step
step:
  %k = phi i64 [ 0, %straight ], [ %first, %go ], [ %next, %stepped ]
  %until = phi i64 [ %steps, %straight ], [ %stop, %go ], [ %until, %stepped ]
  %later = phi ptr [ %series, %straight ], [ %nextrow, %go ], [ %later, %stepped ]
{step}
  br label %stepped
stepped:
  %next = add i64 %k, 1
  %again = icmp slt i64 %next, %until
  br i1 %again, label %step, label %after
after:
  br i1 %recording, label %paused, label %end
paused:
  %over = urem i64 %next, %every
  %whole = icmp eq i64 %over, 0
  br i1 %whole, label %record, label %end
end:
  ret void
}}
{functions}
"""


def assembly(graph: Graph, sections: Sections, lanes: int, head: Head = VECTORS) -> str:
    """LLVM's assembly of a program.

    Args:
        graph: with inputs ("number", slot), ("carry", slot) and STEP.
        sections: what it stores.
        lanes: runs side by side in memory.
        head: how it begins.
    """
    emitter = Emitter(graph, lanes, 1 if head.threads else lanes)
    emitter.functions.update(head.functions)
    fixed, needed = _fixed(graph), graph.needed([*sections.start, *sections.step, *sections.record])
    start = Section(emitter, "s", step="0")
    start.do([node for node, same in enumerate(fixed) if same and needed[node]])
    start.store(sections.start, "%carry")
    texts = {"start": emitter.taken()}
    parts = {"record": (sections.record, "l", "%first", "%row"), "step": (sections.step, "t", "%k", "%carry")}
    for name, (wanted, letter, step, base) in parts.items():
        emitter.block = name
        section, needed = start.after(letter, step), graph.needed(wanted)
        section.do([node for node, same in enumerate(fixed) if needed[node] and not same])
        section.store(wanted, base)
        texts[name] = emitter.taken()
    row = len(sections.record) * SLOT * lanes
    called = [_function(name, dtype, emitter) for name, dtype in sorted(emitter.called)]
    further = {
        "constants": emitter.constants,
        "rooms": emitter.rooms,
        "functions": [*called, *sorted(emitter.functions)],
    }
    joined = {name: "\n".join(lines) for name, lines in further.items()}
    return _FRAME.format(head=head.text, place=head.place, **texts, row=row, **joined)


def _function(name: str, dtype: str, emitter: Emitter) -> str:
    """A function of `calls`; it stands beside the program, so that it costs nothing where it is not called."""
    graph = Graph()
    result = FORMULAS[name](Scalar(graph, graph.input(ARGUMENT, dtype))).node
    within = Emitter(graph, emitter.width, emitter.width)
    within.constants = emitter.constants
    section = Section(within, "f", step="0")
    needed = graph.needed([result])
    section.do([node for node, wanted in enumerate(needed) if wanted])
    kind, body = within.vector(dtype), within.taken()
    emitter.functions |= within.functions
    lines = [
        f"define internal {kind} @{name}.{dtype}({kind} %x) cold noinline {{",
        body,
        f"  ret {kind} %f{result}",
        "}",
    ]
    return "\n".join(lines)


def operations(graph: Graph, sections: Sections) -> int:
    """Operations of one step of one run, those inside a loop counted once; an elementary function counts as one."""
    fixed, needed = _fixed(graph), graph.needed(sections.step)
    # What happens inside a region is done in every step where the region is, though its own inputs are no carry.
    outermost = {detail: node for node, (name, _, detail) in enumerate(graph.operations) if name == "region"}
    same = lambda node: fixed[node if graph.homes[node] is None else outermost[graph.around(graph.homes[node])]]
    return sum(_work(graph.operations[node]) for node, wanted in enumerate(needed) if wanted and not same(node))


def _work(operation: Operation) -> int:
    if operation.name == "product":
        return operation.detail.operations
    return operation.name not in ("constant", "input", "region", "result", "part")


def _fixed(graph: Graph) -> list[bool]:
    """Which nodes are the same in every step."""
    fixed: list[bool] = []
    for node, (name, _, detail) in enumerate(graph.operations):
        if name == "input":
            fixed.append(detail != STEP and detail[0] != "carry")
        else:
            fixed.append(all(fixed[used] for used in graph.uses(node)))
    return fixed


class Section:
    """Operations of one part of a program, or of a region in it.

    Args:
        emitter: gets the lines.
        letter: begins the names of values.
        step: name of the number of the step.
        values: names of nodes that are known already.
    """

    def __init__(self, emitter: Emitter, letter: str, step: str, values: dict[Node, str] | None = None):
        self._emitter, self._letter, self._step = emitter, letter, step
        self._values = values or {}
        self._results: dict[Node, list[str]] = {}
        self._tables: dict[Node, Table] = {}

    def after(self, letter: str, step: str) -> "Section":
        """Another part, where everything of this one is known."""
        return self._further(letter, step)

    def _further(self, letter: str, step: str) -> "Section":
        section = Section(self._emitter, letter, step, dict(self._values))
        section._tables = dict(self._tables)
        return section

    def do(self, nodes: Sequence[Node], home: int | None = None) -> None:
        """Operations in order, those of one home; what lies in memory is fetched when it is first used."""
        graph = self._emitter.graph
        nodes = [node for node in nodes if graph.homes[node] == home]
        for node in nodes:
            name, operands, detail = graph.operations[node]
            if name == "region":
                self._results[node] = self._region(node, graph.regions[detail], detail)
            elif name == "result":
                self._values[node] = self._results[operands[0]][detail]
            elif name == "product":
                one, other = (self._tables[operand] for operand in operands)
                self._tables[node] = emit(self._emitter, one, other, detail, graph.types[node], f"{self._letter}{node}")
            elif name == "part":
                self._values[node] = f"%{self._letter}{node}"
                self._emitter.at(self._tables[operands[0]], str(detail), graph.types[node], self._values[node])
            elif name == "table":
                table = self._whole_product(operands) or self._emitter.stored(operands)
                if table is None:
                    values = [self.value(operand) for operand in operands]
                    table = self._emitter.table(operands, values, f"%{self._letter}{node}")
                self._tables[node] = table
            elif name == "entry":
                self._values[node] = f"%{self._letter}{node}"
                place = self.value(operands[1])
                self._emitter.entry(self._tables[operands[0]], place, graph.types[node], self._values[node])
            elif name not in ("constant", "input"):
                known = [self.value(operand) for operand in operands]
                self._emitter.operation(node, known, f"%{self._letter}{node}")
                self._values[node] = f"%{self._letter}{node}"
        for node in nodes:
            if graph.operations[node].name not in ("region", "table", "product"):
                self.value(node)

    def _whole_product(self, entries: Sequence[Node]) -> Table | None:
        """Where the results of a product lie, if that is what the entries are."""
        operations = self._emitter.graph.operations
        first = operations[entries[0]]
        if first.name != "part":
            return None
        made = operations[first.operands[0]].detail
        same = [operations[node] == first._replace(detail=i) for i, node in enumerate(entries)]
        return self._tables[first.operands[0]] if all(same) and len(same) == made.rows * made.columns else None

    def value(self, node: Node) -> str:
        """Name of a node; fetched when it is a constant or lies in memory."""
        if node not in self._values:
            self._values[node] = self._fetched(node, f"%{self._letter}{node}")
        return self._values[node]

    def store(self, nodes: Sequence[Node], base: str) -> None:
        """Put nodes into slots of memory; a carry that stays as it is lies there already."""
        emitter = self._emitter
        for slot, node in enumerate(nodes):
            operation = emitter.graph.operations[node]
            if base != "%carry" or operation.name != "input" or operation.detail != ("carry", slot):
                emitter.store(self.value(node), emitter.graph.types[node], base, slot, f"%{self._letter}out{slot}")

    def _fetched(self, node: Node, name: str) -> str:
        emitter, operation = self._emitter, self._emitter.graph.operations[node]
        assert operation.name in ("constant", "input"), (node, operation)
        if operation.name == "constant":
            return emitter.constant(node)
        if operation.detail == ARGUMENT:
            return "%x"
        if isinstance(operation.detail, str):
            return emitter.splat(self._step, I64, name)
        kind, slot = operation.detail
        return emitter.load("%numbers" if kind == "number" else "%carry", slot, emitter.graph.types[node], name)

    def _region(self, node: Node, region: Region, number: int) -> list[str]:
        """Names of the results of a region."""
        graph, name = self._emitter.graph, f"{self._letter}r{node}"
        given = [self.value(operand) for operand in graph.operations[node].operands[: len(region.inputs)]]
        inner = self._further(name, self._step)
        if region.repeats:
            return self._repeated(inner, region, number, given, name)
        inner._values |= zip(region.inputs, given, strict=True)
        before = self._emitter.block
        self._emitter.fork(inner.value(region.test), f"{name}b", f"{name}x", f"{name}any")
        inner.do(graph.needed_inside(number, region.results), number)
        done = [inner.value(result) for result in region.results]
        self._emitter.enter(f"{name}e")
        self._emitter.enter(f"{name}x")
        return [
            self._emitter.joined(graph.types[result], {f"{name}e": value, before: "zeroinitializer"}, f"%{name}y{i}")
            for i, (result, value) in enumerate(zip(region.results, done, strict=True))
        ]

    def _repeated(self, inner: "Section", region: Region, number: int, given: list[str], name: str) -> list[str]:
        emitter, graph = self._emitter, self._emitter.graph
        before = emitter.block
        emitter.enter(f"{name}h")
        names = [f"%{name}y{i}" for i in range(len(given))]
        for entry, value, result in zip(names, given, region.results, strict=True):
            emitter.joined(graph.types[result], {before: value, f"{name}e": f"{entry}n"}, entry)
        inner._values |= zip(region.inputs, names, strict=True)
        tested = graph.needed_inside(number, [region.test])
        inner.do(tested, number)
        test = inner.value(region.test)
        emitter.fork(test, f"{name}b", f"{name}x", f"{name}any")
        known = set(tested)
        inner.do([node for node in graph.needed_inside(number, region.results) if node not in known], number)
        for entry, result in zip(names, region.results, strict=True):
            emitter.choice(test, inner.value(result), entry, graph.types[result], f"{entry}n")
        emitter.enter(f"{name}e")
        emitter.lines.append(f"  br label %{name}h")
        emitter.label(f"{name}x")
        return names
