"""From the data of a data sheet to the motion of the load (see the tutorial)."""

import math

import lostmotion as lm

ARCMIN = math.pi / 10800

sheet = lm.data_sheets.GearboxSheet(
    name="my-gearbox",
    kind="planetary",
    ratio=10,
    rated_output_torque=81,  # [N·m]
    rated_input_speed="3100 rpm",
    peak_output_torque=126,
    max_input_speed="7500 rpm",
    inertia="0.40 kg*cm^2",
    backlash="3 arcmin",
    stiffness={"slopes": ["23 N*m/arcmin"]},
    losses={
        "efficiency": [{"input_speed": "3100 rpm", "efficiency": 0.97}],
        "no_load_torque": [{"input_speed": "3100 rpm", "torque": 0.64}],  # at the input [N·m]
    },
)
built = lm.data_sheets.build_loss_map(sheet)
print(*built.notes)  # these two data contradict each other, as they often do

gearbox = lm.gearbox("wittenstein-tp010-mf-10")  # the same from the catalogue
assert gearbox.losses == built.losses
rig = lm.test_rig.TestRig(gearbox)
print(f"lost motion        {rig.lost_motion() / ARCMIN:.2f} arcmin")
print(f"efficiency at 10 % {rig.efficiency(3100 * math.pi / 30, 0.1):.2f}")

drive = lm.Drive(motor=lm.motor("maxon-ec-i-52-606793"), gearbox=gearbox, load=lm.Load(inertia=0.5))
result = lm.simulate(drive, command=lm.CommandSignal(amplitude=0.2, frequency=2.0), duration=2.0, sample_interval=1e-3)
print(f"largest load speed {float(abs(result['load_speed']).max()):.3f} rad/s")
print(f"largest twist      {float(abs(result['twist']).max()) / ARCMIN:.2f} arcmin")
lm.save(result, "data_sheet.nc")
