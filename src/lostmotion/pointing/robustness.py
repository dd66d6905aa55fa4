"""The same axes as they are on another day: with another target speed, temperature or wear, or under a controller that is wrong about them."""

import math
from collections.abc import Callable
from functools import partial
from typing import Any

from .causes import Tables, linear_drives

COPPER, MAGNETS, LUBRICANT = (
    3.93e-3,
    -2.0e-3,
    -1.5e-2,
)  # [1/K], relative: resistance, flux of ferrite, friction and losses

MAP_FACTORS = (0.6, 0.8, 1.25, 1.5)
TEMPERATURES = (-40.0, -20.0, 20.0, 40.0)  # [K], from the temperature of the data
WEAR = (0.5, 1.0, 2.0, 5.0)  # [arcmin]
AXIAL_WEAR = (1.0, 2.0, 5.0, 10.0)  # [µm]
SPEED_FACTORS = (0.25, 0.5, 1.5, 2.0)

TableChange = Callable[[Tables], None]


def scaled_losses(factor: float, data: Tables) -> None:
    """The losses that the controllers know, times a factor."""
    for controller in data["controllers"].values():
        if "inverse_model" in controller:
            model = controller["inverse_model"]
            model["loss_factor"] = factor * model.get("loss_factor", 1.0)


def warmer(difference: float, data: Tables) -> None:
    """Dry and viscous friction and losses of gears by exp(-0.015 difference), windings of DC motors and their magnets; the controllers do not know of the change."""
    lubricant = math.exp(LUBRICANT * difference)
    _keep_knowledge(data, lubricant)
    for motor in data["motors"].values():
        motor["friction_torque"] = lubricant * motor.get("friction_torque", 0.0)
        if motor.get("kind", "dc") == "dc":
            _warm_winding(motor, 1.0 + COPPER * difference, 1.0 + MAGNETS * difference)
    for gear in data["gears"].values():
        gear["viscous_friction"] = lubricant * gear.get("viscous_friction", 0.0)
        gear["losses"] = _scaled(gear["losses"], lubricant)
    for drive in linear_drives(data):
        for key in ("viscous_friction", "drag_torque", "friction_coefficient", "friction_angle"):
            if key in drive:
                drive[key] = lubricant * drive[key]
        if "efficiency" in drive:
            drive["efficiency"] = max(1e-3, 1.0 - lubricant * (1.0 - drive["efficiency"]))


def _keep_knowledge(data: Tables, factor: float) -> None:
    """The inverse models go on with the friction and losses that they had."""
    for name, controller in data["controllers"].items():
        if "inverse_model" in controller:
            model, motor = controller["inverse_model"], data["motors"][name]
            shaft = data["shafts"][motor["shaft"]]
            own = motor.get("friction_torque", 0.0) + shaft.get("friction_torque", 0.0)
            model.setdefault("friction_torque", own)
            if "efficiency" not in model:
                model["loss_factor"] = model.get("loss_factor", 1.0) / factor


def _warm_winding(motor: Tables, resistance: float, flux: float) -> None:
    """Warm motor of (2): stall torque with flux/resistance, no-load speed with 1/flux, time constant with 1/resistance."""
    k = motor["armature_voltage_constant"]
    no_load = motor["rated_speed"] * k / (k - 1.0) if k > 1.0 else math.inf
    motor["armature_voltage_constant"] = warm = k * flux / resistance
    motor["electrical_time_constant"] = motor["electrical_time_constant"] / resistance
    if warm > 1.0:
        motor["rated_speed"] = no_load / flux * (warm - 1.0) / warm


def _scaled(losses: Tables, factor: float) -> Tables:
    if losses["kind"] == "constant_efficiency":
        return losses | {"efficiency": max(0.0, 1.0 - factor * (1.0 - losses["efficiency"]))}
    if losses["kind"] == "map":
        return losses | {"values": tuple(tuple(factor * v for v in row) for row in losses["values"])}
    return losses


def worn(arcmin: float, data: Tables) -> None:
    """Gears with a torsion curve get so much more backlash."""
    gap = math.radians(arcmin / 60.0)
    for gear in data["gears"].values():
        stiffness = gear["stiffness"]
        if stiffness["kind"] == "linear":
            stiffness = {"kind": "curve", "slopes": (stiffness["stiffness"],), "breaks": ()}
        if stiffness["kind"] == "curve":
            gear["stiffness"] = stiffness | {"backlash": stiffness.get("backlash", 0.0) + gap, "preload": 0.0}
    for controller in data["controllers"].values():
        if "inverse_model" in controller:
            controller["inverse_model"].setdefault("twist_rate", 0.5)


def worn_axially(micrometres: float, data: Tables) -> None:
    """Screws, racks and belts with a stiffness, or with flanks that strike, get so much more backlash."""
    for drive in linear_drives(data):
        if "stiffness" in drive or "stiffness_curve" in drive or "restitution" in drive or "nut_stiffness" in drive:
            drive |= {"backlash": drive.get("backlash", 0.0) + 1e-6 * micrometres, "preload": 0.0}


def faster(factor: float, data: Tables) -> None:
    """All targets at so many times their speed; each axis begins on its reference."""
    targets = [c["reference"].get("target") for c in data["controllers"].values()]
    if not targets or not all(target is not None and "speed" in target for target in targets):
        return
    for target in targets:
        target["speed"] = factor * target["speed"]
    start: dict[str, Any] = data["initial"]
    start |= {"angles": {}, "speeds": {}, "on_reference": True}


ROBUSTNESS: dict[str, TableChange] = {
    **{f"losses in the controller x {factor:g}": partial(scaled_losses, factor) for factor in MAP_FACTORS},
    **{f"{difference:+g} K": partial(warmer, difference) for difference in TEMPERATURES},
    **{f"wear: {arcmin:g} arcmin more backlash": partial(worn, arcmin) for arcmin in WEAR},
    **{f"wear: {gap:g} µm more axial backlash": partial(worn_axially, gap) for gap in AXIAL_WEAR},
}
"""what axes may become, or their controllers take them for"""

SPEEDS: dict[float, TableChange] = {factor: partial(faster, factor) for factor in SPEED_FACTORS}
"""by the factor on the speed of the targets"""
