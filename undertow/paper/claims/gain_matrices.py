"""C9: square and non-square gain matrices."""

from undertow.paper.claims.finding import ClaimVerdict, Runs, claim, steady, tracking_error
from undertow.paper.horizons import Long
from undertow.paper.setup import plant_of, scenario

# Thrusters of ODIN that are fitted; 1-4 horizontal, 5-8 vertical.
_SUBSETS = {
    "n6_rank6": [1, 2, 3, 5, 6, 7],
    "n4_rank3": [1, 2, 3, 4],
    "n6_rank5": [1, 2, 3, 4, 5, 6],
    "n5_rank5": [1, 2, 3, 5, 6],
    "n4_rank4": [1, 2, 5, 6],
}
_QUICK = ("n4_rank3",)

_SIMULATED = "level ideal, U1, 20 s"


def _gain_matrices_scenarios(quick: bool) -> dict:
    """Example 1 with subsets of the thrusters."""
    return {
        _name(key): scenario(
            f"RCAFC on ODIN with thrusters {', '.join(map(str, numbers))} only",
            plant={
                "kind": "hybrid_vehicle",
                "vehicle": "odin",
                "thruster": {"kind": "paper_table3", "fidelity": "ideal"},
                "thrusters": numbers,
            },
        )
        for key, numbers in _SUBSETS.items()
        if key in _QUICK or not quick
    }


@claim(
    "C9",
    "The scheme works for square and non-square gain matrices (Eqs. (22)-(28)).",
    scenarios=_gain_matrices_scenarios,
)
def gain_matrices(runs: Runs, long: Long) -> ClaimVerdict:
    """Tracking by number of thrusters and rank."""
    everything = steady(runs["ideal_rcafc"])["tracking_rms"]
    numbers = {"n8_rank6": everything}
    parts = [f"8 thrusters, rank 6: {everything:.2g}"]
    failed = []
    for key in _SUBSETS:
        if _name(key) not in runs:
            continue
        run = runs[_name(key)]
        plant = plant_of(run)
        count, rank = plant.inputs(), plant.rank()
        numbers[key] = error = tracking_error(run)
        result = (
            f"ends at {float(run.outcome.ended):.1f} s ({run.status.word.replace('_', ' ')})"
            if error is None
            else f"{error:.2g}"
        )
        parts.append(f"{count} thrusters, rank {rank}: {result}")
        if error is None or error > 10 * everything:
            failed.append((count, rank))
    text = "Tracking rms, m and rad, from 10 s on: " + "; ".join(parts) + "."
    if any(rank == 6 for _, rank in failed):
        return ClaimVerdict("fails", text, "ideal_rcafc", _SIMULATED, numbers)
    if not failed:
        return ClaimVerdict("holds", text, "ideal_rcafc", _SIMULATED, numbers)
    text += " Below rank 6 the directions outside the range of G are in open loop for any w_bar."
    return ClaimVerdict("holds if rank G = 6, so not for N < 6", text, _name("n4_rank3"), _SIMULATED, numbers)


def _name(key: str) -> str:
    return f"c09_{key}"
