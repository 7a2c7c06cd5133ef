"""Many runs of one kind by one program: the batch compiler's, or XLA's where that lacks an operation."""

import math
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import numpy as np

from undertow.core.batch_compiler import Unsupported
from undertow.simulation.loop import simd_batch
from undertow.simulation.loop.loop_runs import LoopRun, RunPlan
from undertow.simulation.loop.outcome import Outcome
from undertow.simulation.loop.simd_batch import SimdBatchRunner
from undertow.simulation.loop.vmap_batch import XlaBatchRunner


class BatchRunner:
    """Runs of one kind, compiled once.

    Args:
        run: one of them.
        plan: how they are run; a call may ask for fewer steps.
        constant: which arrays of `run` are equal in all runs, in the order of `numbers_of`; they shorten the program.
        backend: "simd", or "xla" where the batch compiler is not to be used.
        runs: how many it is compiled for, where that is known; any number can be run, with the same bits.
        width: runs at once of the batch compiler; as many as fit a register unless given.
        xla_width: runs at once by XLA; the usual number unless given.
        gpu: whether a GPU runs them where there is one.

    Attributes:
        left_to_xla: the reason why XLA runs what the batch compiler was asked for, "" otherwise.

    Raises:
        Unsupported: the batch compiler lacks an operation, and the plan is one that XLA runs one by one only: plant and
            controller are integrated together.
    """

    def __init__(
        self,
        run: LoopRun,
        plan: RunPlan,
        constant: Sequence[bool],
        *,
        backend: str = "simd",
        runs: float = math.inf,
        width: int = 0,
        xla_width: int = 0,
        gpu: bool = False,
    ):
        self._run, self._plan, self._xla_width = run, plan, xla_width
        self._simd: SimdBatchRunner | None = None
        self._xla: dict[int, XlaBatchRunner] = {}  # by number of steps
        self.left_to_xla = ""
        if backend == "simd":
            self._compile(list(constant), runs, width, gpu)
        if self._simd is None and plan.continuous:
            raise Unsupported(self.left_to_xla or "plant and controller that are integrated together")

    def _compile(self, constant: list[bool], runs: float, width: int, gpu: bool) -> None:
        for driver in dict.fromkeys((simd_batch.gpu() if gpu else None, None)):
            try:
                self._simd = SimdBatchRunner(self._run, self._plan, constant, width, driver, runs)
            except Unsupported as error:
                self.left_to_xla = str(error)
            else:
                self.left_to_xla = ""
                return

    @property
    def backend(self) -> str:
        """What runs them: "simd" or "xla"."""
        return "xla" if self._simd is None else "simd"

    def run(self, numbers: Sequence[np.ndarray], steps: int | None = None) -> Outcome:
        """Run a batch; the outcome has NumPy arrays with a leading axis over runs.

        Args:
            numbers: arrays of the runs in the order of `numbers_of`, with a leading axis over runs.
            steps: how many; as planned unless given.
        """
        tree = jax.tree.structure(eqx.filter(self._run, eqx.is_array))
        stacked: Any = jax.tree.unflatten(tree, numbers)
        steps = self._plan.steps if steps is None else steps
        if self._simd is not None:
            return self._simd.run(stacked, steps)
        if steps not in self._xla:
            self._xla[steps] = XlaBatchRunner(self._run, self._plan._replace(steps=steps), self._xla_width)
        return self._xla[steps].run(stacked)
