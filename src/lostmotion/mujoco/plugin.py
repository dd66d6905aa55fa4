"""The actuator plugin of MuJoCo, for models that are stepped by MuJoCo itself."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..control.command import CommandSignal
from ..control.controller import Controller
from ..errors import InputError, need
from ..inputs.argument_checks import checked
from ..portable.checkout import made_here
from ..portable.derivation import Derivation
from ..portable.scenario_as_numbers import written
from ..simulation.forms.train_tables import TrainInitial
from ..simulation.stepping.robot_joints import joint_drive, output_of
from ..simulation.stepping.solver_access import solver_train
from .attaching import without_loads

LIBRARY = Path(__file__).parent / "plugin_library"


@checked
def load_plugin() -> Path:
    """Load the plugin ``lostmotion.drive`` into MuJoCo, so that models may contain it.

    Returns
    -------
    Path
        The library, which other programs load by ``mj_loadPluginLibrary``.

    Raises
    ------
    InputError
        There is no library for this platform.
    MissingLibraryError
        MuJoCo is not installed.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.mujoco.load_plugin().stem
    'lostmotion_mujoco'
    """
    need("mujoco", "lostmotion.mujoco", "mujoco")
    import mujoco

    made_here("mujoco-plugin", LIBRARY.glob("lostmotion_mujoco.*"), "the plugin of MuJoCo")
    found = next(LIBRARY.glob("lostmotion_mujoco.*"), None)
    if found is None:
        raise InputError(f"{LIBRARY}: has no plugin of MuJoCo; build it in a checkout by `make mujoco-plugin`")
    mujoco.mj_loadPluginLibrary(str(found))
    return found


@checked
def write_drive(drive: Any, path: str | Path, *, controller: Controller | None = None, replace: bool = False) -> str:
    """Write a drive train to a file for the plugin, and return the MJCF that uses it.

    Parameters
    ----------
    drive
        As of `attach`: a drive, a drive train, a scenario or its name, or a gearbox of the catalogue.
    path
        Of the file. Of several ends of a train the shaft that is called as the file, without its extension, is that of the joint.
    controller
        A sampled controller of the motor.
    replace
        Take loads and weights off the drive, which the robot has, as `attach` does.

    Returns
    -------
    str
        Armature of the joint, and the actuator, with JOINT in place of the name of the joint.

    Raises
    ------
    InputError
        Not one motor turns one end of the train, or a controller has a law of your own.

    Examples
    --------
    >>> import tempfile
    >>> import lostmotion as lm
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     print(lm.mujoco.write_drive("schaeffler-rt1-h-20-100", f"{directory}/elbow.drive"))
    <joint name="JOINT" armature="..."/>
    <plugin joint="JOINT" plugin="lostmotion.drive"><config key="scenario" value=".../elbow.drive"/></plugin>
    """
    name = Path(path).stem
    given = without_loads(name, drive, controller, replace=replace, weighs=True)
    train = given.train()
    joint = joint_drive(name, given, 1.0, 1e-3, slides=train.is_slide(output_of(name, train)))
    core = solver_train(joint.simulation)
    still = [CommandSignal().core()] * len(core.input_names())
    start = joint.drive.start(TrainInitial(speeds=joint.ratios()))
    case = _core.Case(core, inputs=still, start=start, hysteresis_capacities={})
    numbers = np.append(written(joint.drive, Derivation(), case), joint.reflected_inertia)
    try:
        numbers.astype("<f8").tofile(path)
    except OSError as problem:
        raise InputError(f"{path}: cannot be written: {problem.strerror}") from None
    return (
        f'<joint name="JOINT" armature="{joint.reflected_inertia:.9g}"/>\n'
        f'<plugin joint="JOINT" plugin="lostmotion.drive"><config key="scenario" value="{path}"/></plugin>'
    )
