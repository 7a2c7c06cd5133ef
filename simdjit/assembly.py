"""The frame of a program of lanes: start, then step after step, and now and then a look."""

from collections.abc import Sequence
from typing import NamedTuple

from simdjit.calls import ARGUMENT, FORMULAS
from simdjit.emit import SLOT, Emitter
from simdjit.graph import Graph, Node
from simdjit.scalar import Scalar
from simdjit.section import Section

TICK = "step"


class Sections(NamedTuple):
    """What is stored where: one node per slot.

    Attributes:
        start: first carry, of numbers.
        step: next carry, of numbers, the carry and the number of the step.
        look: what is looked at, of the same.
    """

    start: Sequence[Node]
    step: Sequence[Node]
    look: Sequence[Node]


class Head(NamedTuple):
    """How a program begins: from its arguments to %numbers, %carry and %series in their slots, %steps, %every.

    Attributes:
        text: up to block `begin`; may leave by block `end`.
        place: where in %row, the slots of one look, a thread finds its own.
        threads: whether every lane is a thread; a vector otherwise holds all lanes.
        functions: what it calls.
    """

    text: str
    place: str = ""
    threads: bool = False
    functions: tuple[str, ...] = ()


# Arguments: numbers, carry and series; steps in all; steps between looks, 0 for none.
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
  %looking = icmp ne i64 %every, 0
  br i1 %looking, label %look, label %straight
straight:
  br label %step
look:
  %first = phi i64 [ 0, %started ], [ %next, %paused ]
  %row = phi ptr [ %series, %started ], [ %later, %paused ]
{place}
{look}
  %nextrow = getelementptr i8, ptr %row, i64 {row}
  %then = add i64 %first, %every
  %early = icmp slt i64 %then, %steps
  %stop = select i1 %early, i64 %then, i64 %steps
  %more = icmp slt i64 %first, %steps
  br i1 %more, label %go, label %end
go:
  br label %step
step:
  %k = phi i64 [ 0, %straight ], [ %first, %go ], [ %next, %ticked ]
  %until = phi i64 [ %steps, %straight ], [ %stop, %go ], [ %until, %ticked ]
  %later = phi ptr [ %series, %straight ], [ %nextrow, %go ], [ %later, %ticked ]
{step}
  br label %ticked
ticked:
  %next = add i64 %k, 1
  %again = icmp slt i64 %next, %until
  br i1 %again, label %step, label %after
after:
  br i1 %looking, label %paused, label %end
paused:
  %over = urem i64 %next, %every
  %whole = icmp eq i64 %over, 0
  br i1 %whole, label %look, label %end
end:
  ret void
}}
{functions}
"""


def assembly(graph: Graph, sections: Sections, lanes: int, head: Head = VECTORS) -> str:
    """LLVM's assembly of a program.

    Args:
        graph: with inputs ("number", slot), ("carry", slot) and TICK.
        sections: what it stores.
        lanes: runs side by side in memory.
        head: how it begins.
    """
    emitter = Emitter(graph, lanes, 1 if head.threads else lanes)
    emitter.functions.update(head.functions)
    fixed, needed = _fixed(graph), graph.needed([*sections.start, *sections.step, *sections.look])
    start = Section(emitter, "s", step="0")
    start.do([node for node, same in enumerate(fixed) if same and needed[node]])
    start.store(sections.start, "%carry")
    texts = {"start": emitter.taken()}
    parts = {"look": (sections.look, "l", "%first", "%row"), "step": (sections.step, "t", "%k", "%carry")}
    for name, (wanted, letter, step, base) in parts.items():
        emitter.block = name
        section, needed = start.after(letter, step), graph.needed(wanted)
        section.do([node for node, same in enumerate(fixed) if needed[node] and not same])
        section.store(wanted, base)
        texts[name] = emitter.taken()
    row = len(sections.look) * SLOT * lanes
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
    worked = lambda node: graph.operations[node].name not in ("constant", "input", "region", "result")
    return sum(needed[node] and not same and worked(node) for node, same in enumerate(fixed))


def _fixed(graph: Graph) -> list[bool]:
    """Which nodes are the same in every step."""
    fixed: list[bool] = []
    for node, (name, _, detail) in enumerate(graph.operations):
        if name == "input":
            fixed.append(detail != TICK and detail[0] != "carry")
        else:
            fixed.append(all(fixed[used] for used in graph.uses(node)))
    return fixed
