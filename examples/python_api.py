"""One closed loop from Python: vehicle, thrusters, controller, run, figures.

python examples/python_api.py
"""

import undertow as ut


def main(fast: bool = False) -> ut.Run:
    """Hold a pose against suite U1; `fast` stops early."""
    rov = ut.vehicles.odin()
    plant = ut.HybridVehicle(rov, ut.thrusters.paper_table3(fidelity="ideal"))
    law = ut.rcaf(plant.model(speed_sensor=True), preset="paper")
    run = ut.simulate(
        plant,
        law,
        ut.references.setpoint([2, 3, 4, 0, 0, 1]),  # m, rad
        disturbance=ut.disturbances.u1(),
        duration=1.0 if fast else 20.0,  # s
    )
    print(run)
    return run


if __name__ == "__main__":
    figures = main().plot()
    print("Figures:", ", ".join(figures))
