"""A7: size and frequency of the disturbance."""

from functools import partial

from undertow.controllers.presets.paper import paper
from undertow.disturbances.random_suite import random_suite
from undertow.reproduction.ablations.ablation import Answer, Variant, answer
from undertow.reproduction.ablations.on_axes import loop

QUESTION = "Which sizes and frequencies of disturbance does it cope with?"
PREDICTION = "Below 50 rad/s the estimate helps, above 103 rad/s it adds error, whatever the size."
LONG = True
METRICS = ("share", "tracking_rms")
LEFT_OUT = "chirps (Fig. 7 has one)"

_FREQUENCIES = (1.0, 10.0, 50.0, 150.0)  # rad/s
_SIZES = (0.1, 50.0)  # m/s^2 at 5 rad/s


def variants(quick: bool) -> tuple[Variant, ...]:
    """Sinusoids of one frequency and random phase; steps; RCAFC beside a law that does not estimate."""
    pure = lambda size, rate: random_suite(size, rate, rate, step=0.0)
    loads = {f"{rate:g} rad/s": ("0.5 m/s^2 rms", pure(0.5, rate)) for rate in _FREQUENCIES}
    loads |= {f"{size:g} m/s^2": ("at 5 rad/s", pure(size, 5.0)) for size in _SIZES}
    loads["steps"] = ("5 m/s^2 every 0.5 s", random_suite(0.0, step=5.0, hold=0.5))
    with_it = [Variant(name, text, loop(paper, load)) for name, (text, load) in loads.items()]
    blind = partial(paper, adaptation=0.0)
    without = [
        Variant(f"{rate:g} rad/s, no estimate", "adaptation: 0", loop(blind, pure(0.5, rate))) for rate in _FREQUENCIES
    ]
    return (*with_it, *without)


def judge(found) -> Answer:
    """Share of d that the estimate misses."""
    share = {rate: found[f"{rate:g} rad/s"]["share"] for rate in _FREQUENCIES}
    text = "The estimate misses " + ", ".join(f"{100 * share[rate]:.3g} % at {rate:g} rad/s" for rate in _FREQUENCIES)
    small, large = (found[f"{size:g} m/s^2"]["share"] for size in _SIZES)
    text += f"; {100 * small:.2g} % of {_SIZES[0]:g} m/s^2 and {100 * large:.2g} % of {_SIZES[1]:g} m/s^2 at 5 rad/s."
    return answer(share[50.0] < 1 < share[150.0] and abs(large / small - 1) < 0.2, text, partly=share[150.0] > 1)
