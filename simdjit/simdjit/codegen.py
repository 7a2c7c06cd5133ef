"""LLVM's assembly of a whole program: the first carry, then step after step, with records at intervals."""

from collections.abc import Sequence
from typing import NamedTuple

from simdjit.calls import ARGUMENT, FORMULAS
from simdjit.graph import Graph, Node
from simdjit.instructions import SLOT, Emitter
from simdjit.packing import Packs, find_packs, width_of
from simdjit.scalar import Scalar
from simdjit.section import Section

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


def assembly(graph: Graph, sections: Sections, lanes: int, head: Head = VECTORS, beside: int = 1) -> str:
    """LLVM's assembly of a program.

    Args:
        graph: with inputs ("number", slot), ("carry", slot) and STEP.
        sections: what it stores.
        lanes: runs side by side in memory.
        head: how it begins.
        beside: numbers of a single run that share a register.
    """
    emitter = Emitter(graph, lanes, 1 if head.threads else lanes)
    emitter.functions.update(head.functions)
    fixed, needed = _fixed(graph), graph.needed([*sections.start, *sections.step, *sections.record])
    start = Section(emitter, "s", step="0")
    start.do([node for node, same in enumerate(fixed) if same and needed[node]])
    start.store(sections.start, "%carry")
    packs = find_packs(graph, sections.step, fixed, beside) if beside > 1 else Packs()
    for group in packs.before:
        start.together(group, width_of(group))
    texts = {"start": emitter.taken()}
    parts = {"record": (sections.record, "l", "%first", "%row"), "step": (sections.step, "t", "%k", "%carry")}
    for name, (outputs, letter, step, base) in parts.items():
        emitter.block = name
        section, needed = start.after(letter, step), graph.needed(outputs)
        if name == "step":
            section.pack(packs)
        section.do([node for node, same in enumerate(fixed) if needed[node] and not same])
        section.store(outputs, base)
        texts[name] = emitter.taken()
    row = len(sections.record) * SLOT * lanes
    called = [_function(*function, emitter) for function in sorted(emitter.called)]
    further = {
        "constants": emitter.constants,
        "rooms": emitter.rooms,
        "functions": [*called, *sorted(emitter.functions)],
    }
    joined = {name: "\n".join(lines) for name, lines in further.items()}
    return _FRAME.format(head=head.text, place=head.place, **texts, row=row, **joined)


def _function(name: str, dtype: str, width: int, emitter: Emitter) -> str:
    """A function of `calls`; it stands beside the program, so that it costs nothing where it is not called."""
    graph = Graph()
    result = FORMULAS[name](Scalar(graph, graph.input(ARGUMENT, dtype))).node
    within = Emitter(graph, width, width)
    within.constants = emitter.constants
    section = Section(within, "f", step="0")
    needed = graph.needed([result])
    section.do([node for node, is_needed in enumerate(needed) if is_needed])
    kind, body = within.vector(dtype), within.taken()
    emitter.functions |= within.functions
    lines = [
        f"define internal {kind} @{name}.{dtype}.{width}({kind} %x) cold noinline {{",
        body,
        f"  ret {kind} %f{result}",
        "}",
    ]
    return "\n".join(lines)


class OperationCounts(NamedTuple):
    """Operations of one step of one run, those inside a loop counted once; an elementary function counts as one.

    Attributes:
        all: all.
        written: those that are written out; a product of large matrices is a loop.
    """

    all: int
    written: int


def operations(graph: Graph, sections: Sections) -> OperationCounts:
    """Operations of one step of a program."""
    fixed, needed = _fixed(graph), graph.needed(sections.step)
    # What happens inside a region is done in every step where the region is, though its own inputs are no carry.
    outermost = {detail: node for node, (name, _, detail) in enumerate(graph.operations) if name == "region"}
    same = lambda node: fixed[node if graph.homes[node] is None else outermost[graph.around(graph.homes[node])]]
    done = [graph.operations[node] for node, is_needed in enumerate(needed) if is_needed and not same(node)]
    written = sum(operation.name not in _NO_WORK for operation in done)
    return OperationCounts(written + sum(one.detail.operations for one in done if one.name == "product"), written)


_NO_WORK = ("constant", "input", "region", "result", "part", "product")


def _fixed(graph: Graph) -> list[bool]:
    """Which nodes are the same in every step."""
    fixed: list[bool] = []
    for node, (name, operands, detail) in enumerate(graph.operations):
        same = True
        if name == "input":
            same = detail != STEP and detail[0] != "carry"
        for used in graph.uses(node) if name == "region" else operands:
            if not fixed[used]:
                same = False
                break
        fixed.append(same)
    return fixed
