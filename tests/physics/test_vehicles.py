"""Every published vehicle in every variant: what a body must satisfy, and the numbers of its data sheet."""

import dataclasses
import importlib

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from recorded import is_as_recorded
from textbook import coriolis_matrix, rotation_from_euler

from undertow.core import catalogue
from undertow.core.errors import BadInput
from undertow.core.param import parameters
from undertow.physics import vehicles
from undertow.physics.vehicles.thruster_labels import number_of
from undertow.physics.vehicles.vehicle import VehicleModel

# Mass (kg), smallest and largest eigenvalue of M, (B - W) / W (%), righting moment (N m/rad), smallest eigenvalue of
# the symmetric part of D at unit speed; to the digits given. From the printed numbers, by other code than undertow's.
SHEET = {
    ("odin", None): "125 7.78 188 -0.15 61.3 48.0",
    ("bluerov2_heavy", "vonbenzon2022"): "13.5 0.365 32.2 -0.74 1.32 1.19",
    ("bluerov2_heavy", "wu2018"): "11.5 0.28 26.1 1.77 2.26 1.62",
    ("bluerov2_heavy", "ng2024"): "11.5 0.963 46.1 5.92 2.26 2.08",
    ("bluerov2_heavy", "gazebo_box_drag"): "13.0 0.2300 13.002 0.77 6.31 4.00",
    ("bluerov2_heavy", "px4"): "13.4 0.2555 17.14 0.75 2.764 0.25",
    ("bluerov2", "hkpolyu"): "11.26 0.30 16.7 0.60 2.21 6.55",
    ("bluerov2", "einarsson_lipenitis2020"): "11.4 0.2623 29.9 3.50 11.59 0.315",
    ("bluerov2", "li2020"): "11.5 0.28 26.07 1.77 2.26 1.62",
    ("bluerov2", "gazebo_box_drag"): "10.0 0.0990 10.001 0.50 4.83 3.99",
    ("bluerov2", "centrale_nantes"): "15.22 5.371 29.79 3.03 12.59 43.74",
    ("rexrov", "berg2012"): "1862.9 906 5565 1.44 5561 628",
    ("rexrov", "uuvsim_nominal"): "1862.9 883.4 5362.9 1.44 5561 600",
    ("npsauv2", "fossen_mss"): "5443 4155 50310 0.00 3257 55.4",
    ("npsauv2", "antonelli_simurv"): "5454.5 4102 49412 0.00 3257 54.1",
    ("remus100", "prestero2001"): "30.5 0.242 66.05 3.0 5.86 0.13",
    ("remus100", "fossen_mss"): "31.9 0.1588 62.2 0.0 6.26 0.61",
    ("remus100", "fossen_python"): "31.03 0.1516 60.5 0.0 6.09 0.59",
    ("lauv", None): "18.0 0.056 34.0 0.24 1.77 0.30",
}
SINGULAR_VALUES = {
    ("odin", None): "2.00 1.41 1.41 1.02 0.539 0.539",
    ("bluerov2_heavy", "vonbenzon2022"): "2.00 1.42 1.42 0.434 0.378 0.239",
    ("bluerov2_heavy", "wu2018"): "2.00 1.42 1.42 0.434 0.378 0.239",
    ("bluerov2_heavy", "ardusub_gazebo"): "2.00 1.41 1.41 0.430 0.335 0.236",
    ("bluerov2", "hkpolyu"): "1.418 1.418 1.414 0.3415 0.156",
    ("bluerov2", "ignition"): "1.414 1.414 1.414 0.3352 0.154",
    ("rexrov", None): "2.00 1.93 1.56 1.33 1.31 0.74",
    ("npsauv2", None): "1.00",
    ("remus100", None): "1.00",
    ("lauv", None): "1.00",
}
NAMES = sorted(catalogue.names("vehicles"))
RNG = np.random.default_rng(3)


def variants(table):
    """(vehicle, variant) for everything that the vehicle's file offers under this name."""
    for name in NAMES:
        module = importlib.import_module(f"undertow.physics.vehicles.{name}")
        yield from ((name, variant) for variant in getattr(module, table, [None]))


def make(name, parameters=None, layout=None):
    options = {"parameters": parameters, "layout": layout}
    return getattr(vehicles, name)(**{key: value for key, value in options.items() if value is not None})


def check_digits(values, texts):
    """Each value rounds to the number printed."""
    for value, text in zip(values, texts.split(), strict=True):
        half = 0.5 * 10.0 ** -len(text.partition(".")[2])
        assert abs(value - float(text)) <= half * (1 + 1e-9), (values, texts)


every_hull = pytest.mark.parametrize("name, variant", list(variants("PARAMETERS")))


def test_numbers_of_every_variant_are_those_that_were_recorded():
    """All of them; the sheets below hold the few that are printed in the sources or follow from others."""
    for name, hull in variants("PARAMETERS"):
        is_as_recorded(f"hull of {name}, {hull}", eqx.filter(make(name, hull), eqx.is_inexact_array))
    for name, layout in variants("LAYOUTS"):
        is_as_recorded(f"thrusters of {name}, {layout}", make(name, layout=layout).thruster_matrix())


def test_every_variant_has_a_sheet():
    assert set(variants("PARAMETERS")) == set(SHEET)
    assert set(variants("LAYOUTS")) == set(SINGULAR_VALUES)


@jax.jit
def righting_moment(body):
    """Slope of the moment by roll, upright, N m/rad."""
    return jax.jacfwd(lambda roll: body.restoring(rotation_from_euler(jnp.zeros(3).at[0].set(roll))[2])[3])(0.0)


@every_hull
def test_data_sheet(name, variant):
    vehicle = make(name, variant)
    eigenvalues = np.linalg.eigvalsh(np.asarray(vehicle.mass_matrix()))
    damping = np.asarray(vehicle.linear_damping + vehicle.quadratic_damping)
    check_digits(
        [
            float(vehicle.mass),
            eigenvalues[0],
            eigenvalues[-1],
            100 * float(vehicle.buoyancy / vehicle.weight - 1),
            float(righting_moment(vehicle.body())),
            np.linalg.eigvalsh((damping + damping.T) / 2)[0],
        ],
        SHEET[name, variant],
    )


@every_hull
def test_inertia_is_that_of_some_body(name, variant):
    """About the centre of gravity no principal moment exceeds the sum of the others; the mass matrix is symmetric."""
    vehicle = make(name, variant)
    r = np.asarray(vehicle.r_g)
    about_cg = np.asarray(vehicle.inertia) - float(vehicle.mass) * (r @ r * np.eye(3) - np.outer(r, r))
    principal = np.linalg.eigvalsh(about_cg)
    assert principal[0] > 0
    assert principal[2] <= principal[0] + principal[1]
    matrix = np.asarray(vehicle.mass_matrix())
    np.testing.assert_array_equal(matrix, matrix.T)


@jax.jit
def smallest_loss(body, nu):
    return jax.vmap(lambda nu: nu @ body.damping(nu))(nu).min()


@pytest.mark.full
@every_hull
def test_damping_takes_energy(name, variant):
    """nu . D(nu) nu at 20 000 velocities of all sizes and proportions, off-diagonal entries included."""
    body = make(name, variant).body()
    nu = jnp.asarray(RNG.normal(size=(20_000, 6)) * 10.0 ** RNG.uniform(-3, 1, size=(20_000, 6)))
    assert float(smallest_loss(body, nu)) > 0


@pytest.mark.parametrize("name, variant", list(variants("LAYOUTS")))
def test_thruster_matrix(name, variant):
    matrix = np.asarray(make(name, layout=variant).thruster_matrix())
    singular_values = np.linalg.svd(matrix, compute_uv=False)
    expected = SINGULAR_VALUES[name, variant]
    rank = len(expected.split())
    check_digits(singular_values[:rank], expected)
    assert (singular_values[rank:] < 1e-9).all()


@every_hull
def test_every_number_has_a_source(name, variant):
    assert all(parameter.source for parameter in parameters(make(name, variant)))


@pytest.mark.parametrize("name", ["bluerov2_heavy", "bluerov2", "rexrov", "npsauv2", "remus100"])
def test_unknown_variant(name):
    with pytest.raises(BadInput, match="be one of"):
        make(name, "wu2081")


def test_surge_drag_of_the_five_heavies():
    """At 0.5 m/s, N; four of them from the data's own list of disagreements."""
    expected = {"wu2018": 6.6, "px4": 10.4, "gazebo_box_drag": 14.6, "ng2024": 27.2, "vonbenzon2022": 42.1}
    for variant, drag in expected.items():
        body = make("bluerov2_heavy", variant).body()
        assert abs(float(body.damping(jnp.zeros(6).at[0].set(0.5))[0]) - drag) <= 0.05


def test_lauv_damping_matrix_is_positive_definite_in_its_symmetric_part():
    vehicle = make("lauv")
    linear = np.asarray(vehicle.linear_damping)
    check_digits(np.linalg.eigvalsh((linear + linear.T) / 2)[:3], "0.3 2.4 8.485")
    assert (linear != linear.T).any()


@pytest.mark.parametrize("variant", ["fossen_mss", "fossen_python"])
def test_remus_moves_as_slowly_as_its_time_constants_say(variant):
    """M / D in surge, sway, heave and yaw; D / (2 sqrt(M K)) in roll and pitch, K the righting moment."""
    vehicle = make("remus100", variant)
    mass, damping = np.diag(vehicle.mass_matrix()), np.diag(vehicle.linear_damping)
    stiffness = float(vehicle.weight * vehicle.r_g[2])
    np.testing.assert_allclose((mass / damping)[[0, 1, 2, 5]], [20, 20, 20, 1], rtol=1e-12)
    np.testing.assert_allclose((damping / (2 * np.sqrt(mass * stiffness)))[3:5], [0.3, 0.8], rtol=1e-12)


@jax.jit
def slopes_of_forces(vehicle, nu):
    return jax.jacfwd(lambda nu: -coriolis_matrix(vehicle.added_mass, nu) @ nu - vehicle.linear_damping @ nu)(nu)


@pytest.mark.parametrize("speed", [0.5, 2.0])
def test_npsauv2_at_cruising_speed_has_the_published_derivatives(speed):
    """Y_v, Z_w, K_p, M_q and N_r: damping and the Coriolis forces of the added mass together, slightly off surge."""
    vehicle = vehicles.npsauv2(speed=speed)
    found = np.diag(slopes_of_forces(vehicle, np.array([speed, 0, 0, 0, 0, 0])))
    unit = 0.5 * 1025 * 5.3**2 * speed * np.array([1, 1, 5.3**2, 5.3**2, 5.3**2])
    np.testing.assert_allclose(found[1:] / unit, [-0.1, -0.3, -0.011, -0.068, -0.016], rtol=1e-12)


@pytest.mark.parametrize("axis, coefficient, power", [(1, 0.5, 0), (2, 0.6, 0), (4, 0.6, 1), (5, 0.5, 1)])
def test_npsauv2_cross_flow_is_the_integral_over_the_hull(axis, coefficient, power):
    """Pure sway, heave, pitch and yaw at 0.3: strips of a 0.53 m wide, 5.3 m long hull, summed finely."""
    edges = np.linspace(-2.65, 2.65, 20_001)
    x = (edges[1:] + edges[:-1]) / 2
    local = 0.3 * x**power
    expected = 0.5 * 1025 * coefficient * 0.53 * (np.abs(local) * local * x**power).sum() * (x[1] - x[0])
    quadratic = vehicles.npsauv2(speed=0.0).body().damping(jnp.zeros(6).at[axis].set(0.3))
    np.testing.assert_allclose(float(quadratic[axis]), expected, rtol=1e-7)


def test_npsauv2_refuses_to_cruise_backwards():
    with pytest.raises(BadInput, match="speed"):
        vehicles.npsauv2(speed=-1.0)


def test_thrusters_are_named_by_where_they_stand():
    names = vehicles.bluerov2_heavy().thruster_names()
    assert names[:2] == ("T1 bow starboard", "T2 bow port") and names[-1] == "T8 vertical stern port"
    assert vehicles.remus100().thruster_names() == ("T1 stern",)
    assert vehicles.npsauv2().thruster_names() == ("T1 stern",)


def test_own_names_of_thrusters_stand_where_the_others_do():
    six = vehicles.bluerov2()
    own = dataclasses.replace(six, own_thruster_names=("", "Bug", "", "", "lift-1", "lift-2"))
    assert own.thruster_names() == (
        six.thruster_names()[0],
        "T2 Bug",
        *six.thruster_names()[2:4],
        "T5 lift-1",
        "T6 lift-2",
    )
    assert own.with_thrusters((6, 1)).thruster_names() == ("T1 lift-2", "T2 " + six.thruster_names()[0][3:])
    for names, says in (
        (("one",), "`own_thruster_names` must be 6 names, one per thruster, or none, but is 1"),
        (("a", "b", "c", "d", "e", "A"), r"`own_thruster_names\[5\]` must differ from `own_thruster_names\[0\]`"),
    ):
        with pytest.raises(BadInput, match=says):
            dataclasses.replace(six, own_thruster_names=names)


@pytest.mark.parametrize(
    ("text", "number"),
    [("lift left", 3), ("LIFT  Left", 3), ("T3 lift left", 3), ("stern", None), ("", None), ("T1 stern", 1)],
)
def test_thrusters_are_found_by_their_names(text, number):
    assert number_of(text, ("T1 stern", "T2 stern", "T3 lift left")) == number


@pytest.mark.parametrize(
    ("name", "change", "says"),
    [
        ("inertia", lambda one: one[:2], "be a 3 x 3 matrix, but is of shape (2, 3)"),
        ("added_mass", lambda one: one[0], "be a 6 x 6 matrix, but is of shape (6,)"),
        ("linear_damping", lambda one: one * np.nan, "be a finite number"),
        ("added_mass", lambda one: -one, "leave M = M_RB + M_A positive definite"),
        ("inertia", lambda one: one - 2 * np.diag(np.diag(one)), "That of the rigid body, M_RB, is not by itself"),
        ("added_mass", lambda one: one + np.eye(6, k=1), "be symmetric, but is off by 1"),
        ("thruster_positions", lambda one: one[1:], "have one row (x, y, z) per thruster, like thruster_directions"),
        ("thruster_directions", lambda one: 1.01 * one, "have length 1, but is 1.01 long"),
        ("mass", lambda one: 0 * one, "be positive"),
        ("buoyancy", lambda one: -one, "be positive"),
        ("r_g", lambda one: one[:2], "have 3 entries (forward, starboard, down), but is 2 long"),
        ("r_b", lambda one: one + np.inf, "be a finite number"),
    ],
)
def test_no_body_is_like_that(name, change, says):
    rov = vehicles.bluerov2_heavy("wu2018")
    given = {field: getattr(rov, field) for field in rov.__dataclass_fields__}
    with pytest.raises(BadInput) as caught:
        VehicleModel(**(given | {name: change(np.asarray(given[name]))}))
    assert str(caught.value).startswith(f"`{name}") and says in str(caught.value)


def test_thrusters_are_left_out_by_their_numbers():
    rov = vehicles.bluerov2_heavy()
    some = rov.with_thrusters((8, 2))
    np.testing.assert_array_equal(some.thruster_matrix(), np.asarray(rov.thruster_matrix())[:, [7, 1]])
    for wrong, says in (((0,), "be numbers from 1 to 8"), ((1, 9), "but is 9"), ((1, 1), "different"), ((), "one or")):
        with pytest.raises(BadInput, match=says):
            rov.with_thrusters(wrong)
