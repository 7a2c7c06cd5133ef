"""Simulated bench records of thrusters whose numbers are known."""

import jax.numpy as jnp
import numpy as np

from undertow.core.runtime import in_precision
from undertow.studies.identification.bench.bench_response import (
    BenchResponse,
    held_command,
    response_over_time,
    settled_response,
)
from undertow.studies.identification.bench.bench_table import BenchTable

SUPPLY = 16.0  # V


def power_curve(volts, gain=1.0, power=1.45, dead_zone=0.7, reverse=0.78):
    """T = c (|V| - d)^p, N, times a share in reverse: the closed form of `first_order`."""
    beyond = np.maximum(np.abs(volts) - dead_zone, 0.0)
    return np.where(volts < 0, reverse, 1.0) * gain * np.sign(volts) * beyond**power


def settled_table(volts, thrust, current=None, speed=None):
    """A record of settled rows; current is that of the supply."""
    empty = np.full(len(volts), np.nan)
    current, speed = (empty if values is None else values for values in (current, speed))
    supply = np.full(len(volts), SUPPLY)
    return BenchTable("bench.csv", volts, np.abs(volts) / SUPPLY, thrust, current, speed, supply)


def settled_bench(thruster, volts):
    """What a bench measures of a thruster without noise."""
    with in_precision("float64"):
        response = BenchResponse(*map(np.asarray, settled_response(thruster, jnp.asarray(volts))))
    return settled_table(volts, response.thrust, response.current * np.abs(volts) / SUPPLY, response.speed)


def step_bench(thruster, seed, delay=0.04, noise=0.3, duration=20.0, rate=50.0):
    """Steps of random height, each for a second, at uneven times, from rest."""
    generator = np.random.default_rng(seed)
    rows = round(duration * rate)
    time = np.arange(rows) / rate + generator.uniform(-0.2, 0.2, rows) / rate
    time -= time[0]
    heights = generator.uniform(-SUPPLY, SUPPLY, round(duration))
    heights[0] = 0.0
    volts = np.repeat(heights, round(rate))
    with in_precision("float64"):
        command = held_command(volts, time)
        response = response_over_time(thruster, thruster.initial_state(1), command, delay)
        thrust, current, speed = map(np.asarray, response)
    measured = thrust + noise * generator.standard_normal(rows)
    table = settled_table(volts, measured, current * np.abs(volts) / SUPPLY, speed)
    return table._replace(time=time)
