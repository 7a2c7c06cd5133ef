"""Plant, controller and closed loop of a scenario as systems of python-control, nonlinear or linearised.

    import control as ct
    from undertow.outside import python_control as upc
    loop = upc.closed_loop("bluerov2_heavy.yaml")
    time = np.arange(1000) * loop.dt
    response = ct.input_output_response(loop, time, upc.reference("bluerov2_heavy.yaml", time), loop.start)

Signals have the same names everywhere, so that systems can be connected by name.
"""

import importlib.util

if importlib.util.find_spec("control") is None:
    remedy = "In the folder of undertow, run: pip install -c constraints.txt '.[control]'"
    raise ModuleNotFoundError(f"python-control is not installed. {remedy}", name="control")

from undertow.outside.python_control.linear import linear_closed_loop as linear_closed_loop
from undertow.outside.python_control.linear import linear_controller as linear_controller
from undertow.outside.python_control.linear import linear_plant as linear_plant
from undertow.outside.python_control.systems import closed_loop as closed_loop
from undertow.outside.python_control.systems import connected as connected
from undertow.outside.python_control.systems import controller as controller
from undertow.outside.python_control.systems import limits as limits
from undertow.outside.python_control.systems import plant as plant
from undertow.outside.python_control.systems import reference as reference
