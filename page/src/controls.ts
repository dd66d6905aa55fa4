/** Sliders with units, in groups. */
import type { Changes } from "./changes";
import type { Slider } from "./description";
import { h } from "./dom";
import { format } from "./units";

const STEPS = 1000;

export class Controls {
  private readonly shows: (() => void)[] = [];

  /** changed: is called after each change of `changes`. */
  constructor(
    root: HTMLElement,
    sliders: Slider[],
    private readonly changes: Changes,
    private readonly changed: () => void,
  ) {
    for (const group of new Set(sliders.map((s) => s.group))) {
      const rows = sliders.filter((s) => s.group === group).map((s) => this.row(s));
      root.append(h("fieldset", {}, h("legend", {}, group), ...rows));
    }
    this.show();
  }

  /** After the changes were changed by others. */
  show(): void {
    for (const show of this.shows) show();
  }

  private row(slider: Slider): HTMLElement {
    const id = slider.key;
    const input = h("input", { type: "range", id, min: 0, max: STEPS, step: 1 });
    const number = h("input", {
      type: "text",
      inputmode: "decimal",
      "aria-label": `${slider.label}, ${slider.unit || "number"}`,
    });
    const reset = h(
      "button",
      { type: "button", class: "reset", title: "As in the file", "aria-label": `${slider.label}: as in the file` },
      "↺",
    );
    const now = (): number => this.changes.get(slider.key) ?? slider.value;
    const set = (value: number): void => {
      if (value === slider.value) this.changes.delete(slider.key);
      else this.changes.set(slider.key, value);
      this.changed();
      show();
    };
    const show = (): void => {
      const text = format(now() / slider.factor, 5);
      input.value = String(position(slider, now()));
      input.setAttribute("aria-valuetext", `${text} ${slider.unit}`);
      if (document.activeElement !== number) number.value = text;
      number.removeAttribute("aria-invalid");
      number.title = `${slider.key}, ${format(slider.min / slider.factor)} to ${format(slider.max / slider.factor)} ${slider.unit}`;
      reset.style.visibility = this.changes.has(slider.key) ? "visible" : "hidden";
    };
    input.addEventListener("input", () => set(value(slider, Number(input.value))));
    number.addEventListener("change", () => {
      const typed = Number(number.value.replace("−", "-").replace(",", ".")) * slider.factor;
      const usable = number.value.trim() !== "" && typed >= slider.min && typed <= slider.max;
      if (usable) set(typed);
      else number.setAttribute("aria-invalid", "true");
    });
    number.addEventListener("blur", show);
    reset.addEventListener("click", () => set(slider.value));
    this.shows.push(show);
    return h(
      "div",
      { class: "slider" },
      h("label", { for: id }, slider.label),
      h("span", { class: "number" }, number, h("span", { class: "unit" }, slider.unit)),
      reset,
      input,
    );
  }
}

/** The value at a position of the slider, rounded to what the position tells apart. */
export function value(slider: Slider, position: number): number {
  const share = position / STEPS;
  const { min, max, factor } = slider;
  if (share <= 0) return min;
  if (share >= 1) return max;
  const raw = slider.logarithmic ? min * (max / min) ** share : min + share * (max - min);
  const rounded = slider.logarithmic
    ? Number((raw / factor).toPrecision(4))
    : Number((raw / factor).toFixed(decimals((max - min) / factor / STEPS)));
  return Math.min(max, Math.max(min, rounded * factor));
}

function decimals(step: number): number {
  return Math.max(0, Math.min(15, 1 - Math.floor(Math.log10(step))));
}

export function position(slider: Slider, value: number): number {
  const { min, max } = slider;
  const share = slider.logarithmic ? Math.log(value / min) / Math.log(max / min) : (value - min) / (max - min);
  return Math.round(STEPS * share);
}
