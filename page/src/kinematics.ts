/** How the shafts of a train turn with each other. */
import type { Run } from "./core";
import type { Description } from "./description";
import { SLIDING, TURNING } from "./units";

/** Turns of each shaft for one of the last one, where gears with a standing housing lead from it there. */
export function ratios(d: Description): Map<string, number> {
  const last = d.shafts.at(-1)!.name;
  const found = new Map([[last, 1]]);
  const gears = d.gears.filter((g) => g.fixed);
  for (let round = 0; round < gears.length; ++round)
    for (const g of gears) {
      const [a, b] = [found.get(g.input), found.get(g.output)];
      if (a === undefined && b !== undefined) found.set(g.input, b * g.ratio);
      if (b === undefined && a !== undefined) found.set(g.output, a / g.ratio);
    }
  return found;
}

/** The angle of each shaft at a sample [rad], and the position of each slide [m]; those that no gear leads to are left out. */
export function angles(d: Description, run: Run, k: number): Map<string, number> {
  const found = new Map<string, number>();
  for (const { name, angle } of d.shafts) {
    const given = angle === null ? undefined : run.values.get(angle);
    if (given) found.set(name, given[k]!);
  }
  for (let round = 0; round < d.gears.length; ++round)
    for (const g of d.gears) {
      if (!g.fixed) continue;
      const [a, b] = [found.get(g.input), found.get(g.output)];
      const twist = g.twist === null ? 0 : run.values.get(g.twist)![k]!;
      if (a === undefined && b !== undefined) found.set(g.input, g.ratio * (b + twist));
      if (b === undefined && a !== undefined) found.set(g.output, a / g.ratio - twist);
    }
  return found;
}

/** Units of a shaft or a slide. */
export function unitsOf(d: Description, shaft: string): typeof TURNING {
  return d.shafts.find((s) => s.name === shaft)?.slide ? SLIDING : TURNING;
}

export function words(name: string): string {
  return name.replaceAll("_", " ");
}
