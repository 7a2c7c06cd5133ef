"""The closed loop as a user would write it in plain NumPy: no classes, Euler angles, matrices, RK4 at 1 ms.

It is the reference for speed (workload W1) and, in the tests, for numbers: it shares no code with undertow.
Vehicle ODIN (Antonelli 2006), motor of the paper's Table 3, gains of Table 1, suite U1.
"""

import numpy as np

S = np.sqrt(0.5)
B = np.array(
    [
        [S, -S, -S, S, 0, 0, 0, 0],
        [S, S, -S, -S, 0, 0, 0, 0],
        [0, 0, 0, 0, -1, -1, -1, -1],
        [0, 0, 0, 0, 0.381 * S, 0.381 * S, -0.381 * S, -0.381 * S],
        [0, 0, 0, 0, 0.381 * S, -0.381 * S, -0.381 * S, 0.381 * S],
        [0.508, -0.508, 0.508, -0.508, 0, 0, 0, 0],
    ]
)
M = np.diag([187.5, 187.5, 187.5, 8.0, 8.0, 8.0])
M[0, 4] = M[4, 0] = 6.25
M[1, 3] = M[3, 1] = -6.25
M_INV, B_PINV = np.linalg.inv(M), np.linalg.pinv(B)
LINEAR, QUADRATIC = np.array([0, 0, 0, 30.0, 30.0, 30.0]), np.array([48.0, 48.0, 48.0, 80.0, 80.0, 80.0])
W, BUOYANCY, Z_G = 1226.0, 1224.2, 0.05
R, L, KT, KE, KF, J_ROTOR, CT, CQ = 1.2, 0.01, 1.27, 0.01086, 0.06, 0.01, 0.0375, 0.00232
K3 = R / KT
ALPHA = CT / (K3 * CQ)
GOAL = np.array([2, 3, 4, np.pi / 3, np.pi / 4, 2 * np.pi / 5])
CENTRES, WIDTH = np.linspace(-1, 1, 5), 0.5


def suite_u1(t):
    """Benchmark suite U1."""
    step = lambda at: 1.0 if t >= at else 0.0
    return np.array(
        [
            4 * np.sin(t) + 6 * step(8) - 9 * step(14),
            3 * np.sin(2 * t) + 2 * np.sin(20 * t),
            -3 + 2 * np.sin(0.5 * t) + 3 * (1 if np.sin(np.pi * t / 2) >= 0 else -1),
            2 * np.sin(3 * t) + 4 * step(6) - 4 * step(10),
            4 * (t / 10 - np.floor(t / 10)),
            2 * np.sin(t * t / 4),
        ]
    )


def jacobian(eta):
    """J of Eq. (1)."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(eta[3:]), np.cos(eta[3:])
    j = np.zeros((6, 6))
    j[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    j[3:, 3:] = [[1, sr * sp / cp, cr * sp / cp], [0, cr, -sr], [0, sr / cp, cr / cp]]
    return j


def body_forces(eta, nu):
    """C nu + D nu + g."""
    momentum = M @ nu
    coriolis = np.concatenate(
        [np.cross(nu[3:], momentum[:3]), np.cross(nu[:3], momentum[:3]) + np.cross(nu[3:], momentum[3:])]
    )
    down = np.array([-np.sin(eta[4]), np.cos(eta[4]) * np.sin(eta[3]), np.cos(eta[4]) * np.cos(eta[3])])
    g = -np.concatenate([(W - BUOYANCY) * down, np.cross([0, 0, Z_G], W * down)])
    return coriolis + LINEAR * nu + QUADRATIC * np.abs(nu) * nu + g


def law(eta, eta_dot, v_hat, theta, composite):
    """Voltage of Eq. (23) and the rates of Eqs. (32), (44); also e, d_hat, u_r and F + G V."""
    e = GOAL - eta
    s = 5 * (e - eta_dot)
    u_r, eps = 10 * np.tanh(s / 0.5), v_hat - eta_dot
    xi = np.exp(-(((eps[:, None] - CENTRES) / WIDTH) ** 2))
    xi /= xi.sum(1, keepdims=True)
    d_hat = (theta * xi).sum(1)
    j = jacobian(eta)
    f = -j @ M_INV @ body_forces(eta, np.linalg.solve(j, eta_dot))
    acceleration = -f - d_hat + e - 2 * eta_dot + u_r
    voltage = B_PINV @ M @ np.linalg.solve(j, acceleration) / ALPHA
    modelled = f + j @ M_INV @ B @ (ALPHA * voltage)
    v_hat_dot = -150 * eps + modelled + d_hat - 0.1 * np.tanh(eps / 0.5)
    return voltage, v_hat_dot, -100 * (s + composite * eps)[:, None] * xi, (e, d_hat, u_r, modelled)


def rk4(rate, t, y, h):
    """One step on a tuple of arrays."""
    move = lambda k, a: tuple(p + a * q for p, q in zip(y, k, strict=True))
    k1 = rate(t, y)
    k2 = rate(t + h / 2, move(k1, h / 2))
    k3 = rate(t + h / 2, move(k2, h / 2))
    k4 = rate(t + h, move(k3, h))
    return tuple(p + h / 6 * (a + 2 * b + 2 * c + d) for p, a, b, c, d in zip(y, k1, k2, k3, k4, strict=True))


def workload_w1(steps=20_000, h=1e-3, composite=20.0, bound=20.0):
    """Benchmark workload W1: full motor model, input held at 1 kHz; mean square of e over the second half."""

    def rate(t, y, voltage):
        eta, nu, speed, current = y
        j = jacobian(eta)
        thrust, torque = CT * speed * np.abs(speed), CQ * speed * np.abs(speed)
        nu_dot = M_INV @ (B @ thrust - body_forces(eta, nu)) + np.linalg.solve(j, suite_u1(t))
        speed_dot = (KT * current - KF * speed - torque) / J_ROTOR
        return j @ nu, nu_dot, speed_dot, (voltage - R * current - KE * speed) / L

    y, v_hat, theta, total = (np.zeros(6), np.zeros(6), np.zeros(8), np.zeros(8)), np.zeros(6), np.zeros((6, 5)), 0.0
    for k in range(steps):
        voltage, v_hat_dot, theta_dot, (e, *_) = law(y[0], jacobian(y[0]) @ y[1], v_hat, theta, composite)
        total += (e**2).mean() if k >= steps // 2 else 0.0
        y = rk4(lambda t, y, voltage=voltage: rate(t, y, voltage), k * h, y, h)
        v_hat, theta = v_hat + h * v_hat_dot, np.clip(theta + h * theta_dot, -bound, bound)
    return total / (steps - steps // 2)
