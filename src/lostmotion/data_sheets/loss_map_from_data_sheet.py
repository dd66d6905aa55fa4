"""The loss map m_2B(mu, v) from the loss data of a data sheet, with the origin of every node.

Load mu = T_2 sign(w_M)/T_2R and speed v = |w_M|/n_1R are relative, mu > 0 where the motor drives. The map is put
together as

    m_2B(mu, v) = m_0(v) + L(mu, v),      L(0, v) = 0,

the part that is lost without load, and what the load adds. The paper's four areas are: 1 efficiencies, 2 no-load running
torque, 3 starting torque, 4 standstill under load. docs/catalogue-data.md explains the rules.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.quantities import Number, Temperature
from ..model.losses import LossMap
from ..reproducible import interpolate, power
from ..units.practical import RPM
from .gearbox_sheet import GearboxSheet
from .loss_data import EfficiencyPoint, LossData

# Where no datum at all says what an unloaded gearbox loses: this share of the loss at rated load.
ASSUMED_NO_LOAD_SHARE = 0.2
# Static friction is blended into the friction of motion within this relative speed.
STATIC_TO_RUNNING = 0.01
# Palmgren's load-independent bearing torque goes with viscosity to this power (A. Palmgren, Grundlagen der
# Wälzlagertechnik, 1957).
VISCOSITY_EXPONENT = 2.0 / 3.0


@dataclass(frozen=True)
class BuiltMap:
    """A loss map, with notes on its data."""

    losses: LossMap
    origin: tuple[tuple[str, ...], ...]  #: origin of each value, in the shape of `losses.values`
    notes: tuple[str, ...] = ()  #: contradictions and assumptions, one sentence each


@checked
def build_loss_map(
    sheet: GearboxSheet, *, temperature: Temperature | None = None, loss_factor: Number = 1.0
) -> BuiltMap:
    """Build the loss map of a data sheet.

    Parameters
    ----------
    sheet : GearboxSheet
        The data sheet.
    temperature : float, optional
        Temperature of the lubricant [°C]. Default: the temperature of the data. It changes the loss without load, by the
        given curves if the sheet has them at several temperatures, else by the viscosity of its lubricant.
    loss_factor : float
        Factor of all losses, for wear.

    Returns
    -------
    BuiltMap
        The loss map with notes on its data.

    Raises
    ------
    InputError
        The data do not suffice, or contradict each other beyond repair. The message names both.

    Examples
    --------
    >>> import lostmotion as lm
    >>> sheet = next(s for s in lm.catalogue() if s.name == "wittenstein-tp010-mf-10")
    >>> len(lm.data_sheets.build_loss_map(sheet).notes)
    1
    """
    if loss_factor <= 0.0:
        raise InputError(f"loss_factor {loss_factor} must be greater than 0")
    losses = sheet.losses
    for key, what in sheet.missing().items():
        if key.startswith("rated_"):
            raise InputError(f"{sheet.name}: lacks {key}; {what}")
    if losses.table is not None:
        if temperature not in (None, losses.temperature):
            raise InputError(
                f"{sheet.name}: has a whole loss table, which holds for {losses.temperature:g} °C; leave temperature out"
            )
        speeds, loads, values = losses.table.whole()
        whole = LossMap(speeds=tuple(speeds), loads=tuple(loads), values=tuple(map(tuple, values)))
        table = whole.scaled(loss_factor)
        return BuiltMap(table, tuple(tuple("given table" for _ in speeds) for _ in loads))
    if losses.empty and sheet.loss_estimate() is None:
        raise InputError(
            f"{sheet.name}: lacks an efficiency, without which no loss map can be made; see "
            f"{sheet.where('losses.efficiency')}"
        )
    built = _Builder(sheet.with_losses(), temperature).build(loss_factor)
    return replace(built, notes=(*sheet.assumptions(), *built.notes))


@dataclass
class _LoadPart:
    """L(mu) at one speed: straight lines from (0, 0) through the nodes, the last one going on."""

    loads: list[float]
    values: list[float]
    origins: list[str]

    def __call__(self, mu: float) -> float:
        x, y = [0.0, *self.loads], [0.0, *self.values]
        if mu <= x[-1]:
            return interpolate(mu, x, y)
        slope = max(0.0, (y[-1] - y[-2]) / (x[-1] - x[-2]))
        return y[-1] + slope * (mu - x[-1])

    def origin(self, mu: float) -> str:
        return self.origins[self.loads.index(mu)] if mu in self.loads else "filled in: along the load"

    def scaled(self, factor: float, origin: str) -> _LoadPart:
        return _LoadPart(self.loads, [factor * y for y in self.values], [origin] * len(self.loads))


@dataclass
class _Unloaded:
    """m_0 at one temperature: over speed in motion, and at standstill."""

    curve: dict[float, float]
    start: float

    def running(self, v: float) -> float:
        """Torque in motion: linear between the speeds, down to the lesser of starting and slowest running torque."""
        x, y = [0.0, *self.curve], [min(self.start, next(iter(self.curve.values()))), *self.curve.values()]
        if v <= x[-1]:
            return interpolate(v, x, y)
        return y[-1] + max(0.0, (y[-1] - y[-2]) / (x[-1] - x[-2])) * (v - x[-1])


@dataclass
class _Builder:
    sheet: GearboxSheet
    temperature: float | None
    notes: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        assert self.sheet.rated_output_torque is not None
        assert self.sheet.rated_input_speed is not None
        self.T_2R, self.n_1R = self.sheet.rated_output_torque, self.sheet.rated_input_speed

    def build(self, loss_factor: float) -> BuiltMap:
        losses = self.sheet.losses
        efficiencies = self._of_one_temperature(losses.all_efficiencies())
        backdrive = self._of_one_temperature(losses.backdrive_efficiency)
        self._no_load_part(losses)
        driving = self._load_parts(efficiencies, lambda p: p.load * (1.0 / p.efficiency - 1.0), "efficiency")
        static = self._static_part(losses, driving)
        if not driving:
            driving = {1.0: static.scaled(1.0 / losses.static_load_factor, "filled in: from the static efficiency")}
        if backdrive:
            overrunning = self._load_parts(backdrive, lambda p: p.load * (1.0 - p.efficiency), "back-drive efficiency")
        else:
            mirrored = "filled in: as while the motor drives"
            overrunning = {v: L.scaled(1.0, mirrored) for v, L in driving.items()}
        static_back = self._static_overrunning(losses, static)
        return self._tabulate(driving, overrunning, static, static_back, loss_factor)

    def _relative(self, speed: float) -> float:
        return speed / self.n_1R

    def _of_one_temperature(self, points: tuple[EfficiencyPoint, ...]) -> tuple[EfficiencyPoint, ...]:
        temperatures = {self._at(p.temperature) for p in points}
        if len(temperatures) > 1:
            raise InputError(
                f"{self.sheet.name}: has efficiencies at several temperatures {sorted(temperatures)} °C; give those of "
                "one temperature, and no_load_torque at several"
            )
        return points

    # --- what is lost without load: areas 2 and 3 ---

    def _no_load_part(self, losses: LossData) -> None:
        """Reads m_0 from the sheet, for `_unloaded` to give at any temperature."""
        per_torque = self.sheet.ratio / self.T_2R
        self.curves: dict[float, dict[float, float]] = {}
        for p in losses.no_load_torque:
            self.curves.setdefault(self._at(p.temperature), {})[self._relative(p.input_speed)] = per_torque * p.torque
        self.at_rest = None if losses.starting_torque is None else per_torque * losses.starting_torque
        self.at_rest_temperature = self._at(losses.starting_temperature)
        self.start_origin = "starting torque (area 3)"
        self.no_load_origin = "no-load torque (area 2)"
        if not self.curves:
            if self.at_rest is None:
                self.at_rest = self._assumed_level(losses)
                self.start_origin = self.no_load_origin = "filled in: assumed share of the loss under load"
            else:
                self.no_load_origin = "filled in: as the starting torque"
            self.curves = {self.at_rest_temperature: {1.0: self.at_rest}}
        elif self.at_rest is None:
            self.start_origin = "filled in: as the no-load torque at the lowest speed"
        wanted = self._at(self.temperature)
        self.unloaded = self._unloaded(wanted)
        if wanted != losses.temperature:
            factor = self.unloaded.start / self._unloaded(losses.temperature).start
            self.notes.append(
                f"At {wanted:g} °C the part that is lost without load is {factor:.3g} times that at {losses.temperature:g} °C."
            )

    def _at(self, temperature: float | None) -> float:
        return self.sheet.losses.temperature if temperature is None else temperature

    def _unloaded(self, temperature: float) -> _Unloaded:
        """m_0 at a temperature [°C], by the curves of the sheet, or by the viscosity from the only one."""
        curve = self._curve_at(temperature)
        if self.at_rest is None:
            return _Unloaded(curve, next(iter(curve.values())))
        # The starting torque changes as the slowest running torque does.
        then = next(iter(self._curve_at(self.at_rest_temperature).values()))
        return _Unloaded(curve, self.at_rest * (next(iter(curve.values())) / then if then > 0.0 else 1.0))

    def _assumed_level(self, losses: LossData) -> float:
        points = losses.all_efficiencies()
        eta = points[0].efficiency if points else losses.static_efficiency
        load = points[0].load if points else 1.0
        assert eta is not None
        level = ASSUMED_NO_LOAD_SHARE * load * (1.0 / eta - 1.0)
        self.notes.append(
            f"The sheet has neither no-load nor starting torque: {level:.4g} of rated torque is assumed lost without "
            f"load, {100 * ASSUMED_NO_LOAD_SHARE:.0f} % of the loss at efficiency {eta:g}; see "
            f"{self.sheet.where('losses.no_load_torque')}."
        )
        return level

    def _curve_at(self, temperature: float) -> dict[float, float]:
        """m_0 in motion over the speeds of all curves, straight between temperatures."""
        known = sorted(self.curves)
        if len(known) == 1:
            factor = self._viscosity_factor(self.sheet.losses, known[0], temperature)
            return {v: factor * m for v, m in sorted(self.curves[known[0]].items())}
        if not known[0] <= temperature <= known[-1]:
            raise InputError(
                f"{self.sheet.name}: has no_load_torque from {known[0]:g} to {known[-1]:g} °C, not at {temperature:g} °C; "
                "choose a temperature between, or add data"
            )
        out = {}
        for v in sorted({v for curve in self.curves.values() for v in curve}):
            at = [interpolate(v, sorted(c), [c[x] for x in sorted(c)]) for c in (self.curves[t] for t in known)]
            out[v] = interpolate(temperature, known, at)
        return out

    def _viscosity_factor(self, losses: LossData, reference: float, wanted: float) -> float:
        if wanted == reference:
            return 1.0
        if losses.lubricant is None:
            raise InputError(
                f"{self.sheet.name}: has data for {reference:g} °C only; for {wanted:g} °C it also needs losses.lubricant "
                "(viscosity_40, viscosity_100) or no_load_torque at several temperatures"
            )
        return power(losses.lubricant.viscosity(wanted) / losses.lubricant.viscosity(reference), VISCOSITY_EXPONENT)

    # --- what the load adds: areas 1 and 4 ---

    def _load_parts(self, points: tuple[EfficiencyPoint, ...], loss: Any, name: str) -> dict[float, _LoadPart]:
        """L at each speed at which there is a datum."""
        parts: dict[float, _LoadPart] = {}
        for p in sorted(points, key=lambda p: (p.input_speed, p.load)):
            v = self._relative(p.input_speed)
            part = parts.setdefault(v, _LoadPart([], [], []))
            total, without = loss(p), self._unloaded(self._at(p.temperature)).running(v)
            origin = f"{name} (area 1)"
            if total < without:
                self._contradiction(p, name, total, without)
                origin = f"filled in: no-load loss plus that of the {name}"
                without = 0.0
            part.loads.append(p.load)
            part.values.append(total - without)
            part.origins.append(origin)
        return parts

    def _contradiction(self, p: EfficiencyPoint, name: str, total: float, without: float) -> None:
        sheet = self.sheet
        torque = without * self.T_2R / sheet.ratio
        becomes = p.load / (p.load + without + total) if name == "efficiency" else 1.0 - (without + total) / p.load
        self.notes.append(
            f"Contradiction at {RPM * p.input_speed:.0f} rpm: without load the input takes {torque:.3g} N·m, {without:.3g} of rated torque; "
            f"the {name} {p.efficiency:g} at load {p.load:g} leaves no more than {total:.3g} for all losses. The no-load torque "
            f"is kept and the {name} taken for what the load adds; in the map it becomes {becomes:.3g} at this load."
        )

    def _static_part(self, losses: LossData, driving: dict[float, _LoadPart]) -> _LoadPart:
        """L at standstill, for starting in the direction of the motor."""
        if losses.static_efficiency is None:
            slowest = driving[min(driving)]
            return slowest.scaled(losses.static_load_factor, "filled in: static load factor (area 4)")
        total = 1.0 / losses.static_efficiency - 1.0
        start = self._unloaded(losses.temperature).start
        rise = total - start
        if rise < 0.0:
            self.notes.append(
                f"Contradiction at standstill: the starting torque alone is {start:.3g} of rated torque, the "
                f"static efficiency {losses.static_efficiency:g} leaves {total:.3g}. The starting torque is kept and the "
                "static efficiency taken for what the load adds."
            )
            rise = total
        return _LoadPart([1.0], [rise], ["static efficiency (area 4)"])

    def _static_overrunning(self, losses: LossData, static: _LoadPart) -> _LoadPart:
        """L at standstill, for starting where the load pulls. The gear holds while m_2B(-mu, 0) >= mu."""
        if losses.backdriving_torque is None:
            return static.scaled(1.0, "filled in: as while the motor drives (area 4)")
        mu = losses.backdriving_torque / self.T_2R
        start = self._unloaded(self._at(losses.backdriving_temperature)).start
        if mu < start:
            self.notes.append(
                f"Contradiction at standstill: a back-driving torque of {losses.backdriving_torque:g} N·m is less than the "
                f"starting torque times the ratio, {start * self.T_2R:.4g} N·m. Both are "
                "kept, so the loss falls a little between them."
            )
        return _LoadPart([mu], [mu - start], ["back-driving torque (area 4)"])

    # --- the table ---

    def _tabulate(
        self,
        driving: dict[float, _LoadPart],
        overrunning: dict[float, _LoadPart],
        static: _LoadPart,
        static_back: _LoadPart,
        loss_factor: float,
    ) -> BuiltMap:
        sheet = self.sheet
        torques = (sheet.average_output_torque, sheet.peak_output_torque)
        top = max([1.5, *(t / self.T_2R for t in torques if t is not None)])
        fastest = max(1.2, self._relative(sheet.max_input_speed or 0.0))
        measured = {*self.unloaded.curve, *driving, *overrunning}
        slow = min([STATIC_TO_RUNNING, *(0.5 * v for v in measured)])
        speeds = sorted({0.0, slow, *measured, 1.0, fastest})
        speeds = [v for v in speeds if v <= max(fastest, *measured)]

        def axis(parts: dict[float, _LoadPart], at_rest: _LoadPart) -> list[float]:
            nodes = {x for L in (*parts.values(), at_rest) for x in L.loads}
            return sorted({*nodes, 1.0, max(top, *nodes)})

        up, down = axis(driving, static), axis(overrunning, static_back)
        loads = [-mu for mu in reversed(down)] + [0.0] + up
        values, origins = [], []
        for mu in loads:
            parts, at_rest = (overrunning, static_back) if mu < 0.0 else (driving, static)
            cells = [self._node(abs(mu), v, parts, at_rest) for v in speeds]
            values.append(tuple(loss_factor * m for m, _ in cells))
            origins.append(tuple(origin for _, origin in cells))
        if loss_factor != 1.0:
            self.notes.append(f"All losses are multiplied by {loss_factor:g}.")
        losses = LossMap(speeds=tuple(speeds), loads=tuple(loads), values=tuple(values))
        return BuiltMap(losses, tuple(origins), tuple(self.notes))

    def _node(self, mu: float, v: float, parts: dict[float, _LoadPart], at_rest: _LoadPart) -> tuple[float, str]:
        if v == 0.0:
            origin = at_rest.origin(mu) if mu > 0.0 else self.start_origin
            return max(0.0, self.unloaded.start + at_rest(mu)), origin
        without = self.unloaded.running(v)
        if mu == 0.0:
            return without, self.no_load_origin if v in self.unloaded.curve else "filled in: along the speed"
        known = sorted(parts)
        added = interpolate(v, known, [parts[x](mu) for x in known])
        return without + added, parts[v].origin(mu) if v in parts else "filled in: along the speed"
