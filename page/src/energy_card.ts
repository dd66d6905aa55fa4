/** Where the energy of the run comes from and where it goes, as ribbons in proportion. */
import type { Run } from "./core";
import { h, svg } from "./dom";
import { words } from "./kinematics";
import { DrawnWhenVisible } from "./visible";
import { format, shown } from "./units";

export interface Flow {
  label: string;
  energy: number;
}

const LABELS: Record<string, string> = {
  source: "motor",
  stored_change: "stored",
  input_damper: "input viscous friction",
  load_damper: "load viscous friction",
};
const SMALL = 1e-3; // share of the whole below which an entry is left out

/** Energies by name as what flows in and what flows out; both have the same sum but for the residual. */
export function flows(energies: Map<string, number>): { into: Flow[]; out: Flow[]; residual: number } {
  const [into, out]: [Flow[], Flow[]] = [[], []];
  let residual = 0;
  for (const [name, energy] of energies) {
    if (name === "residual") residual = energy;
    if (name === "residual" || name === "turned_over" || energy === 0) continue;
    const source = name === "source" || name.endsWith(": motor");
    const flow = { label: words(LABELS[name] ?? name), energy: Math.abs(energy) };
    (source === energy > 0 ? into : out).push(flow);
  }
  const falling = (a: Flow, b: Flow): number => b.energy - a.energy;
  return { into: into.sort(falling), out: out.sort(falling), residual };
}

const [WIDTH, TOP, SPAN, GAP, ROW] = [610, 10, 150, 6, 19];
const LETTER = 7.2; // width
const [LEFT, MIDDLE, RIGHT] = [150, 215, 290]; // ends of the ribbons

export class EnergyCard {
  private readonly place = h("div", { class: "energy" });
  private readonly seen = new DrawnWhenVisible(
    this.place,
    () => this.run && this.place.replaceChildren(ribbons(this.run.energies)),
  );
  private run?: Run;

  constructor(root: HTMLElement) {
    root.append(
      h(
        "figure",
        { class: "energies" },
        h("figcaption", {}, h("b", {}, "Energy"), h("span", { class: "entry" }, "of the whole run")),
        this.place,
      ),
    );
  }

  draw(run: Run): void {
    this.run = run;
    this.seen.changed();
  }
}

/** The drawing of a ledger, or what is said in its place. */
export function ribbons(ledger: Map<string, number>): SVGElement | string {
  const { into, out, residual } = flows(ledger);
  const whole = into.reduce((sum, f) => sum + f.energy, 0);
  if (whole === 0) return "No energy has flowed.";
  const unit = shown("J", whole);
  const beside = Math.max(0, LETTER * (Math.max(...into.map((f) => f.label.length)) + 8) - LEFT); // of long labels
  const parts: SVGElement[] = [];
  const bottom = Math.max(
    ...[into, out].map((side, k) =>
      sideOf(
        side.filter((f) => f.energy > SMALL * whole),
        k === 1,
        whole,
        unit,
        parts,
      ),
    ),
  );
  parts.push(svg("rect", { x: MIDDLE - 4, y: TOP, width: 8, height: SPAN, class: "node" }));
  const text = `closes to ${format(Math.abs(residual) / whole, 2)}`;
  parts.push(
    svg(
      "text",
      { x: MIDDLE, y: Math.max(bottom + 6, TOP + SPAN + 18), class: "value" },
      `${format(whole / unit.factor, 3)} ${unit.unit}, ${text}`,
    ),
  );
  const spoken = [...into.map((f) => `in from ${f.label}`), ...out.map((f) => `out to ${f.label}`)];
  const energies = [...into, ...out].map((f, k) => `${spoken[k]} ${format(f.energy / unit.factor, 3)} ${unit.unit}`);
  return svg(
    "svg",
    {
      viewBox: `${-beside} 0 ${WIDTH + beside} ${Math.max(bottom + 16, TOP + SPAN + 26)}`,
      role: "img",
      "aria-label": `Energy: ${energies.join("; ")}`,
    },
    ...parts,
  );
}

/** Ribbons and labels of one side; returns where they end. */
function sideOf(
  all: Flow[],
  right: boolean,
  whole: number,
  unit: { unit: string; factor: number },
  parts: SVGElement[],
): number {
  let [inner, outer, label] = [TOP, TOP - 4, 0];
  all.forEach((flow) => {
    const height = (SPAN * flow.energy) / whole;
    const [x0, x1] = right ? [MIDDLE + 4, RIGHT] : [MIDDLE - 4, LEFT];
    const middle = (x0 + x1) / 2;
    const d = `M${x0} ${inner} C${middle} ${inner} ${middle} ${outer} ${x1} ${outer} V${outer + height} C${middle} ${outer + height} ${middle} ${inner + height} ${x0} ${inner + height} Z`;
    parts.push(svg("path", { d, class: right ? "ribbon out" : "ribbon in" }));
    label = Math.max(label, outer + height / 2 + 4);
    const text = `${flow.label} ${format(flow.energy / unit.factor, 3)} ${unit.unit}`;
    parts.push(svg("text", { x: right ? RIGHT + 6 : LEFT - 6, y: label, class: right ? "start" : "end" }, text));
    label += ROW;
    inner += height;
    outer = Math.max(outer + height + GAP, right ? outer + Math.min(ROW, height + GAP) : 0);
  });
  return Math.max(outer, label);
}
