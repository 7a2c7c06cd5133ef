"""Part of a program, in the order in which it is done."""

from collections.abc import Sequence

from simdjit.calls import ARGUMENT
from simdjit.emit import Emitter, Table
from simdjit.graph import I64, Node, Region


class Section:
    """Operations of one part of a program, or of a region in it.

    Args:
        emitter: gets the lines.
        letter: begins the names of values.
        step: name of the number of the step.
        values: names of nodes that are known already.
    """

    def __init__(self, emitter: Emitter, letter: str, step: str, values: dict[Node, str] | None = None):
        self._emitter, self._letter, self._tick = emitter, letter, step
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
            elif name == "table":
                table = self._emitter.stored(operands)
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
            if graph.operations[node].name not in ("region", "table"):
                self.value(node)

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
            return emitter.splat(self._tick, I64, name)
        kind, slot = operation.detail
        return emitter.load("%numbers" if kind == "number" else "%carry", slot, emitter.graph.types[node], name)

    def _region(self, node: Node, region: Region, number: int) -> list[str]:
        """Names of the results of a region."""
        graph, name = self._emitter.graph, f"{self._letter}r{node}"
        given = [self.value(operand) for operand in graph.operations[node].operands[: len(region.inputs)]]
        inner = self._further(name, self._tick)
        if region.repeats:
            return self._repeated(inner, region, number, given, name)
        inner._values |= zip(region.inputs, given, strict=True)
        before = self._emitter.block
        self._emitter.fork(inner.value(region.test), f"{name}b", f"{name}x", f"{name}any")
        inner.do(_needed(graph, region.results), number)
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
        tested = _needed(graph, [region.test])
        inner.do(tested, number)
        test = inner.value(region.test)
        emitter.fork(test, f"{name}b", f"{name}x", f"{name}any")
        known = set(tested)
        inner.do([node for node in _needed(graph, region.results) if node not in known], number)
        for entry, result in zip(names, region.results, strict=True):
            emitter.choice(test, inner.value(result), entry, graph.types[result], f"{entry}n")
        emitter.enter(f"{name}e")
        emitter.lines.append(f"  br label %{name}h")
        emitter.label(f"{name}x")
        return names


def _needed(graph, wanted: Sequence[Node]) -> list[Node]:
    return [node for node, needed in enumerate(graph.needed(wanted)) if needed]
