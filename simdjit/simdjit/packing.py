"""Which scalar operations of a single run share a vector register (superword-level parallelism).

A batch fills its registers with runs. A single run has no others beside it, but often does the same to many numbers, as
`jnp.sin` of an array does. Nodes that are made in the same way of the same kinds of operands form a pack: each of them
has a lane, and its bits do not depend on the others. S. Larsen and S. Amarasinghe, Exploiting superword level
parallelism with multimedia instruction sets (2000).
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import count
from typing import NamedTuple

from simdjit.graph import BOOL, COMMUTATIVE, Graph, Node

# Nodes of one pack at least.
_FEWEST = 2

# Cost, in operations, of putting one number into a lane or of taking it out of one, of a truth, which lies in another
# kind of register, and of a region's test and jump. They gave the shortest times of one run of two large
# simulations on a processor with eight lanes; from 1 to 2 and 3 to 6 these differ by a few per cent.
_MOVE, _MOVE_TRUTH, _REGION = 1.5, 4.0, 3

# Nodes that are never packed: they stand for memory, or for what exists once.
_ALONE = ("constant", "input", "table", "entry", "product", "part")

Group = tuple[Node, ...]


def width_of(group: Group) -> int:
    """Lanes of a group: a power of two."""
    return 1 << (len(group) - 1).bit_length()


class Packs(NamedTuple):
    """What shares registers.

    Attributes:
        groups: nodes that are computed together, in the order of their lanes; by each of them.
        before: groups of operands that are the same in every step, so that they are brought together once.
        kinds: of all nodes.
    """

    groups: Mapping[Node, Group] = {}
    before: Sequence[Group] = ()
    kinds: Sequence[int] = ()

    def operands(self, graph: Graph, group: Group) -> list[Group]:
        """Operands of a pack, brought into one order where it does not matter."""
        return _operands(graph, group, self.kinds)

    def in_order(self, graph: Graph, nodes: Sequence[Node]) -> Sequence[Node | Group]:
        """Some nodes and packs of them, each after its operands; a pack that is not wanted whole is taken apart."""
        if not self.groups:
            return nodes
        units = self._units(graph, nodes)
        done: set[Node | Group] = set()
        order: list[Node | Group] = []
        for node in nodes:
            stack = [units[node]]
            while stack:
                unit = stack[-1]
                members = unit if isinstance(unit, tuple) else (unit,)
                operands = (operand for member in members for operand in graph.operations[member].operands)
                waiting = dict.fromkeys(units[operand] for operand in operands if operand in units)
                waiting = [other for other in waiting if other not in done]
                if waiting and unit not in done:
                    stack += reversed(waiting)
                    continue
                stack.pop()
                if unit not in done:
                    done.add(unit)
                    order.append(unit)
        return order

    def _units(self, graph: Graph, nodes: Sequence[Node]) -> dict[Node, Node | Group]:
        home_nodes, units = set(nodes), {}
        is_result = lambda node: graph.operations[node].name == "result"
        for node in sorted(nodes, key=is_result):  # regions first: results are packed as theirs are
            group = self.groups.get(node, ())
            complete = bool(group) and home_nodes.issuperset(group)
            if complete and is_result(node):
                regions = tuple(graph.operations[member].operands[0] for member in group)
                complete = units[regions[0]] == regions
            units[node] = group if complete else node
        return units


def _operands(graph: Graph, group: Group, kinds: Sequence[int]) -> list[Group]:
    rows = []
    for node in group:
        name, operands, _ = graph.operations[node]
        rows.append(sorted(operands, key=lambda operand: kinds[operand]) if name in COMMUTATIVE else operands)
    return [tuple(column) for column in zip(*rows, strict=True)]


def _kinds(graph: Graph) -> list[int]:
    """Numbers of nodes, the same for those that are made in the same way; of the leaves only the type matters.

    Nodes of one kind are equally far from the leaves, so none of them depends on another one.
    """
    numbers: dict[object, int] = defaultdict(count().__next__)
    kinds: list[int] = []
    for node, (name, operands, detail) in enumerate(graph.operations):
        if name in ("constant", "input"):
            key = ("leaf", graph.types[node])
        elif name in _ALONE:
            key = ("alone", node)
        else:
            of_operands = [kinds[operand] for operand in operands]
            if name in COMMUTATIVE:
                of_operands.sort()
            made = _signature(graph, detail) if name == "region" else detail
            key = (name, graph.types[node], made, graph.homes[node], *of_operands)
            key = ("alone", node) if name == "region" and made is None else key
        kinds.append(numbers[key])
    return kinds


def _signature(graph: Graph, number: int) -> object:
    """What a region does to its operands, line by line; None where it depends on more than those and constants."""
    region = graph.regions[number]
    outputs = (region.test, *region.results)
    names: dict[Node, object] = {node: f"given {i}" for i, node in enumerate(region.inputs)}
    if any(not graph.inside(node, number) and not _constant(graph, node) for node in outputs):
        return None
    lines = []
    for node in graph.needed_inside(number, outputs):  # operands first
        name, operands, detail = graph.operations[node]
        if any(not graph.inside(operand, number) and not _constant(graph, operand) for operand in operands):
            return None
        if node not in names:
            if name in ("region", "result", "table", "product", "part"):
                return None
            lines.append((name, graph.types[node], detail, *(names.get(operand, -operand) for operand in operands)))
            names[node] = len(lines)
    return region.repeats, tuple(lines), tuple(names.get(node, -node) for node in outputs)


def _constant(graph: Graph, node: Node) -> bool:
    """Whether a node is a constant or a table of constants."""
    name, operands, _ = graph.operations[node]
    return graph.value(node) is not None or (
        name == "table" and all(graph.value(operand) is not None for operand in operands)
    )


def find_packs(graph: Graph, outputs: Sequence[Node], fixed: Sequence[bool], width: int) -> Packs:
    """Packs of what is done in every step.

    Args:
        graph: of the program.
        outputs: of a step.
        fixed: which nodes are the same in every step.
        width: lanes of a register.
    """
    kinds, needed = _kinds(graph), graph.needed(outputs)
    outside = [home is None for home in graph.homes]
    free = {node for node, wanted in enumerate(needed) if wanted and not (outside[node] and fixed[node])}
    packs = _grown(graph, kinds, {node for node in free if graph.operations[node].name not in _ALONE}, width)
    worthwhile = _Balance(graph, kinds, packs, outputs, needed, fixed).worthwhile()
    groups = {group for pack in worthwhile for group in _operands(graph, pack, kinds) if len(set(group)) > 1}
    before = [group for group in sorted(groups) if all(fixed[node] and outside[node] for node in group)]
    return Packs({node: pack for pack in worthwhile for node in pack}, before, kinds)


def _grown(graph: Graph, kinds: Sequence[int], free: set[Node], width: int) -> list[Group]:
    """All packs that there are, from the last results down to the operands, so that their lanes are in line."""
    alike: dict[int, list[Node]] = defaultdict(list)
    for node in sorted(free):
        alike[kinds[node]].append(node)
    made: list[Group] = []
    for nodes in sorted(alike.values(), key=lambda nodes: -nodes[-1]):
        left = [node for node in nodes if node in free]
        waiting = [tuple(left[first : first + width]) for first in range(0, len(left), width)]
        while waiting:
            group = waiting.pop()
            same = len({kinds[node] for node in group}) == 1
            if len(group) >= _FEWEST and len(set(group)) == len(group) and same and free.issuperset(group):
                free.difference_update(group)
                made.append(group)
                waiting += _operands(graph, group, kinds)
    return made


def _cheap(graph: Graph, fixed: Sequence[bool], group: Group) -> float | None:
    """Cost of bringing a group together that needs no moves number by number; None where it does."""
    if all(graph.value(node) is not None for node in group):
        return 0.0
    return _MOVE if len(set(group)) == 1 or all(fixed[node] for node in group) else None


def _taken(due: set[Group], part: Sequence[Group]) -> bool:
    """Whether some packs of a part are due; none of them is afterwards."""
    is_due = not due.isdisjoint(part)
    due.difference_update(part)
    return is_due


class _Balance:
    """What packs save and cost, in instructions."""

    def __init__(
        self,
        graph: Graph,
        kinds: Sequence[int],
        packs: Sequence[Group],
        outputs: Sequence[Node],
        needed: Sequence[bool],
        fixed: Sequence[bool],
    ):
        self._graph, self._outputs = graph, set(outputs)
        self._operands = {pack: _operands(graph, pack, kinds) for pack in packs}
        self._pack_of = {node: pack for pack in packs for node in pack}
        self._users: dict[Node, set[Node]] = defaultdict(set)
        for node, wanted in enumerate(needed):
            for operand in graph.uses(node) if wanted else ():
                self._users[operand].add(node)
        groups = {group for of_pack in self._operands.values() for group in of_pack}
        self._cheap = {group: cost for group in groups if (cost := _cheap(graph, fixed, group)) is not None}
        # Packs to be weighed: what one saves changes only where another one near it is given up.
        self._due_alone, self._due_in_parts = set(packs), set(packs)

    def worthwhile(self) -> list[Group]:
        """The packs that save more than they cost, each of them and together with those that it works with."""
        packs = dict.fromkeys(self._operands)
        while True:
            lost = [pack for pack in packs if _taken(self._due_alone, [pack]) and self._given_up([pack])]
            for part in self._connected(packs.keys() - lost):
                if _taken(self._due_in_parts, part) and self._given_up(part):
                    lost += part
            if not lost:
                return list(packs)
            for pack in lost:
                del packs[pack]

    def _given_up(self, packs: Sequence[Group]) -> bool:
        """Take some packs apart if that costs nothing."""
        around = self._beside(packs).union(packs)
        before = self._moves(around)
        for pack in packs:
            for node in pack:
                del self._pack_of[node]
        if self._moves(around.difference(packs)) + sum(map(self._saved, packs)) <= before:
            near = around | self._beside(around)
            self._due_alone |= near
            self._due_in_parts |= near
            return True
        self._pack_of |= {node: pack for pack in packs for node in pack}
        return False

    def _beside(self, packs: Iterable[Group]) -> set[Group]:
        """Packs that give operands to some packs, or use them."""
        return {self._pack_of[node] for pack in packs for node in self._neighbours(pack) if node in self._pack_of}

    def _saved(self, pack: Group) -> int:
        name = self._graph.operations[pack[0]].name
        return 0 if name == "result" else (_REGION if name == "region" else 1) * (len(pack) - 1)

    def _neighbours(self, pack: Group) -> Iterator[Node]:
        for node in pack:
            yield from self._graph.operations[node].operands
            yield from self._users[node]

    def _moves(self, packs: Iterable[Group]) -> float:
        """Instructions that bring numbers into the lanes of packs and out of them."""
        total, seen = 0.0, set()
        for pack in packs:
            for group in self._operands[pack]:
                if group not in seen:
                    seen.add(group)
                    total += self._gathering(group)
            if self._graph.operations[pack[0]].name != "region":
                alone = (node in self._outputs or not self._users[node] <= self._pack_of.keys() for node in pack)
                total += sum(self._move(node) for node, out in zip(pack, alone, strict=True) if out)
        return total

    def _gathering(self, group: Group) -> float:
        if self._pack_of.get(group[0]) == group:
            return 0.0
        if group in self._cheap:
            return self._cheap[group]
        return sum(self._move(node) * (2 if node in self._pack_of else 1) for node in group)

    def _move(self, node: Node) -> float:
        return _MOVE_TRUTH if self._graph.types[node] == BOOL else _MOVE

    def _connected(self, packs: Iterable[Group]) -> list[list[Group]]:
        """Packs that give each other operands."""
        beside: dict[Group, set[Group]] = {pack: set() for pack in packs}
        for pack in beside:
            for group in self._operands[pack]:
                if group in beside:
                    beside[pack].add(group)
                    beside[group].add(pack)
        parts, reached = [], set[Group]()
        for pack in beside:
            if pack in reached:
                continue
            part = [pack]
            for member in part:  # grows on the way
                reached.add(member)
                part += beside[member] - reached
                reached |= beside[member]
            parts.append(part)
        return parts
