"""Python files of a user that are wrong: what they define, what they do when they are read, and what they return."""

import random

from soak.mutation import spoilt_text
from soak.specimens import PLUG_IN

# What a file does at the top; `exit` and exceptions that derive from BaseException are the users' as well.
_AT_IMPORT = (
    "import sys\nsys.exit(3)\n",
    "raise SystemExit\n",
    "raise SystemExit('bye')\n",
    "raise KeyError('a')\n",
    "raise Exception\n",
    "raise BaseException('base')\n",
    "raise GeneratorExit\n",
    "import nothing_of_that_name\n",
    "from . import a\n",
    "1/0\n",
    "def f(): return f()\nf()\n",
    "print('hello')\n",
    "import warnings\nwarnings.warn('hello')\n",
    "raise OSError(2, 'nothing', 'x')\n",
    "open('missing.txt')\n",
    "class E(Exception):\n    def __str__(self): raise ValueError('in str')\nraise E\n",
    "raise Exception('two\\nlines\\x00\\u2028\\x1b[31m')\n",
    "raise MemoryError\n",
    "x = [1] * 10**18\n",
    "assert False\n",
    "raise StopIteration\n",
    "yield 3\n",
    "\x00",
    "def law(model):\n",
    "law = 3\n",
    "law = None\n",
    "law = len\n",
    "del law\n",
)

# What the law is.
_BODIES = (
    "return None",
    "return 3",
    "return model",
    "return pid",
    "return pid(model, frequency=-1)",
    "return pid(model, frequency=float('nan'))",
    "return pid(model, frequency=1e308)",
    "return law(model)",
    "raise SystemExit(2)",
    "raise ValueError('no')",
    "yield pid(model)",
    "return (pid(model), 3)",
    "return [pid(model)]",
    "return jnp.zeros(3)",
    "import sys; sys.exit()",
    "return type('X', (), {})()",
    "return law",
    "return Mine(model)",
    "return globals()",
    "return open(__file__)",
)

# A law of one's own, with a command that is wrong.
_COMMANDS = (
    "return jnp.full(1, jnp.nan), {}",
    "return jnp.zeros(7), {}",
    "return jnp.zeros(1)",
    "return 3",
    "return None",
    "return 'a', {}",
    "return jnp.zeros(1), {'x': 3}",
    "return jnp.zeros(1), {'estimate': jnp.zeros(4)}",
    "return self.command(z, y, r)",
    "raise SystemExit(1)",
    "return jnp.zeros(1) if y.position[0] > 0 else jnp.ones(1), {}",
    "return y.positon, {}",
    "self.x = 3\n        return jnp.zeros(1), {}",
    "import numpy as np\n        return np.asarray(y.position), {}",
    "return jnp.zeros((1, 1)), {}",
    "return jnp.zeros(1, dtype=int), {}",
    "return 1j * jnp.ones(1), {}",
)

_OWN = """\
import jax.numpy as jnp

from undertow.core.contracts import AbstractController


class Mine(AbstractController):
    model: object

    def init(self, y, r):
        {init}

    def signals(self):
        return {signals}

    def command(self, z, y, r):
        {command}

    def advance(self, z, y, r, applied, dt):
        {advance}


def law(model, frequency=1.0):
    return Mine(model)
"""


def plug_in(chance: random.Random) -> str:
    """A Python file that is wrong."""
    sample = chance.random()
    if sample < 0.2:
        return spoilt_text(PLUG_IN, chance)
    if sample < 0.4:
        return chance.choice((PLUG_IN + "\n" + chance.choice(_AT_IMPORT), chance.choice(_AT_IMPORT) + PLUG_IN))
    if sample < 0.6:
        return PLUG_IN.replace("return pid(model, frequency=frequency)", chance.choice(_BODIES))
    if sample < 0.65:
        return PLUG_IN.replace(
            "(model, frequency=1.0)", chance.choice(("()", "(x)", "(*a, **b)", "(model, /)", "(a, b)"))
        )
    zero, unchanged = "return jnp.zeros(1)", "return z"
    init = chance.choice((zero, zero, "return None", "return {'a': 3}", "raise ValueError('no')", "return jnp.nan"))
    advance = chance.choice(
        (unchanged, unchanged, "return None", "return jnp.zeros(9)", "return (z, z)", "return z / 0", "return 'a'")
    )
    signals = chance.choice(("{}", "{}", "{}", "None", "3", "{'x': 3}", "{'position': None}"))
    return _OWN.format(init=init, signals=signals, command=chance.choice(_COMMANDS), advance=advance)
