"""A new process up to its first result: python -m undertow.studies.speed.first"""

from undertow.core.process_setup import prepare

prepare()

from undertow.scenario.results.run_scenario import run_scenario
from undertow.studies.speed.workload import W1


def main() -> None:
    """Run W1 and print its rms error of position."""
    steady = run_scenario(W1).steady
    print(steady and steady["position_rms"])


if __name__ == "__main__":
    main()
