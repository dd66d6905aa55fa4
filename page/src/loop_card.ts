/** Output torque over twist: the hysteresis loop of each gear that has a stiffness. */
import type { Run } from "./core";
import type { Description, GearView } from "./description";
import { h } from "./dom";
import { unitsOf, words } from "./kinematics";
import { type Line, Plot } from "./plot";
import { SLIDING } from "./units";

export class LoopCard {
  private readonly plots = new Map<string, Plot>();
  private gears: GearView[] = [];
  private run?: Run;

  constructor(private readonly root: HTMLElement) {}

  draw(d: Description, run: Run, pinned?: Run): void {
    this.run = run;
    this.gears = d.gears;
    for (const { name, twist, output, output_torque } of d.gears) {
      if (twist === null) continue;
      const units = unitsOf(d, output);
      const linear = units === SLIDING;
      const line = (of: Run, faint: boolean): Line => ({
        label: name,
        x: of.values.get(twist)!,
        y: of.values.get(output_torque)!,
        colour: "first",
        width: 1.4,
        faint,
      });
      this.plot(name, d.gears.length > 1, linear).draw({
        x: { label: linear ? "deflection" : "twist", unit: units.angle },
        y: { label: linear ? "output force" : "output torque", unit: units.torque },
        lines: [...(pinned ? [line(pinned, true)] : []), line(run, false)],
      });
    }
  }

  mark(k: number): void {
    for (const { name, twist, output_torque } of this.gears) {
      if (twist !== null)
        this.plots.get(name)!.mark(this.run!.values.get(twist)![k]!, this.run!.values.get(output_torque)![k]!);
    }
  }

  private plot(name: string, several: boolean, linear: boolean): Plot {
    let plot = this.plots.get(name);
    if (!plot) {
      const place = h("div", { class: "plot" });
      const what = `${linear ? "Deflection" : "Torsion"} and hysteresis`;
      const title = several ? `${what}: ${words(name)}` : what;
      this.root.append(h("figure", {}, h("figcaption", {}, h("b", {}, title)), place));
      plot = new Plot(place, `${title}: ${linear ? "output force over deflection" : "output torque over twist"}`);
      this.plots.set(name, plot);
    }
    return plot;
  }
}
