"""The data sheet of an actuator: a motor and its gearbox in one, rated at the output."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from ..inputs.quantities import Inertia, Number, Positive, Speed, Torque, Voltage, Whole
from ..model.motor import Motor, MotorLimits
from ..model.notes import Notes
from .gearbox_sheet import GearboxSheet
from .loss_data import Efficiency, EfficiencyPoint, LossData
from .sheet import Record


class ActuatorSheet(Record):
    """Data sheet of a quasi-direct-drive actuator: a flat motor with a planetary gearbox of few stages.

    Examples
    --------
    >>> import lostmotion as lm
    >>> sheet = lm.data_sheets.ActuatorSheet(name="my-actuator", ratio=9, rated_output_torque="9 N*m", rated_output_speed="200 rpm")
    >>> sheet.missing()
    {'rotor_inertia': "see the manufacturer's data sheet"}
    """

    kind: Literal["quasi_direct"] = "quasi_direct"
    ratio: Annotated[Number, Positive]
    rotor_inertia: Annotated[Inertia, Positive] | None = None
    """inertia of the rotor, and of the gearbox where the sheet adds it, at the motor"""
    rated_output_torque: Annotated[Torque, Positive] | None = None  #: continuous
    peak_output_torque: Annotated[Torque, Positive] | None = None
    rated_output_speed: Annotated[Speed, Positive] | None = None
    no_load_output_speed: Annotated[Speed, Positive] | None = None
    efficiency: Efficiency | None = None
    """efficiency of the gearbox at rated torque and speed; left out, the estimate for planetary gearboxes"""
    pole_pairs: Annotated[Whole, Field(gt=0)] | None = None
    rated_voltage: Annotated[Voltage, Positive] | None = None

    NEEDS: ClassVar[dict[str, tuple[str, ...]]] = {
        "rotor_inertia": ("rotor_inertia",),
        "rated_output_torque": ("rated_output_torque",),
        "rated_output_speed": ("rated_output_speed", "no_load_output_speed"),
    }

    def level(self) -> str | None:
        """Level of a run with these data: ``"torque source"``, or None."""
        return None if self.missing() else "torque source"

    def assumptions(self) -> tuple[str, ...]:
        """Assumptions of a run beyond the data, one sentence each."""
        if self.missing():
            return ()
        gearbox = self.gearbox_sheet()
        return (*self._assumed().values(), *Notes(gearbox.note).values(), *gearbox.assumptions())

    def _assumed(self) -> dict[str, str]:
        """Assumptions about its motor."""
        return {
            "kind": f"{self.name} runs as a torque source: voltage and current are not judged.",
            "friction_torque": f"The friction of the motor of {self.name} is taken as 0.",
        }

    def gearbox_sheet(self) -> GearboxSheet:
        """The sheet of its gearbox."""
        speed = self.rated_output_speed or self.no_load_output_speed
        assert speed is not None
        losses = LossData()
        if self.efficiency is not None:
            losses = LossData(efficiency=(EfficiencyPoint(input_speed=self.ratio * speed, efficiency=self.efficiency),))
        return GearboxSheet(
            name=self.name,
            kind="planetary",
            ratio=self.ratio,
            inertia=0.0,
            rigid=True,
            rated_input_speed=self.ratio * speed,
            rated_output_torque=self.rated_output_torque,
            peak_output_torque=self.peak_output_torque,
            losses=losses,
            note={
                "stiffness": f"The gearbox of {self.name} is taken as rigid, without backlash: lost motion is not judged.",
                "inertia": f"The inertia of the gearbox of {self.name} is taken as 0.",
            },
        )

    def motor(self) -> Motor:
        """Its motor: the torques at the output through the ratio and the efficiency at rated load."""
        estimate = self.gearbox_sheet().loss_estimate()
        share = self.efficiency if estimate is None else estimate.efficiency
        assert share is not None
        assert self.rated_output_torque is not None
        per_output = 1.0 / (self.ratio * share)
        fastest = self.no_load_output_speed or self.rated_output_speed
        assert fastest is not None
        torque, peak = per_output * self.rated_output_torque, self.peak_output_torque
        return Motor(
            kind="torque_source",
            rotor_inertia=self.rotor_inertia,  # type: ignore[arg-type]  # not missing
            rated_torque=torque,
            limits=MotorLimits(
                continuous_torque=torque,
                peak_torque=None if peak is None else per_output * peak,
                max_speed=self.ratio * fastest,
            ),
            note=self._notes(),
        )
