"""Examples 1 and 2 against an independent plain-NumPy solution, and against the published reference figures."""

import numpy as np
import pytest

from undertow.bench import plain_numpy
from undertow.reproduction.all_outputs import with_all_outputs
from undertow.reproduction.setup import CONTROLLERS, scenario
from undertow.scenario.execute import execute

# Benchmark definitions, section 4: tracking, estimation, uncertainty and robust rms on fidelity `ideal`, suite U1.
REFERENCE = {
    "rcafc": {"tracking_rms": 1.6e-4, "estimation_rms": 0.201, "uncertainty_rms": 3.224, "robust_rms": 0.144},
    "rafc": {"tracking_rms": 7.22e-3, "estimation_rms": 1.607, "uncertainty_rms": 3.224, "robust_rms": 1.579},
}


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_example_1_gives_the_reference_figures(controller):
    run = execute(scenario("", composite=CONTROLLERS[controller]))
    for metric, expected in REFERENCE[controller].items():
        np.testing.assert_allclose(with_all_outputs(run.steady)[metric], expected, rtol=0.02)


def check(run, solution):
    for metric, series in zip(("tracking_rms", "estimation_rms", "robust_rms"), solution, strict=True):
        np.testing.assert_allclose(run[metric], np.sqrt((series**2).mean()), rtol=0.02)


# From 10 s to 12 s with steps of 2 ms, because plain NumPy takes its time. By default a second of the full motor model is
# compared with it, in studies/test_speed.
@pytest.mark.slow
@pytest.mark.parametrize("controller", CONTROLLERS)
def test_example_2_agrees_with_plain_numpy(controller):
    loop = {"kind": "continuous", "duration": 12.0}
    window = {"start": 10.0, "stop": 12.0}
    run = execute(scenario("", fidelity="static", composite=CONTROLLERS[controller], loop=loop, steady=window))
    check(
        with_all_outputs(run.steady),
        plain_numpy.paper_example("static", CONTROLLERS[controller], duration=12.0, h=2e-3, every=5),
    )


@pytest.mark.slow
@pytest.mark.parametrize("fidelity", ["ideal", "static"])
@pytest.mark.parametrize("controller", CONTROLLERS)
def test_examples_agree_with_plain_numpy_throughout(fidelity, controller):
    run = execute(scenario("", fidelity=fidelity, composite=CONTROLLERS[controller]))
    check(with_all_outputs(run.steady), plain_numpy.paper_example(fidelity, CONTROLLERS[controller]))
