"""From the figures of a data sheet to the motion of the load (see the tutorial)."""

import math

import lostmotion as lm

ARCMIN = math.pi / 10800
rated_torque, ratio = 81.0, 10.0  # [N·m], [-]
efficiency, no_load_torque = 0.97, 0.64  # at full load [-]; at the input, running without load [N·m]

# The loss torque at the output, relative to rated torque: at full load from the efficiency, without load from the
# no-load torque; where the second alone exceeds the first, as here, the larger one is kept at every load.
running = no_load_torque * ratio / rated_torque
full = max(1.0 / efficiency - 1.0, running)
gearbox = lm.Gearbox(
    ratio=ratio,
    inertia=0.40e-4,
    rated_input_speed=3100 * math.pi / 30,
    rated_output_torque=rated_torque,
    stiffness=lm.TorsionCurve(slopes=(23 / ARCMIN,), backlash=3 * ARCMIN),
    losses=lm.LossMap(
        mirrored=True, speeds=(0, 1), loads=(0, 1), values=((0.7 * running, running), (0.7 * running, full))
    ),
)
motor = lm.Motor(
    rotor_inertia=264e-7,
    friction_torque=0.01,
    rated_torque=0.64,
    rated_speed=2970 * math.pi / 30,
    electrical_time_constant=1.25e-3,
    armature_voltage_constant=21.6,
)
drive = lm.Drive(motor=motor, gearbox=gearbox, load=lm.Load(inertia=0.5))
result = lm.simulate(drive, command=lm.CommandSignal(amplitude=0.2, frequency=2.0), duration=2.0, sample_interval=1e-3)
print(f"largest load speed {float(abs(result['load_speed']).max()):.3f} rad/s")
print(f"largest twist      {float(abs(result['twist']).max()) / ARCMIN:.2f} arcmin")
lm.save(result, "data_sheet.nc")
