/** The loss map of each gear that has one, with the way of the working point through it. */
import type { Run } from "./core";
import type { Description, GearView, LossMap } from "./description";
import { h } from "./dom";
import { extent } from "./extent";
import { words } from "./kinematics";
import { type Line, Plot } from "./plot";
import { format } from "./units";

type Located = GearView & { losses: LossMap };

export class MapCard {
  private readonly plots = new Map<string, { plot: Plot; reading: HTMLElement }>();
  private gears: { gear: Located; x: Float64Array; y: Float64Array }[] = [];

  constructor(private readonly root: HTMLElement) {}

  draw(d: Description, run: Run, pinned?: Run): void {
    const located = d.gears.filter((g): g is Located => g.losses !== null);
    this.gears = located.map((gear) => ({ gear, ...working(d, gear, run) }));
    for (const { gear, x, y } of this.gears) {
      const { losses } = gear;
      const line = (at: { x: Float64Array; y: Float64Array }, faint: boolean): Line => ({
        label: gear.name,
        ...at,
        colour: "first",
        width: 1.4,
        faint,
      });
      const [fastest, [low, high]] = [extent([x])[1], extent([y])];
      const top = Math.max(0.02, 1.15 * fastest);
      const reach = Math.max(0.02, 1.15 * Math.max(-low, high));
      this.of(gear, d.gears.length > 1).plot.draw({
        x: { label: "speed / rated speed", unit: "1", range: [0, top] },
        y: { label: "load / rated torque", unit: "1", range: [-reach, reach] },
        lines: [...(pinned ? [line(working(d, gear, pinned), true)] : []), line({ x, y }, false)],
        shade: { value: (v, mu) => coefficient(losses, v, mu) },
      });
    }
  }

  mark(k: number): void {
    for (const { gear, x, y } of this.gears) {
      const { plot, reading } = this.plots.get(gear.name)!;
      plot.mark(x[k]!, y[k]!);
      reading.textContent = format(coefficient(gear.losses, x[k]!, y[k]!), 3);
    }
  }

  private of(gear: Located, several: boolean): { plot: Plot; reading: HTMLElement } {
    const { name } = gear;
    let found = this.plots.get(name);
    if (!found) {
      const [place, reading] = [h("div", { class: "plot" }), h("output", {})];
      const title = several ? `Loss map: ${words(name)}` : "Loss map";
      const [low, high] = extent([gear.losses.values.flat()]).map((v) => format(v, 3));
      const bar = h("span", { class: "scale", role: "img", "aria-label": "to" });
      const entry = h("span", { class: "entry" }, "loss coefficient here ", reading, `; ${low} `, bar, ` ${high}`);
      this.root.append(h("figure", {}, h("figcaption", {}, h("b", {}, title), entry), place));
      found = { plot: new Plot(place, `${title}: the working point over speed and load`), reading };
      this.plots.set(name, found);
    }
    return found;
  }
}

/** Relative speed, and relative load, positive where the motor drives. */
export function working(d: Description, gear: Located, run: Run): { x: Float64Array; y: Float64Array } {
  const speed = run.values.get(d.shafts.find((s) => s.name === gear.input)!.speed)!;
  const torque = run.values.get(gear.output_torque)!;
  const { rated_speed, rated_torque } = gear.losses;
  return {
    x: speed.map((w) => Math.abs(w) / rated_speed),
    y: torque.map((T, k) => (T * (Math.sign(speed[k]!) || Math.sign(T))) / rated_torque),
  };
}

/** Linear on triangles between the nodes, as core/lostmotion/parts/loss_map.hpp has them; beyond the nodes the last value. */
export function coefficient({ speeds, loads, values }: LossMap, v: number, mu: number): number {
  const [i, s] = place(speeds, v);
  const [j, r] = place(loads, mu);
  const rising = loads[j]! + loads[j + 1]! >= 0;
  const upper = rising ? r > s : r > 1 - s;
  const [right, top] = [rising === upper ? 0 : 1, upper ? 1 : 0];
  const at = (up: number, along: number): number => values[j + up]![i + along]!;
  return at(top, right) + (at(top, 1) - at(top, 0)) * (s - right) + (at(1, right) - at(0, right)) * (r - top);
}

function place(nodes: number[], x: number): [number, number] {
  let k = 0;
  while (k < nodes.length - 2 && x >= nodes[k + 1]!) ++k;
  const share = (x - nodes[k]!) / (nodes[k + 1]! - nodes[k]!);
  return [k, Math.min(1, Math.max(0, share))];
}
