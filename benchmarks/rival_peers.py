"""Closed loops of other people's controllers: prints tests/peers/data/rival_laws.json.

In an environment of its own, without undertow:

    pip install numpy scipy matplotlib pyadrc==0.6.1 casadi==3.8.2
    python benchmarks/rival_peers.py PATH_OF_PythonVehicleSimulator/src > tests/peers/data/rival_laws.json

The tests in tests/peers/ run the laws of undertow on the same plants.
"""

import json
import sys

import casadi
import numpy as np
import pyadrc
from scipy.linalg import expm, solve_discrete_are


def held(a, b, dt):
    """Transition matrix and input vector of x_dot = A x + b u, sampled with the input held."""
    both = expm(np.block([[np.asarray(a), np.asarray(b)[:, None]], [np.zeros((1, len(b) + 1))]]) * dt)
    return both[:-1, :-1], both[:-1, -1]


def loop(controller, a, b, start, dt, steps, load=0.0):
    """Positions at the sampling instants; `controller(x)` gives the input, the load adds to it."""
    transition, entry = held(a, b, dt)
    x, positions, inputs = np.array(start, dtype=float), [], []
    for _ in range(steps + 1):
        positions.append(x[0])
        inputs.append(controller(x))
        x = transition @ x + entry * (inputs[-1] + load)
    return np.array(positions), np.array(inputs)


def adrc():
    """Step responses of the plants of second order K / (T^2 p^2 + 2 D T p + 1) around the nominal one."""
    dt, settling, plants = 0.01, 5.0, {}
    for gain, damping, time in ((1, 1, 1), (2, 1, 1), (0.5, 1, 1), (1, 0.2, 1), (1, 2, 1), (1, 1, 0.7), (1, 1, 1.4)):
        law, last = pyadrc.StateSpace(2, dt, 1.0, 6 / settling, 10), [0.0]

        def controller(x, law=law, last=last):
            last[0] = law(x[0], last[0], 1.0)
            return last[0]

        a = [[0.0, 1.0], [-1 / time**2, -2 * damping / time]]
        positions, inputs = loop(controller, a, [0.0, gain / time**2], [0.0, 0.0], dt, 1500)
        outside = np.flatnonzero(abs(positions - 1) > 0.02)
        plants[f"K={gain},D={damping},T={time}"] = {
            "settling_time": dt * (outside[-1] + 1),
            "overshoot": max(positions.max() - 1, 0.0),
            "integral_of_error": dt * abs(1 - positions).sum(),
            "largest_input": abs(inputs).max(),
        }
    return {"dt": dt, "settling_time": settling, "observer_ratio": 10, "plants": plants}


def vehicle_simulator(path):
    """Heading of the Otter by PID pole placement, and of the REMUS 100 by integral sliding mode, at a set point."""
    sys.path.insert(0, path)
    from python_vehicle_simulator.lib.control import PIDpolePlacement, integralSMC
    from python_vehicle_simulator.vehicles.otter import otter
    from python_vehicle_simulator.vehicles.remus100 import remus100

    dt, boat, torpedo = 0.02, otter(), remus100()
    inertia = float(boat.M[5, 5])  # its damping is that of a time constant of 1 s

    def pid(start, load):
        integral = [0.0]

        def controller(x):
            u, integral[0], *_ = PIDpolePlacement(
                integral[0], x[0], x[1], 0.0, 0.0, 0.0, inertia, inertia, 0.0,
                boat.wn_d, boat.zeta_d, boat.wn, boat.zeta, 0.0, 1.0, dt,
            )  # fmt: skip
            return u

        positions, _ = loop(controller, [[0.0, 1.0], [0.0, -1.0]], [0.0, 1 / inertia], [start, 0.0], dt, 1000, load)
        return {"start": start, "load": load} | figures(positions, dt)

    def sliding_mode(start, load):
        integral, gain = [0.0], torpedo.K_nomoto / torpedo.T_nomoto

        def controller(x):
            u, integral[0], *_ = integralSMC(
                integral[0], x[0], x[1], 0.0, 0.0, 0.0, torpedo.T_nomoto, torpedo.K_nomoto, torpedo.wn_d,
                torpedo.zeta_d, torpedo.K_d, torpedo.K_sigma, torpedo.lam, torpedo.phi_b, 0.0, torpedo.r_max, dt,
            )  # fmt: skip
            return u

        a = [[0.0, 1.0], [0.0, -1 / torpedo.T_nomoto]]
        positions, _ = loop(controller, a, [0.0, gain], [start, 0.0], dt, 3000, load / gain)
        return {"start": start, "load": load} | figures(positions, dt)

    names = ("K_nomoto", "T_nomoto", "K_d", "K_sigma", "lam", "phi_b")
    return {
        "pid": {
            "dt": dt,
            "inertia": inertia,
            "wn": boat.wn,
            "zeta": boat.zeta,
            "runs": [pid(0.5, 0.0), pid(0.0, 10.0)],
        },
        "integral_sliding_mode": {"dt": dt, "runs": [sliding_mode(0.0, 0.02)]}
        | {n: getattr(torpedo, n) for n in names},
    }


def figures(positions, dt):
    """Extremes and the integral of the size."""
    return {
        "least": positions.min(),
        "most": positions.max(),
        "integral_of_error": dt * abs(positions).sum(),
        "last": positions[-1],
    }


def arm_acceleration(q, v, force, m):
    """Two-link arm of Slotine and Li (1991), Example 9.1, vertical, with the functions of `m`."""
    a1, a2, a3, a4, moment, g = 3.34, 0.97, 1.2 * np.cos(np.pi / 6), 1.2 * np.sin(np.pi / 6), 2.5, 9.81
    coupling, h = a3 * m.cos(q[1]) + a4 * m.sin(q[1]), a3 * m.sin(q[1]) - a4 * m.cos(q[1])
    outer = g * (a3 * m.cos(q[0] + q[1]) + a4 * m.sin(q[0] + q[1]))
    first = force[0] + h * (2 * v[0] + v[1]) * v[1] - g * moment * m.cos(q[0]) - outer
    second = force[1] - h * v[0] ** 2 - outer
    inner, off = a1 + 2 * coupling, a2 + coupling
    det = inner * a2 - off**2
    return [(a2 * first - off * second) / det, (inner * second - off * first) / det]


def predictive(limit, w=4.0, h=0.1, steps=10, dt=0.02, duration=4.0):
    """The optimal control problem of `nmpc`, solved to the end by IPOPT at every sampling time."""
    goal, x = np.array([0.0, 0.5]), np.array([-np.pi / 2, 0.0, 0.0, 0.0])
    weight = h * np.diag([w**4, 2 * w**2])
    end = solve_discrete_are(np.array([[1.0, h], [0.0, 1.0]]), np.array([[h**2 / 2], [h]]), weight, h * np.eye(1))
    forces, start = casadi.SX.sym("f", 2, steps), casadi.SX.sym("s", 4)
    e, rate, cost = [start[0], start[1]], [start[2], start[3]], 0
    for k in range(steps):
        given = arm_acceleration([goal[i] - e[i] for i in (0, 1)], [-one for one in rate], forces[:, k], casadi)
        for i in (0, 1):
            cost += h / 2 * (w**4 * e[i] ** 2 + 2 * w**2 * rate[i] ** 2 + given[i] ** 2)
        e = [e[i] + h * rate[i] - h**2 / 2 * given[i] for i in (0, 1)]
        rate = [rate[i] - h * given[i] for i in (0, 1)]
    for i in (0, 1):
        cost += (end[0, 0] * e[i] ** 2 + 2 * end[0, 1] * e[i] * rate[i] + end[1, 1] * rate[i] ** 2) / 2
    quiet = {"ipopt.print_level": 0, "print_time": 0, "ipopt.sb": "yes", "ipopt.tol": 1e-10}
    solve = casadi.nlpsol("solve", "ipopt", {"x": casadi.vec(forces), "p": start, "f": cost}, quiet)
    plan, total, at_limit, sampled = np.zeros(2 * steps), 0.0, 0, round(duration / dt)
    slope = lambda x, u: np.concatenate([x[2:], arm_acceleration(x[:2], x[2:], u, np)])
    for _ in range(sampled):
        off = np.concatenate([goal - x[:2], -x[2:]])
        plan = np.array(solve(x0=plan, p=off, lbx=-limit, ubx=limit)["x"]).ravel()
        u, given = plan[:2], slope(x, plan[:2])[2:]
        total += dt / 2 * (w**4 * off[:2] ** 2 + 2 * w**2 * off[2:] ** 2 + given**2).sum()
        at_limit += (abs(u) > 0.999 * limit).sum()
        for _ in range(4):
            k1 = slope(x, u)
            k2 = slope(x + dt / 8 * k1, u)
            k3 = slope(x + dt / 8 * k2, u)
            k4 = slope(x + dt / 4 * k3, u)
            x = x + dt / 24 * (k1 + 2 * k2 + 2 * k3 + k4)
    return {"limit": limit, "cost": float(total), "share_at_limit": float(at_limit / sampled / 2)}


def main(path):
    """Prints all of them."""
    source = (
        "printed by benchmarks/rival_peers.py from code run unmodified: pyadrc 0.6.1 (MIT; adrc), "
        "PythonVehicleSimulator@c717e07 (MIT; lib/control.py: pid, integral_sliding_mode) and IPOPT through "
        "CasADi 3.8.2 (nmpc). SI units"
    )
    runs = [predictive(limit) for limit in (40.0, 60.0)]
    found = {"_source": source, "adrc": adrc()} | vehicle_simulator(path) | {"nmpc": {"runs": runs}}
    json.dump(found, sys.stdout, indent=1, default=float)
    print()


if __name__ == "__main__":
    main(sys.argv[1])
