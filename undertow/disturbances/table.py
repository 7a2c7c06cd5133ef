"""A disturbance replayed from samples."""

import csv
import math
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core.contracts import AbstractDisturbance, Load
from undertow.core.errors import BadInput
from undertow.core.param import param


class Table(AbstractDisturbance):
    """Samples of the lumped acceleration, linear in between, held before the first and after the last."""

    times: Float[Array, " samples"] = param("s", "sampling times")
    values: Float[Array, "samples n"] = param("m/s^2, rad/s^2", "lumped acceleration")

    def draw(self, key) -> tuple[()]:
        return ()

    def at(self, path, t, calm: Load) -> Load:
        axes = calm.acceleration.shape[0]
        if self.values.shape[1] != axes:
            raise BadInput("file", f"have columns t, d1..d{axes}", f"a table of {self.values.shape[1]} axes")
        signal = jax.vmap(jnp.interp, in_axes=(None, None, 1))(t, self.times, self.values)
        return calm._replace(acceleration=calm.acceleration + signal)

    def jumps(self, duration: float) -> tuple[float, ...]:
        return ()


def table(file: str) -> Table:
    """Lumped accelerations from a CSV file with a header and columns t, d1, d2, ... (s; m/s^2, rad/s^2).

    Args:
        file: path of the table.

    Raises:
        BadInput: missing, empty or malformed file, or times that do not increase.
    """
    path = Path(file)
    if not path.is_file():
        raise BadInput("file", "be an existing CSV file", file)
    with path.open(newline="", encoding="utf-8-sig") as handle:
        try:
            rows = [row for row in csv.reader(handle) if any(cell.strip() for cell in row)]
        except (UnicodeDecodeError, csv.Error) as error:
            raise BadInput("file", "be a CSV text file", f"{file}: {error}") from None
    if not rows:
        raise BadInput("file", "have a header and at least two rows", f"{file}, which is empty")
    header, *body = [[cell.strip() for cell in row] for row in rows]
    expected = ["t", *(f"d{i}" for i in range(1, len(header)))]
    if header != expected or len(header) < 2:
        raise BadInput("file", "have the columns t, d1, d2, ...", f"{file} with columns {', '.join(header)}")
    if len(body) < 2:
        raise BadInput("file", "have at least two rows of samples", f"{file} with {len(body)}")
    samples = np.array([_numbers(file, i + 2, row, len(header)) for i, row in enumerate(body)])
    steps = np.diff(samples[:, 0])
    if (steps <= 0).any():
        at = int(np.argmax(steps <= 0))
        raise BadInput("file", "have increasing times", f"{file}: t = {samples[at + 1, 0]:g} after {samples[at, 0]:g}")
    return Table(samples[:, 0], samples[:, 1:])


def _numbers(file: str, line: int, row: list[str], columns: int) -> list[float]:
    if len(row) != columns:
        raise BadInput("file", f"have {columns} columns everywhere", f"{file}, row {line} with {len(row)}")
    try:
        numbers = [float(cell) for cell in row]
    except ValueError:
        raise BadInput("file", "hold numbers only", f"{file}, row {line}: {', '.join(row)}") from None
    if not all(map(math.isfinite, numbers)):
        raise BadInput("file", "hold finite numbers only", f"{file}, row {line}: {', '.join(row)}")
    return numbers
