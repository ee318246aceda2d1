"""Other integrators on the equations of the gearbox, in the same run: scipy's Radau, Exudyn where it is installed."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from threadpoolctl import threadpool_limits

from benchmarks.dynamics.models import MODES, SPEED, TORQUE, gearbox_of, one_step, operators, with_modes
from nvhchain.dynamics.time_loop.simulation import simulation
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import FloatArray


def peers(folder: Path) -> dict[str, float | None]:
    """Processor seconds per simulated second of the same equations in other integrators, in this run."""
    laws, housing = operators(folder)
    model = simulation(
        gearbox_of("slotted"),
        laws["slotted"],
        with_modes(housing, MODES),
        input_torque=TORQUE,
        time_step=1e-5,
        fidelity=DynamicsFidelity(1e-5),
    )
    a, load = model.assembly, model.assembly.load(model.torque)
    stiffness = a.stiffness + (a.contact.T * model.contact_stiffness) @ a.contact
    n = len(a.mass)
    system = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness / a.mass[:, None], -a.damping / a.mass[:, None]]])
    push = np.concatenate([np.zeros(n), load / a.mass])
    with threadpool_limits(1):
        begin = time.process_time()
        solve_ivp(
            lambda t, x: system @ x + push * (1 + 0.1 * np.sin(20 * SPEED * t)), (0, 0.01), np.zeros(2 * n), "Radau",
            jac=system, rtol=1e-6, atol=1e-10, max_step=2e-5,
        )  # fmt: skip
        radau = (time.process_time() - begin) / 0.01
    return {
        "own": one_step(model, laws["slotted"]) * 1e-9 / 1e-5,
        "radau": radau,
        "exudyn": exudyn_seconds(a.mass, stiffness, a.damping, load),
    }


def exudyn_seconds(mass: FloatArray, stiffness: FloatArray, damping: FloatArray, load: FloatArray) -> float | None:
    """s per simulated second of Exudyn's generalised-α on the linear system, no contact, 10 µs; None without it."""
    try:
        import exudyn
        from exudyn.itemInterface import NodeGenericODE2, ObjectGenericODE2
    except ImportError:
        return None
    container = exudyn.SystemContainer()
    system = container.AddSystem()
    n, zeros = len(mass), np.zeros(len(mass))
    node = system.AddNode(
        NodeGenericODE2(
            referenceCoordinates=zeros, initialCoordinates=zeros, initialCoordinates_t=zeros, numberOfODE2Coordinates=n
        )
    )
    system.AddObject(
        ObjectGenericODE2(
            nodeNumbers=[node],
            massMatrix=np.diag(mass),
            stiffnessMatrix=stiffness,
            dampingMatrix=damping,
            forceVector=load,
        )
    )
    system.Assemble()
    settings = exudyn.SimulationSettings()
    duration = 0.02
    settings.timeIntegration.numberOfSteps = round(duration / 1e-5)
    settings.timeIntegration.endTime = duration
    settings.timeIntegration.generalizedAlpha.spectralRadius = 1.0
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    begin = time.process_time()
    system.SolveDynamic(settings)
    return (time.process_time() - begin) / duration
