/** A chart of a report: lines or points with a cursor that reads values, and a zoom. */
import { h } from "./dom";
import type { LinesData, Packed } from "./packed";
import { type Chart, type Line, Plot } from "./plot";
import { format } from "./units";

type Range = [number, number];
const NEAR = 24; // pixels, within which a point is told
const UNIT = / ?\[([^\]]*)\]$/; // behind the name of a quantity
const KEYS = "Arrow keys move the cursor, plus and minus zoom, Escape shows all.";

export class LinesChart {
  private readonly plot: Plot;
  private readonly lines: Line[];
  private readonly tip = h("div", { class: "tip", hidden: true });
  private readonly box = h("div", { class: "zoomed", hidden: true });
  private readonly readings: HTMLElement[];
  /** every line goes from left to right: the cursor is a line, and others follow it */
  readonly rising: boolean;
  private readonly ground?: (x: number, y: number) => number;
  private readonly whole: Range;
  private seen: Range;
  private at?: number;
  private from?: number; // pixel at which a zoom begins
  /** with the same quantity on its x axis, beside this one */
  companions: LinesChart[] = [this];

  constructor(
    private readonly place: HTMLElement,
    readonly data: LinesData,
    private readonly arrays: Packed["arrays"],
  ) {
    const title = place.closest("figure")!.querySelector("b")!.textContent!;
    place.classList.remove("still"); // its picture stays, for paper
    place.setAttribute("tabindex", "0");
    place.setAttribute("role", "group");
    place.setAttribute("aria-label", `${title}. ${KEYS}`);
    this.plot = new Plot(place, title);
    this.plot.mark(NaN);
    place.append(this.box, this.tip);
    this.readings = [...place.closest("figure")!.querySelectorAll<HTMLElement>("output")];
    this.lines = data.lines.map((line) => ({ ...line, x: arrays[line.x]!, y: arrays[line.y]! }));
    const { x, y, ground } = data;
    if (ground)
      this.ground = surface(arrays[ground.x]!, arrays[ground.y]!, arrays[ground.values]!, [
        x.logarithmic,
        y.logarithmic,
      ]);
    this.rising = !ground && this.lines.every(({ x, width }, n) => width !== 0 && !data.lines[n]!.names && rises(x));
    this.whole = data.x.range ?? this.reach();
    this.seen = this.whole;
    this.listen();
    this.draw();
  }

  draw(): void {
    this.plot.draw(this.chart());
  }

  /** Draws also where nobody sees it: a chart without a picture, on paper. */
  paint(): void {
    this.plot.picture();
  }

  /** Shows a part of the x axis; none: all of it. */
  show(range: Range = this.whole): void {
    this.seen = range;
    this.draw();
  }

  /** The cursor at x; none: nowhere. */
  follow(x?: number): void {
    this.at = x;
    this.tip.hidden = x === undefined;
    this.plot.mark(x ?? NaN);
    const values = this.lines.map((line) => (x === undefined ? NaN : line.y[nearest(line.x, x)]!));
    for (const reading of this.readings)
      reading.textContent = x === undefined ? "" : measured(this.data.y.label, values[Number(reading.dataset.line)]!);
    if (x === undefined) return;
    const alone = this.lines.length === 1 && this.readings.length === 0;
    const there = named(this.data.x.label, x);
    this.say(alone ? `${there}: ${named(this.data.y.label, values[0]!)}` : there, this.plot.place(x, NaN)[0], 4);
  }

  private chart(): Chart {
    const { x, y, marks, spans, level } = this.data;
    const contours = this.data.contours?.map((c) => ({ ...c, x: this.arrays[c.x]!, y: this.arrays[c.y]! }));
    const axis = { ...y, range: y.range && this.seen === this.whole ? y.range : this.height() };
    const shade = this.ground && { value: this.ground };
    return { x: { ...x, range: this.seen }, y: axis, lines: this.lines, marks, spans, level, shade, contours };
  }

  /** All of x, with little room beside it. */
  private reach(): Range {
    const all = [...this.lines.map((l) => l.x), ...(this.data.ground ? [this.arrays[this.data.ground.x]!] : [])];
    return limits(all, this.data.x.logarithmic, this.data.x.logarithmic ? 0 : 0.02);
  }

  /** What the lines reach within the part that is shown. */
  private height(): Range {
    const [low, high] = this.seen;
    const inside = this.lines.map(({ x, y }) => y.filter((_, k) => x[k]! >= low && x[k]! <= high));
    const marks = this.data.marks.filter((m) => m.x >= low && m.x <= high).flatMap((m) => [m.y, m.to ?? m.y]);
    const ground = this.data.ground ? [this.arrays[this.data.ground.y]!] : [];
    return limits([...inside, Float64Array.from(marks), ...ground], this.data.y.logarithmic, ground.length ? 0 : 0.06);
  }

  private listen(): void {
    const { place } = this;
    const pixel = (event: PointerEvent): number => event.clientX - place.getBoundingClientRect().left;
    place.addEventListener("pointermove", (event) => {
      this.point(pixel(event), event.clientY - place.getBoundingClientRect().top);
      this.stretch(pixel(event));
    });
    place.addEventListener("pointerleave", () => this.everywhere((c) => c.follow()));
    place.addEventListener("pointerdown", (event) => {
      if (event.pointerType === "mouse" && event.button === 0) this.from = pixel(event);
    });
    window.addEventListener("pointerup", (event) => this.release(pixel(event)));
    place.addEventListener("dblclick", () => this.everywhere((c) => c.show()));
    place.addEventListener("keydown", (event) => this.key(event));
  }

  private everywhere(act: (chart: LinesChart) => void): void {
    for (const chart of this.companions) act(chart);
  }

  private point(left: number, top: number): void {
    if (this.rising) return this.everywhere((c) => c.follow(this.plot.valueAt(left)));
    let found: { line: number; k: number; distance: number } = { line: 0, k: 0, distance: NEAR };
    this.lines.forEach(({ x, y }, line) =>
      x.forEach((value, k) => {
        const [a, b] = this.plot.place(value, y[k]!);
        const distance = Math.hypot(a - left, b - top);
        if (distance < found.distance) found = { line, k, distance };
      }),
    );
    const near = found.distance < NEAR;
    this.tip.hidden = !near && !this.ground;
    this.plot.mark(NaN);
    if (!near && this.ground) {
      const [x, y] = this.plot.valuesAt(left, top);
      const at = `${named(this.data.x.label, x, 3)}, ${named(this.data.y.label, y, 3)}`;
      this.say(`${at}: ${named(this.data.ground!.label, this.ground(x, y))}`, left, top);
    }
    if (!near) return;
    const { x, y, label } = this.lines[found.line]!;
    const [value, other] = [x[found.k]!, y[found.k]!];
    const name = this.data.lines[found.line]!.names?.[found.k] ?? (this.lines.length > 1 ? label : "");
    const [a, b] = this.plot.place(value, other);
    this.plot.mark(value, other);
    const across = this.data.x.names?.[value] ?? named(this.data.x.label, value);
    this.say(`${name ? `${name}: ` : ""}${across}, ${named(this.data.y.label, other)}`, a, b);
  }

  private say(text: string, left: number, top: number): void {
    this.tip.textContent = text;
    const right = left > this.place.clientWidth / 2;
    this.tip.style.left = right ? "" : `${left + 10}px`;
    this.tip.style.right = right ? `${this.place.clientWidth - left + 10}px` : "";
    this.tip.style.top = `${Math.max(0, Math.min(top - 4, this.place.clientHeight - 60))}px`;
  }

  private stretch(pixel: number): void {
    this.box.hidden = this.from === undefined || Math.abs(pixel - this.from) < 5;
    if (this.from === undefined) return;
    this.box.style.left = `${Math.min(pixel, this.from)}px`;
    this.box.style.width = `${Math.abs(pixel - this.from)}px`;
  }

  private release(pixel: number): void {
    const { from } = this;
    this.from = undefined;
    this.box.hidden = true;
    if (from === undefined || Math.abs(pixel - from) < 5) return;
    const ends = [from, pixel].map((p) => this.plot.valueAt(p)).sort((a, b) => a - b) as Range;
    if (ends[1] > ends[0]) this.everywhere((c) => c.show(ends));
  }

  private key(event: KeyboardEvent): void {
    const at = this.at ?? middle(this.seen, this.data.x.logarithmic);
    const moves: Record<string, () => void> = {
      ArrowLeft: () => this.everywhere((c) => c.follow(this.beside(at, -0.01))),
      ArrowRight: () => this.everywhere((c) => c.follow(this.beside(at, 0.01))),
      "+": () => this.everywhere((c) => c.show([this.beside(at, -0.25), this.beside(at, 0.25)])),
      "-": () => this.everywhere((c) => c.show(this.wider())),
      Escape: () => this.everywhere((c) => (c.show(), c.follow())),
    };
    const move = moves[event.key];
    if (!move || !this.rising) return;
    move();
    event.preventDefault();
  }

  /** A share of what is shown to the side of x, but not out of it. */
  private beside(x: number, share: number): number {
    const [low, high] = this.seen;
    const moved = this.data.x.logarithmic ? x * (high / low) ** share : x + share * (high - low);
    return Math.min(high, Math.max(low, moved));
  }

  private wider(): Range {
    const [low, high] = this.seen;
    const [factor, half] = [Math.sqrt(high / low), 0.5 * (high - low)];
    const ends: Range = this.data.x.logarithmic ? [low / factor, high * factor] : [low - half, high + half];
    return [Math.max(this.whole[0], ends[0]), Math.min(this.whole[1], ends[1])];
  }
}

/** A value with the name and the unit of its axis: frequency 3.05 Hz. */
function named(label: string, value: number, digits = 4): string {
  return `${label.replace(UNIT, "")} ${measured(label, value, digits)}`.trim();
}

function measured(label: string, value: number, digits = 4): string {
  const unit = UNIT.exec(label)?.[1] ?? "";
  return `${format(value, digits)} ${unit === "-" ? "" : unit}`.trim();
}

function middle([low, high]: Range, logarithmic: boolean): number {
  return logarithmic ? Math.sqrt(low * high) : 0.5 * (low + high);
}

function rises(x: Float64Array): boolean {
  for (let k = 1; k < x.length; ++k) if (!(x[k]! >= x[k - 1]!)) return false;
  return true;
}

/** Index of the value nearest to x, of values that rise. */
function nearest(values: Float64Array, x: number): number {
  let [low, high] = [0, values.length - 1];
  while (high - low > 1) {
    const k = (low + high) >> 1;
    if (values[k]! <= x) low = k;
    else high = k;
  }
  return x - values[low]! <= values[high]! - x ? low : high;
}

/** Limits of an axis, of what can be drawn on it. */
export function limits(all: Float64Array[], logarithmic: boolean, room: number): Range {
  let [low, high] = [Infinity, -Infinity];
  for (const values of all)
    for (const v of values) {
      if (!Number.isFinite(v) || (logarithmic && v <= 0)) continue;
      if (v < low) low = v;
      if (v > high) high = v;
    }
  if (low > high) return logarithmic ? [1, 10] : [0, 1];
  if (logarithmic) {
    const factor = high > low ? (high / low) ** room : 2;
    return [low / factor, high * factor];
  }
  const rounding = 1e-9 * Math.max(Math.abs(low), Math.abs(high));
  const wide = high - low > rounding ? room * (high - low) : Math.abs(high) || 1;
  return [low - wide, high + wide];
}

/** Linear between the nodes of a grid, whose axes may be logarithmic; NaN beside a node that has none. */
function surface(xs: Float64Array, ys: Float64Array, values: Float64Array, [logX, logY]: [boolean, boolean]) {
  const [u, v] = [logX ? xs.map(Math.log) : xs, logY ? ys.map(Math.log) : ys];
  return (x: number, y: number): number => {
    const [i, s] = cell(u, logX ? Math.log(x) : x);
    const [j, r] = cell(v, logY ? Math.log(y) : y);
    const at = (k: number, n: number): number => values[k * xs.length + n]!;
    return (1 - r) * ((1 - s) * at(j, i) + s * at(j, i + 1)) + r * ((1 - s) * at(j + 1, i) + s * at(j + 1, i + 1));
  };
}

function cell(nodes: Float64Array, x: number): [number, number] {
  let k = 0;
  while (k < nodes.length - 2 && x >= nodes[k + 1]!) ++k;
  return [k, Math.min(1, Math.max(0, (x - nodes[k]!) / (nodes[k + 1]! - nodes[k]!)))];
}
