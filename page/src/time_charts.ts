/** Speeds, torques, twists and commands over time, each with a legend that reads at the instant shown. */
import type { Run } from "./core";
import type { Description } from "./description";
import { h } from "./dom";
import { largest } from "./extent";
import { ratios, unitsOf, words } from "./kinematics";
import { type Line, Plot } from "./plot";
import { format, shown, SLIDING, TURNING } from "./units";

interface Series {
  variable: string;
  /** what is taken from it */
  minus?: string;
  label: string;
  /** by which the values are multiplied: seen from the last shaft */
  factor: number;
}
interface Figure {
  title: string;
  unit: string;
  series: Series[];
}

const LOOKS: Pick<Line, "colour" | "width" | "dash">[] = [
  { colour: "first", width: 1.6 },
  { colour: "second", width: 2.6 },
  { colour: "third", width: 1.8, dash: [7, 3] },
  { colour: "fourth", width: 1.8, dash: [2, 3] },
];
export const look = (k: number): Pick<Line, "colour" | "width" | "dash"> => LOOKS[k % LOOKS.length]!;

/** What is drawn over time, for this train. */
export function figures(d: Description, run: Run): Figure[] {
  const turns = ratios(d);
  const seen = (label: string, factor: number, by: string): string =>
    Math.abs(factor - 1) < 1e-12 ? label : `${label} ${by} ${format(factor)}`;
  const through = (shaft: string): number => turns.get(shaft) ?? NaN;
  const speeds = d.shafts.map((s) => ({
    variable: s.speed,
    label: seen(words(s.name), through(s.name), "÷"),
    factor: 1 / through(s.name),
  }));
  const torque = (variable: string, name: string, shaft: string): Series => ({
    variable,
    label: seen(words(name), through(shaft), "×"),
    factor: through(shaft),
  });
  const torques = [
    ...d.motors.map((m) => torque(m.torque, m.name, m.shaft)),
    ...d.gears.map((g) => torque(g.output_torque, `${g.name} output`, g.output)),
  ];
  const twists = (units: typeof TURNING): Series[] =>
    d.gears
      .filter((g) => unitsOf(d, g.output) === units)
      .map((g) => ({ variable: g.twist ?? "", label: words(g.name), factor: 1 }));
  const last = unitsOf(d, d.shafts.at(-1)!.name);
  const commands = d.motors.map((m) => ({ variable: m.command ?? "", label: words(m.name), factor: 1 }));
  const all: Figure[] = [
    ...d.figures.map((f) => ({ ...f, series: f.series.map((s) => ({ ...s, factor: 1 })) })),
    { title: "Speed", unit: last.speed, series: speeds },
    { title: last === SLIDING ? "Force" : "Torque", unit: last.torque, series: torques },
    { title: "Twist", unit: TURNING.angle, series: twists(TURNING) },
    { title: "Deflection", unit: SLIDING.angle, series: twists(SLIDING) },
    { title: "Command", unit: "1", series: commands },
  ];
  for (const figure of all)
    figure.series = figure.series.filter((s) => run.values.has(s.variable) && Number.isFinite(s.factor));
  return all.filter((figure) => figure.series.length > 0);
}

interface Panel {
  figure: Figure;
  plot: Plot;
  readings: HTMLElement[];
  shown: { unit: string; factor: number };
}

export class TimeCharts {
  private panels: Panel[] = [];
  private run?: Run;

  /** seek: called with the time below the pointer. */
  constructor(
    private readonly root: HTMLElement,
    private readonly seek: (time: number) => void,
  ) {}

  build(d: Description, run: Run): void {
    this.root.replaceChildren();
    this.panels = figures(d, run).map((figure) => {
      const readings = figure.series.map(() => h("output", {}));
      const entries = figure.series.map((s, k) =>
        h("span", { class: "entry" }, swatch(k), `${s.label} `, readings[k]!),
      );
      const place = h("div", { class: "plot" });
      this.root.append(h("figure", {}, h("figcaption", {}, h("b", {}, figure.title), ...entries), place));
      const plot = new Plot(place, `${figure.title} over time`, true);
      const follow = (event: PointerEvent): void => {
        if (event.buttons === 1) this.seek(plot.valueAt(event.clientX - place.getBoundingClientRect().left));
      };
      place.addEventListener("pointerdown", follow);
      place.addEventListener("pointermove", follow);
      return { figure, plot, readings, shown: { unit: "", factor: 1 } };
    });
  }

  draw(d: Description, run: Run, pinned?: Run): void {
    this.run = run;
    for (const panel of this.panels) {
      const lines = [...(pinned ? lined(panel.figure, pinned, true) : []), ...lined(panel.figure, run, false)];
      const { unit } = panel.figure;
      panel.shown = shown(unit, Math.max(...lines.map((l) => largest(l.y))));
      panel.plot.draw({
        x: { label: "time", unit: "s", range: [0, d.core.duration] },
        y: { label: "", unit },
        lines,
      });
    }
  }

  mark(time: number, k: number): void {
    for (const { plot, figure, readings, shown: s } of this.panels) {
      plot.mark(time);
      figure.series.forEach(({ variable, minus, factor }, n) => {
        const less = minus ? this.run!.values.get(minus)![k]! : 0;
        const value = (this.run!.values.get(variable)![k]! - less) * factor;
        readings[n]!.textContent = `${format(value / s.factor, 3)}${s.unit === "°" ? "" : " "}${s.unit}`;
      });
    }
  }

  pictures(): HTMLCanvasElement[] {
    return this.panels.map((p) => p.plot.picture());
  }
}

function lined(figure: Figure, run: Run, faint: boolean): Line[] {
  return figure.series
    .filter((s) => run.values.has(s.variable))
    .map(({ variable, minus, label, factor }, k) => {
      const values = run.values.get(variable)!;
      const less = minus ? run.values.get(minus)! : undefined;
      const y = less
        ? values.map((v, n) => (v - less[n]!) * factor)
        : factor === 1
          ? values
          : values.map((v) => v * factor);
      return { label, x: run.time, y, faint, ...look(k) };
    });
}

export function swatch(k: number): HTMLElement {
  const { colour, width, dash } = look(k);
  const line = h("span", { class: "swatch", "aria-hidden": "true" });
  line.innerHTML = `<svg viewBox="0 0 26 8"><line x1="0" x2="26" y1="4" y2="4" stroke="var(--${colour})" stroke-width="${width}" stroke-dasharray="${dash?.join(" ") ?? ""}"/></svg>`;
  return line;
}
