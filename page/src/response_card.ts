/** Frequency response of the load's speed over the amplitude of the command, computed in the background. */
import type { Background } from "./background";
import type { Answer } from "./background.worker";
import type { Description } from "./description";
import { h } from "./dom";
import { unitsOf, words } from "./kinematics";
import { type Line, Plot } from "./plot";
import type { Point } from "./response";
import { look, swatch } from "./time_charts";
import { format, TURNING } from "./units";

const AMPLITUDES = [1, 0.3, 0.1, 0.03];
const FREQUENCIES = Array.from({ length: 29 }, (_, k) => 0.3 * 10 ** ((2.4 * k) / 28)); // 0.3 to 75 Hz
const PATIENCE = 250; // ms without a change before work begins

export class ResponseCard {
  private readonly state = h("span", { class: "entry", role: "status" });
  private readonly entries = AMPLITUDES.map((a) => h("span", {}, format(a)));
  private gain?: Plot;
  private phase?: Plot;
  private lines: Point[][] = [];
  private waiting = 0;
  private unit = TURNING.speed;

  constructor(
    root: HTMLElement,
    d: Description,
    private readonly background: Background,
  ) {
    if (!d.open_loop || d.motors.length === 0) return;
    const [gain, phase] = [h("div", { class: "plot" }), h("div", { class: "plot low" })];
    const entries = AMPLITUDES.map((_, k) => h("span", { class: "entry" }, swatch(k), this.entries[k]!));
    this.unit = unitsOf(d, d.shafts.at(-1)!.name).speed;
    const title = `Frequency response: ${words(d.shafts.at(-1)!.name)} speed per command, by amplitude of the command`;
    root.append(
      h("figure", { class: "wide" }, h("figcaption", {}, h("b", {}, title), ...entries, this.state), gain, phase),
    );
    this.gain = new Plot(gain, "Gain over frequency for several amplitudes of the command");
    this.phase = new Plot(phase, "Phase over frequency for several amplitudes of the command");
  }

  /** After a change; the work begins once the changes pause. */
  use(d: Description): void {
    if (!this.gain) return;
    clearTimeout(this.waiting);
    this.state.textContent = "…";
    this.waiting = window.setTimeout(() => {
      this.lines = [];
      this.background.ask(
        {
          kind: "response",
          input: d.core,
          variable: d.shafts.at(-1)!.speed,
          amplitudes: AMPLITUDES,
          frequencies: FREQUENCIES,
        },
        (answer) => this.take(answer),
      );
    }, PATIENCE);
  }

  private take(answer: Answer): void {
    if (answer.kind !== "response") return;
    const { points, done } = answer;
    this.lines.push(points);
    const unsettled = this.lines.flat().filter((p) => !p.settled).length;
    this.lines.forEach((line, k) => {
      const still = line.every((p) => p.gain === 0);
      this.entries[k]!.textContent = `${format(AMPLITUDES[k]!)}${still ? " (does not move)" : ""}`;
    });
    this.state.textContent = done ? (unsettled > 0 ? `${unsettled} points had not settled` : "") : "…";
    this.draw();
  }

  draw(): void {
    if (this.lines.length === 0) return;
    const x = {
      label: "frequency",
      unit: "Hz",
      logarithmic: true,
      range: [FREQUENCIES[0]!, FREQUENCIES.at(-1)!] as [number, number],
    };
    const line = (points: Point[], k: number, of: (p: Point) => number): Line => ({
      label: format(AMPLITUDES[k]!),
      x: Float64Array.from(points, (p) => p.frequency),
      y: Float64Array.from(points, of),
      ...look(k),
    });
    const largest = Math.max(...this.lines.flat().map((p) => p.gain));
    const floor = 1e-4 * largest;
    const moving = (points: Point[]): Point[] => points.filter((p) => p.gain > floor);
    const range: [number, number] = [floor, 2 * largest];
    this.gain!.draw({
      x,
      y: { label: "gain", unit: this.unit, logarithmic: true, range },
      lines: this.lines.map((points, k) => line(moving(points), k, (p) => p.gain)),
    });
    this.phase!.draw({
      x,
      y: { label: "phase", unit: "°", range: [-360, 0] },
      lines: this.lines.map((points, k) => line(moving(points), k, (p) => (p.phase * 180) / Math.PI)),
    });
  }
}
