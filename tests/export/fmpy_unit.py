"""A unit of co-simulation in FMPy, an independent master, with variables by their names and what the unit logged."""

import shutil

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, calloc, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE, free
from fmpy.fmi2 import fmi2CallbackAllocateMemoryTYPE as Allocate
from fmpy.fmi2 import fmi2CallbackFreeMemoryTYPE as Free

Failed = FMICallException


class Unit:
    """An instance.

    Args:
        path: of the .fmu.
        folder: into which it is extracted; of another instance, if it has that file already.
        start: start time, s; None leaves it before its initialisation.
        guid: None for the right one.
    """

    def __init__(self, path, folder, start=0.0, guid=None):
        if not (folder / "modelDescription.xml").exists():
            fmpy.extract(path, folder)
        description = fmpy.read_model_description(folder)
        self.variables = {one.name: one for one in description.modelVariables}
        self.period = float(description.defaultExperiment.stepSize)
        self.log = []
        said = lambda environment, name, status, category, message: self.log.append(message.decode())
        self._kept = fmi2CallbackFunctions(fmi2CallbackLoggerTYPE(said), Allocate(calloc), Free(free))
        self.slave = FMU2Slave(
            guid=guid or description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=path.stem,
        )
        self.slave.instantiate(callbacks=self._kept)
        if start is not None:
            self.begin(start)

    def begin(self, start=0.0, **parameters):
        self.slave.setupExperiment(startTime=start)
        self.slave.enterInitializationMode()
        for name, value in parameters.items():
            self[name.replace("__", ".")] = value
        self.slave.exitInitializationMode()

    def names(self, *begin):
        """Names of the variables that begin with one of some words, in order."""
        return [name for name in self.variables if name.startswith(begin)]

    def inputs(self):
        return [name for name, one in self.variables.items() if one.causality == "input"]

    def outputs(self):
        return [name for name, one in self.variables.items() if one.causality == "output" and one.type == "Real"]

    def get(self, names):
        return self.slave.getReal([self.variables[name].valueReference for name in names])

    def set(self, names, values):
        self.slave.setReal([self.variables[name].valueReference for name in names], [float(one) for one in values])

    def __getitem__(self, name):
        return self.get([name])[0]

    def __setitem__(self, name, value):
        one = self.variables[name]
        if one.type == "Boolean":
            self.slave.setBoolean([one.valueReference], [value])
        else:
            self.set([name], [value])

    def connect(self, other):
        """Set the inputs that are outputs of another unit, by name."""
        shared = [name for name in self.inputs() if name in other.variables]
        self.set(shared, other.get(shared))


def closed_loop(controller, vehicle, steps):
    """Steps of two units in turn; true positions and commands before each step."""
    positions, commands = [], []
    for k in range(steps):
        t = k * vehicle.period
        controller.connect(vehicle)
        controller.slave.doStep(t, vehicle.period)
        vehicle.connect(controller)
        positions.append(vehicle.get(vehicle.names("position.")))
        commands.append(controller.get(controller.names("command")))
        vehicle.slave.doStep(t, vehicle.period)
    return positions, commands


def without_library(path, to):
    """The same unit with its sources only."""
    folder = to / f"{path.stem}_sources"
    fmpy.extract(path, folder)
    shutil.rmtree(folder / "binaries")
    return folder
