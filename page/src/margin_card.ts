/** Margins and bandwidths of the closed loops, as `lostmotion servo` gives them for the values in the file. */
import type { Changes } from "./changes";
import type { Description, LoopView } from "./description";
import { h } from "./dom";
import { format } from "./units";

const HEADINGS = ["loop", "regime", "gain margin", "phase margin", "crossover", "bandwidth", "|S| at most"];

export class MarginCard {
  private readonly note = h("span", { class: "entry", role: "status" });
  private readonly keys: Set<string>;

  constructor(root: HTMLElement, d: Description) {
    // Commands, references, loads and the duration change no loop.
    this.keys = new Set(d.sliders.filter((s) => s.target === "parameter").map((s) => s.key));
    if (d.loops.length === 0) return;
    const head = h("tr", {}, ...HEADINGS.map((text) => h("th", { scope: "col" }, text)));
    const table = h("table", {}, h("thead", {}, head), h("tbody", {}, ...d.loops.map(row)));
    const scroll = h("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Margins" }, table);
    root.append(h("figure", { class: "wide" }, h("figcaption", {}, h("b", {}, "Closed loops"), this.note), scroll));
  }

  use(changes: Changes): void {
    const changed = [...changes.keys()].some((key) => this.keys.has(key));
    this.note.textContent = changed
      ? "of the values in the file, not of those of the sliders: download the TOML and run lostmotion servo"
      : "exact, at the samples of each loop, in each regime of the drive";
  }
}

function row(l: LoopView): HTMLElement {
  const number = (value: number | null, unit: string): string => (value === null ? "–" : `${format(value, 3)}${unit}`);
  const degrees = l.phase_margin === null ? null : (l.phase_margin * 180) / Math.PI;
  const cells = l.stable
    ? [
        number(l.gain_margin === null ? null : 20 * Math.log10(l.gain_margin), " dB"),
        number(degrees, "°"),
        number(l.crossover, " Hz"),
        number(l.bandwidth, " Hz"),
        number(l.sensitivity_peak, ""),
      ]
    : ["unstable", "", "", "", ""];
  return h(
    "tr",
    { class: l.stable ? "stable" : "unstable" },
    h("th", { scope: "row" }, l.loop),
    h("td", { title: l.meaning }, l.regime),
    ...cells.map((text) => h("td", {}, text)),
  );
}
