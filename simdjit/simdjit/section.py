"""One part of a program, operation after operation, as lines of assembly."""

from collections.abc import Sequence
from typing import NamedTuple

from simdjit.calls import ARGUMENT
from simdjit.graph import I64, Node, Region
from simdjit.instructions import Emitter, Table
from simdjit.matrix_loop import emit
from simdjit.packing import Group, Packs, width_of


class Lane(NamedTuple):
    """Where a number of a pack lies.

    Attributes:
        vector: name of its vector.
        lane: which.
        width: of how many.
    """

    vector: str
    lane: int
    width: int


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
        self._packs = Packs()
        self._vectors: dict[Group, str] = {}
        self._lanes: dict[Node, Lane] = {}

    def pack(self, packs: Packs) -> None:
        """Compute the nodes of each pack together."""
        self._packs = packs

    def after(self, letter: str, step: str) -> "Section":
        """Another part, where everything of this one is known."""
        return self._further(letter, step)

    def _further(self, letter: str, step: str) -> "Section":
        section = Section(self._emitter, letter, step, dict(self._values))
        section._tables, section._vectors, section._lanes = dict(self._tables), dict(self._vectors), dict(self._lanes)
        section._packs = self._packs
        return section

    def do(self, nodes: Sequence[Node], home: int | None = None) -> None:
        """Operations in order, those of one home; what lies in memory is fetched when it is first used."""
        graph = self._emitter.graph
        nodes = [node for node in nodes if graph.homes[node] == home]
        for unit in self._packs.in_order(graph, nodes):
            if isinstance(unit, tuple):
                self._do_together(unit)
                continue
            node = unit
            name, operands, detail = graph.operations[node]
            if name == "region":
                arguments = [self.value(operand) for operand in operands[: len(graph.regions[detail].inputs)]]
                self._results[node] = self._region(f"{self._letter}r{node}", detail, arguments)
            elif name == "result" and operands[0] in self._lanes:  # of several regions, but wanted alone
                _, lane, width = self._lanes[operands[0]]
                self._lanes[node] = Lane(self._results[operands[0]][detail], lane, width)
            elif name == "result":
                self._values[node] = self._results[operands[0]][detail]
            elif name == "product":
                left, right = (self._tables[operand] for operand in operands)
                self._tables[node] = emit(
                    self._emitter, left, right, detail, graph.types[node], f"{self._letter}{node}"
                )
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
                index = self.value(operands[1])
                self._emitter.entry(self._tables[operands[0]], index, graph.types[node], self._values[node])
            elif name not in ("constant", "input"):
                operand_names = [self.value(operand) for operand in operands]
                self._emitter.operation(node, operand_names, f"%{self._letter}{node}")
                self._values[node] = f"%{self._letter}{node}"
        for node in nodes:
            if node not in self._lanes and graph.operations[node].name not in ("region", "table", "product"):
                self.value(node)

    def _do_together(self, group: Group) -> None:
        """Operations of a pack."""
        emitter, graph, width = self._emitter, self._emitter.graph, width_of(group)
        name, operands, detail = graph.operations[group[0]]
        vector, results = f"%{self._letter}p{group[0]}", []
        if name == "result":
            vector = self._results[operands[0]][detail]
        else:
            columns = self._packs.operands(graph, group)
            if name == "region":  # what it captures besides are constants
                columns = columns[: len(graph.regions[detail].inputs)]
            arguments = [self.together(column, width) for column in columns]
            emitter.width, outer = width, emitter.width
            if name == "region":
                results = self._region(vector[1:], detail, arguments)
            else:
                emitter.operation(group[0], arguments, vector)
            emitter.width = outer
        self._vectors[group] = vector
        for lane, node in enumerate(group):
            self._lanes[node], self._results[node] = Lane(vector, lane, width), results

    def together(self, group: Group, width: int) -> str:
        """Name of a vector of some nodes; the last one fills the lanes that are left."""
        if group not in self._vectors:
            emitter, graph = self._emitter, self._emitter.graph
            numbers = [graph.value(node) for node in group]
            dtype, name = graph.types[group[0]], f"%{self._letter}g{len(self._vectors)}x{group[0]}"
            if None not in numbers:
                return emitter.listed(numbers, dtype, width)
            if len(set(group)) == 1:
                self._vectors[group] = emitter.spread(self.value(group[0]), dtype, width, name)
            else:
                values = [self.value(node) for node in group]
                self._vectors[group] = emitter.gathered(values, dtype, width, name)
        return self._vectors[group]

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
            name = f"%{self._letter}{node}"
            if node in self._lanes:
                self._values[node] = self._emitter.taken_out(*self._lanes[node], self._emitter.graph.types[node], name)
            else:
                self._values[node] = self._fetched(node, name)
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

    def _region(self, name: str, number: int, arguments: list[str]) -> list[str]:
        """Names of the results of a region."""
        graph = self._emitter.graph
        region, inner = graph.regions[number], self._further(name, self._step)
        if self._emitter.width > 1:  # lanes hold what is packed already
            inner.pack(Packs())
        if region.repeats:
            return self._repeated(inner, region, number, arguments, name)
        inner._values |= zip(region.inputs, arguments, strict=True)
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

    def _repeated(self, inner: "Section", region: Region, number: int, arguments: list[str], name: str) -> list[str]:
        emitter, graph = self._emitter, self._emitter.graph
        before = emitter.block
        emitter.enter(f"{name}h")
        names = [f"%{name}y{i}" for i in range(len(arguments))]
        for entry, value, result in zip(names, arguments, region.results, strict=True):
            emitter.joined(graph.types[result], {before: value, f"{name}e": f"{entry}n"}, entry)
        inner._values |= zip(region.inputs, names, strict=True)
        tested = graph.needed_inside(number, [region.test])
        inner.do(tested, number)
        test = inner.value(region.test)
        emitter.fork(test, f"{name}b", f"{name}x", f"{name}any")
        tested_nodes = set(tested)
        inner.do([node for node in graph.needed_inside(number, region.results) if node not in tested_nodes], number)
        for entry, result in zip(names, region.results, strict=True):
            emitter.choice(test, inner.value(result), entry, graph.types[result], f"{entry}n")
        emitter.enter(f"{name}e")
        emitter.lines.append(f"  br label %{name}h")
        emitter.label(f"{name}x")
        return names
