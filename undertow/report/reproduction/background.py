"""What the reader must know before the first number: assumptions, and what the paper leaves open."""

from undertow.report.page import Html

INTRODUCTION = Html(
    "The paper: <i>Robust control for MIMO hybrid dynamical system of underwater vehicles by composite adaptive fuzzy "
    "estimation of uncertainties</i>. This page reproduces every figure and table of its results and tests each of its "
    "claims. <b>RCAFC</b> is the controller it proposes; <b>RAFC</b> is the same law with the composite gain "
    "&gamma;<sub>&epsilon;</sub> = 0. The paper prints no result as a number, so its curves can be compared in shape "
    "and its claims in sense."
)

ASSUMED = (
    Html("<b>Vehicle.</b> The paper gives none. Here: ODIN with eight equal thrusters, numbers from the literature."),
    Html(
        "<b>Disturbance.</b> The paper only shows curves, no formulas. Here: suite U1, a swell with steps, two "
        "sinusoids at 2 and 20 rad/s, a square wave, a pulse, a ramp with reset and a chirp up to 10 rad/s, one per"
        " axis, rms 3.2 m/s<sup>2</sup> and rad/s<sup>2</sup>."
    ),
    Html(
        "<b>Fuzzy sets.</b> Centres and widths are blank in print, and their number is three in the text and five "
        "in the formula. Here: five Gaussians, &minus;1 to 1 in steps of 0.5, width 0.5."
    ),
    Html(
        "<b>Time.</b> The paper gives no time step and no duration. Here: law and vehicle are one differential "
        "equation over 20 s, from rest at zero; <i>steady</i> means 10 s to 20 s."
    ),
    Html(
        "<b>Thruster truth.</b> Example 1 (speed sensor): what is left once a perfect sensor has cancelled &phi;, T"
        " = &alpha;V. Example 2 (sensorless): the motor in its steady state at every instant. The motor as a "
        "dynamic system is the <a href='#fidelity'>fidelity comparison</a>."
    ),
    Html(
        "<b>Misprint in Eq. (13).</b> k<sub>2</sub> uses k<sub>e</sub> twice; Eqs. (8) and (9) give k<sub>2</sub> ="
        " k<sub>e</sub> + R k<sub>f</sub>/k<sub>t</sub> = 0.0676 V s/rad, and that is used."
    ),
    Html(
        "<b>What d contains.</b> In the two examples the prescribed d(t) includes the kinematic term J&#775;&nu;, "
        "as the paper's Remark 2 has it, although it could be computed. On the two upper fidelities the "
        "body moves as it is, and d(t) is added. Either way d is measured from the run."
    ),
)

# Where in the paper, what is wrong or missing, what is done here.
LEFT_OPEN = (
    (
        "Eqs. (4), (5), (17)",
        "A transpose stands where an inverse transpose belongs, and the inverse of J's derivative where the "
        "derivative of its inverse is meant (the former does not exist at rest).",
        "Derived anew; coded in the form in which J cancels.",
    ),
    (
        "Eq. (13)",
        "k_2 is printed with k_e twice: a third of its value.",
        "k_e + R k_f / k_t, from Eqs. (8) and (9).",
    ),
    (
        "after Eq. (9), Table 3",
        "k_t is called a friction constant; k_f has the unit N s.",
        "Torque constant; N m s/rad.",
    ),
    (
        "Table 3",
        "k_t is 117 times k_e; in SI units a DC motor has both equal. The shaft would give several times the power "
        "that the supply puts in.",
        "Used as printed for this page; undertow warns about it.",
    ),
    (
        "Eq. (34)",
        "The approximation error omega is counted twice.",
        "Counted once.",
    ),
    (
        "Eqs. (36), (37)",
        "Two letters for the number of rules, two for the index of the input.",
        "One of each.",
    ),
    (
        "Eqs. (38)-(41)",
        "The optimal weights are defined for a d that is a function of eps, but d is a function of time. Their "
        "error is then half the range of d, not small.",
        "The error is measured, nothing is assumed.",
    ),
    (
        "Eqs. (46), (58)",
        "The Lyapunov function and its derivative share one symbol; a term is dropped.",
        "Kept apart; all terms kept.",
    ),
    (
        "Eqs. (59), (60)",
        "The bound is 'less than infinity', which says nothing.",
        "2 V(0).",
    ),
    (
        "Theorem, Sec. 5.1",
        "Proved with `sign`: the error goes to zero. Simulated with `tanh`: the error stays small but not zero. "
        "Table 1's omega_bar = 0.1 is far below what the theorem asks for.",
        "Simulated with `tanh` as in Remark 5; see C1 and C12.",
    ),
    (
        "Eq. (24), N < 6",
        "G G+ has rank N and never has an inverse when there are fewer than six independent thrusters.",
        "Regularised as in Eq. (27); the rank is reported; see C9.",
    ),
    (
        "Table 1, Eq. (49)",
        "Symbols of an earlier version are left over (alpha_F, eps_F, k_i).",
        "One alpha, one eps.",
    ),
    (
        "Sec. 5",
        "No vehicle matrices, no initial weights, no integrator, no time step, no disturbance formulas.",
        "Fixed as listed on top of this page; weights and model start at zero.",
    ),
    (
        "Sec. 5",
        "The yaw error is a plain difference of angles.",
        "The short way round.",
    ),
    (
        "Table 2",
        "Adjectives, no numbers.",
        "Numbers, see above.",
    ),
)
