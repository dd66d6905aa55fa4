"""Which parameters does the load's angle depend on most, while the drive works through its backlash?"""

import lostmotion as lm

scenario = lm.load("paper-2dof-nl-small").replace(**{"simulation.duration": 1.0})
keys = [
    "load.inertia",
    "load.viscous_friction",
    "gearbox.hysteresis.efficiency",
    "motor.friction_torque",
    "command.amplitude",
]
result = lm.simulate(scenario, sensitivities=keys)
values = (scenario.load.inertia, scenario.load.viscous_friction, scenario.gearbox.hysteresis.efficiency)
values += (scenario.motor.friction_torque, scenario.command.amplitude)
print(f"{result.attrs['switching_count']} switchings; change of the load angle in 1 s for one per cent more of")
for key, value in zip(keys, values, strict=True):
    change = 0.01 * value * float(result.load_angle_sensitivity.sel(parameter=key)[-1])
    print(f"  {key:30} {1e6 * change:10.4f} urad")
