"""Introduction, assumptions and open points of the paper, for the report."""

from undertow.report.mathml import mathml
from undertow.report.page import Html, join, tag

DOI = "10.1007/s11071-017-3590-2"

INTRODUCTION = join(
    Html(
        "This page reproduces the paper by Ghavidel and Kalat, <i>Robust control for MIMO hybrid dynamical system of "
        "underwater vehicles by composite adaptive fuzzy estimation of uncertainties</i>, Nonlinear Dynamics, 2017, "
        "DOI "
    ),
    DOI,
    Html(
        ". It recomputes every figure and table of its results and checks each of its claims. <b>RCAFC</b> is the "
        "robust composite adaptive fuzzy controller that the paper proposes. <b>RAFC</b> is the robust adaptive fuzzy "
        "controller, which is the same law with the composite gain "
    ),
    mathml(r"\gamma_\varepsilon = 0"),
    Html(
        ". The paper gives no numerical results, so its curves can be compared in shape only, and its claims in "
        "meaning."
    ),
)

ASSUMED = (
    Html(
        "<b>Vehicle.</b> The paper gives no parameters. This reproduction uses ODIN with eight equal thrusters, with "
        "parameters from the literature."
    ),
    Html(
        "<b>Disturbance.</b> The paper shows curves, but no formulas. This reproduction uses suite U1: a swell with "
        "steps, two sinusoids at 2 and 20 rad/s, a square wave, a pulse, a ramp with reset and a chirp up to 10 rad/s, "
        "one per axis, rms 3.2 m/s<sup>2</sup> and rad/s<sup>2</sup>."
    ),
    Html(
        "<b>Fuzzy sets.</b> Centres and widths are blank in print, and their number is three in the text and five "
        "in the formula. This reproduction uses five Gaussian sets, &minus;1 to 1 in steps of 0.5, width 0.5."
    ),
    Html(
        "<b>Time.</b> The paper gives no time step and no duration. Here, controller and vehicle are one differential "
        "equation over 20 s, starting at rest at zero. <i>Steady</i> means 10 s to 20 s."
    ),
    join(
        Html("<b>Thruster model.</b> Example 1 (speed sensor): a perfect sensor cancels "),
        mathml(r"\phi"),
        ", which leaves ",
        mathml(r"T = \alpha V"),
        ". Example 2 (sensorless): the motor is in its steady state at every instant. The motor as a dynamic system is "
        "the subject of the section on ",
        tag("a", "fidelity levels", href="#fidelity"),
        ".",
    ),
    join(
        Html("<b>Misprint in Eq. (13).</b> The printed "),
        mathml("k_2"),
        " contains ",
        mathml("k_e"),
        " twice. Eqs. (8) and (9) give ",
        mathml(r"k_2 = k_e + \frac{R k_f}{k_t} = 0.0676"),
        " V s/rad, which is used here.",
    ),
    join(
        Html("<b>Content of the uncertainty.</b> In the two examples the prescribed "),
        mathml("d(t)"),
        " includes the kinematic term ",
        mathml(r"\dot J \nu"),
        Html(
            ", as in Remark 2 of the paper, although it could be computed. On fidelity levels <i>shaft</i> and "
            "<i>electromechanical</i> the body moves freely, and "
        ),
        mathml("d(t)"),
        " is added. In both cases the uncertainty is measured from the run.",
    ),
)

# Location in the paper, what is wrong or missing, treatment here.
LEFT_OPEN = (
    (
        "Eqs. (4), (5), (17)",
        "A transpose is printed instead of an inverse transpose, and the inverse of the derivative of $J$ instead of "
        "the derivative of its inverse (the former does not exist at rest).",
        "Derived again; implemented in the form in which $J$ cancels.",
    ),
    (
        "Eq. (13)",
        "$k_2$ is printed with $k_e$ twice, which gives a third of its value.",
        "$k_e + \\frac{R k_f}{k_t}$, from Eqs. (8) and (9).",
    ),
    (
        "after Eq. (9), Table 3",
        "$k_t$ is called a friction constant; $k_f$ has the unit N s.",
        "$k_t$ is the torque constant; $k_f$ has the unit N m s/rad.",
    ),
    (
        "Table 3",
        "$k_t$ is 117 times $k_e$; in SI units both are equal for a DC motor. The shaft would deliver several times "
        "the electrical power.",
        "Used as printed on this page; undertow warns about it.",
    ),
    ("Eq. (34)", "The approximation error $\\omega$ is counted twice.", "Counted once."),
    ("Eqs. (36), (37)", "Two letters for the number of rules, two for the index of the input.", "One letter for each."),
    (
        "Eqs. (38)-(41)",
        "The optimal weights are defined for a $d$ that is a function of $\\varepsilon$, but $d$ is a function of "
        "time. Their error is then half the range of $d$, which is not small.",
        "The error is measured, not assumed.",
    ),
    (
        "Eqs. (46), (58)",
        "The Lyapunov function and its derivative share one symbol; a term is dropped.",
        "Two symbols; all terms are kept.",
    ),
    ("Eqs. (59), (60)", "The bound is 'less than infinity', which is no bound.", "$2 V(0)$."),
    (
        "Theorem, Sec. 5.1",
        "Proved with `sign`: the error goes to zero. Simulated with `tanh`: the error stays small but not zero. "
        "The value $\\bar\\omega = 0.1$ of Table 1 is far below what the theorem requires.",
        "Simulated with `tanh` as in Remark 5; see C1 and C12.",
    ),
    (
        "Eq. (24), N < 6",
        "$G G^+$ has rank $N$ and has no inverse with fewer than six independent thrusters.",
        "Regularised as in Eq. (27); the rank is reported; see C9.",
    ),
    (
        "Table 1, Eq. (49)",
        "Symbols of an earlier version remain ($\\alpha_F$, $\\varepsilon_F$, $k_i$).",
        "One $\\alpha$, one $\\varepsilon$.",
    ),
    (
        "Sec. 5",
        "No vehicle matrices, no initial weights, no integrator, no time step, no disturbance formulas.",
        "Chosen as listed at the top of this page; weights and identification model start at zero.",
    ),
    ("Sec. 5", "The yaw error is a plain difference of angles.", "The difference is taken the short way round."),
    ("Table 2", "The table has adjectives, but no numbers.", "Numbers are given above."),
)
