"""Words that other programs have for the keys of scenario, campaign and vehicle files, for hints on unknown keys."""

from undertow.core import catalogue

# Key -> words for it. A star stands for any key.
WORDS: dict[str, dict[str, str]] = {
    "scenario": {
        "plant": "system process",
        "plant.vehicle": "rov auv robot hull",
        "plant.thruster": "thrusters motor motors propeller propellers actuator actuators",
        "controller": "law control_law ctrl autopilot",
        "controller.gains": "gains gain",
        "reference": "trajectory target desired goal path ref guidance",
        "disturbance": "environment wind ocean sea water loads",
        "navigation": "measurement measurements estimator filter state_estimator",
        "navigation.sensors": "sensor",
        "loop": "simulation sim simulator timing",
        "loop.dt": "time_step timestep step step_size sampling_time sample_time sampling_period ts h",
        "loop.duration": "t tend t_end tf tfinal t_final tmax t_max end_time final_time stop_time total_time "
        "simulation_time sim_time time horizon",
        "loop.record": "record_step output_step log_step log_interval save_every",
        "loop.method": "solver integrator scheme",
        "initial": "x0 initial_state initial_conditions initial_condition init",
        "initial.position": "initial_position initial_pose pose0 eta0",
        "initial.velocity": "initial_velocity nu0 v0",
        "seed": "random_seed rng_seed rng",
        "precision": "dtype float",
        "success": "criterion criteria",
        "requirements": "specifications specification",
        "falsify.vary": "search_space",
    },
    "campaign": {
        "trials": "monte_carlo montecarlo samples runs n n_trials n_samples n_runs num_trials num_samples num_runs "
        "repetitions realizations",
        "vary": "parameters distributions uncertain uncertainty uncertainties randomize random",
        "vary.*.uniform": "range between interval limits bounds",
        "vary.*.normal": "gaussian gauss",
        "vary.*.log_uniform": "loguniform logarithmic log_range",
        "vary.*.log_normal": "lognormal log_gaussian",
        "vary.*.cut_normal": "truncated_normal truncnorm clipped_normal",
        "vary.*.choice": "choices values one_of options",
        "correlation": "covariance correlated correlations",
        "cross": "sweep grid sweeps parameter_sweep product combinations",
        "design": "sampling sampler sampling_method method",
        "requirements": "success criteria criterion specifications",
        "requirements.*.below": "max maximum limit less_than upper bound",
        "requirements.*.share": "fraction probability percentage confidence",
        "series": "record signals time_series timeseries history outputs output",
        "seed": "random_seed rng_seed rng",
        "chunk": "chunk_size batch batch_size",
    },
    "vehicle file": {
        "size": "dimensions hull_size length",
        "gravity": "g",
        "volume": "displacement displaced_volume",
        "water_density": "density rho",
        "r_g": "cg cog com center_of_gravity center_of_mass centre_of_gravity centre_of_mass",
        "r_b": "cb cob center_of_buoyancy centre_of_buoyancy",
        "inertia": "moments_of_inertia moment_of_inertia inertia_matrix inertia_tensor i_g i_o",
        "added_mass": "ma m_a hydrodynamic_mass added_inertia",
        "linear_damping": "damping linear_drag d_l",
        "quadratic_damping": "drag quadratic_drag d_q nonlinear_damping",
        "thrusters": "thruster motors propellers actuators",
        "uncertainty": "deviation deviations covariance std sigma",
        "identified": "provenance identification",
        "thruster_matrix": "allocation allocation_matrix tam thruster_configuration_matrix b_matrix",
    },
}


def hint_for(path: tuple[str | int, ...], file: str) -> str:
    """Sentence that names the key which an unknown one stands for; "" where none is known.

    Args:
        path: of the unknown key.
        file: `scenario`, `campaign` or `vehicle file`.
    """
    word = str(path[-1]).lower().replace("-", "_")
    beside = path[:-1]
    for key, words in WORDS.get(file, {}).items():
        *section, name = key.split(".")
        if word not in words.split():
            continue
        if len(section) == len(beside) and all(
            expected in ("*", actual) for expected, actual in zip(section, beside, strict=True)
        ):
            return f"Did you mean `{name}`?"
        if section and not beside and "*" not in section:
            kind = "kind: ..., " if section[0] in catalogue.KIND_OF and section[0] != "plant" else ""
            return f"Did you mean `{key}`? Write `{section[0]}: {{{kind}{name}: ...}}`"
    of = next((kind for kind in catalogue.KINDS if word in catalogue.names(kind)), "")
    return f"It is one of the {of}: give it at `{catalogue.KEY_OF[of]}`" if of and file == "scenario" else ""
