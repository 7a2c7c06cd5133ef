"""Small dense products, written so that XLA fuses them with their neighbours."""

from jaxtyping import Array, Float


def matvec(matrix: Float[Array, "m n"], vector: Float[Array, " n"]) -> Float[Array, " m"]:
    """Product of a small matrix and a vector.

    A multiply and a sum instead of a `dot`: XLA turns every `dot` into a call of its own, which for a
    6 x 8 matrix costs more than the arithmetic. Written this way the product melts into the elementwise
    code around it, and one closed-loop step becomes one compiled function.
    """
    return (matrix * vector).sum(-1)
