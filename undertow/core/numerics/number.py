"""What annotations call a number.

Functions take and return JAX arrays; whoever has NumPy arrays converts them (`core/arrays.py`), because JAX would keep
them in a compiled program. Where one number is meant that people write down, a Python float will do as well.
"""

from jaxtyping import Array, Float

Number = Float[Array, ""] | float
