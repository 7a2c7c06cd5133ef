"""The frame of a program of lanes: start, then tick after tick, and now and then a look."""

from collections.abc import Sequence
from typing import NamedTuple

from undertow.lanes.emit import SLOT, Emitter
from undertow.lanes.graph import I64, Graph, Node

TICK = "tick"


class Sections(NamedTuple):
    """What is stored where: one node per slot.

    Attributes:
        start: first carry, of numbers.
        tick: next carry, of numbers, the carry and the number of the tick.
        look: what is looked at, of the same.
    """

    start: Sequence[Node]
    tick: Sequence[Node]
    look: Sequence[Node]


# Arguments: numbers, carry and series in their slots; ticks in all; ticks between looks, 0 for none.
_FRAME = """\
define void @run(ptr noalias %numbers, ptr noalias %carry, ptr noalias %series, i64 %ticks, i64 %every) {{
entry:
{start}
  %looking = icmp ne i64 %every, 0
  br i1 %looking, label %look, label %straight
straight:
  br label %tick
look:
  %first = phi i64 [ 0, %entry ], [ %next, %after ]
  %row = phi ptr [ %series, %entry ], [ %later, %after ]
{look}
  %nextrow = getelementptr i8, ptr %row, i64 {row}
  %then = add i64 %first, %every
  %more = icmp slt i64 %first, %ticks
  br i1 %more, label %go, label %end
go:
  br label %tick
tick:
  %k = phi i64 [ 0, %straight ], [ %first, %go ], [ %next, %tick ]
  %until = phi i64 [ %ticks, %straight ], [ %then, %go ], [ %until, %tick ]
  %later = phi ptr [ %series, %straight ], [ %nextrow, %go ], [ %later, %tick ]
{tick}
  %next = add i64 %k, 1
  %again = icmp slt i64 %next, %until
  br i1 %again, label %tick, label %after
after:
  br i1 %looking, label %look, label %end
end:
  ret void
}}
{functions}
"""


def assembly(graph: Graph, sections: Sections, lanes: int) -> str:
    """LLVM's assembly of a program.

    Args:
        graph: with inputs ("number", slot), ("carry", slot) and TICK.
        sections: what it stores.
        lanes: entries of a vector.
    """
    emitter = Emitter(graph, lanes)
    fixed = _fixed(graph)
    ready: dict[Node, str] = {}
    needed = graph.needed([*sections.start, *sections.tick, *sections.look])
    _section(emitter, [node for node in range(len(fixed)) if fixed[node] and needed[node]], ready, "s", "%k")
    _stores(emitter, sections.start, ready, "%carry", "%sout")
    start, emitter.lines = emitter.lines, []

    def part(wanted: Sequence[Node], tick: str, letter: str, base: str) -> list[str]:
        values, needed = dict(ready), graph.needed(wanted)
        _section(emitter, [n for n in range(len(fixed)) if needed[n] and not fixed[n]], values, letter, tick)
        _stores(emitter, wanted, values, base, f"%{letter}out")
        lines, emitter.lines = emitter.lines, []
        return lines

    look = part(sections.look, "%first", "l", "%row")
    tick = part(sections.tick, "%k", "t", "%carry")
    return _FRAME.format(
        start="\n".join(start),
        look="\n".join(look),
        tick="\n".join(tick),
        row=len(sections.look) * SLOT * lanes,
        functions="\n".join(sorted(emitter.functions)),
    )


def _fixed(graph: Graph) -> list[bool]:
    """Which nodes are the same in every tick."""
    fixed: list[bool] = []
    for name, *rest in graph.operations:
        if name == "input":
            fixed.append(rest[0] != TICK and rest[0][0] == "number")
        else:
            fixed.append(name == "constant" or all(fixed[node] for node in rest))
    return fixed


def _section(emitter: Emitter, nodes: Sequence[Node], values: dict[Node, str], letter: str, tick: str) -> None:
    """Operations in order; what lies in memory is fetched when it is first used."""
    graph = emitter.graph

    def value(node: Node) -> str:
        if node not in values:
            values[node] = _fetched(emitter, node, f"%{letter}{node}", tick)
        return values[node]

    for node in nodes:
        name, *operands = graph.operations[node]
        if name not in ("constant", "input"):
            emitter.operation(node, [value(operand) for operand in operands], f"%{letter}{node}")
            values[node] = f"%{letter}{node}"
    for node in nodes:
        value(node)


def _fetched(emitter: Emitter, node: Node, name: str, tick: str) -> str:
    """A constant or an input."""
    what, detail = emitter.graph.operations[node]
    if what == "constant":
        return emitter.constant(node)
    if detail == TICK:
        return emitter.splat(tick, I64, name)
    kind, slot = detail
    return emitter.load("%numbers" if kind == "number" else "%carry", slot, emitter.graph.types[node], name)


def _stores(emitter: Emitter, nodes: Sequence[Node], values: dict[Node, str], base: str, name: str) -> None:
    for slot, node in enumerate(nodes):
        if emitter.graph.operations[node] != ("input", ("carry", slot)) or base != "%carry":
            emitter.store(values[node], emitter.graph.types[node], base, slot, f"{name}{slot}")
