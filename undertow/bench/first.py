"""A new process up to its first result: python -m undertow.bench.first"""

from undertow.process_setup import prepare

prepare()

from undertow.bench.workload import W1
from undertow.simulation.run_scenario import run_scenario


def main() -> None:
    """Run W1 and print its rms error of position."""
    steady = run_scenario(W1).steady
    print(steady and steady["position_rms"])


if __name__ == "__main__":
    main()
