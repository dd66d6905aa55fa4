/**
 * A chart on a canvas: lines over time or over each other, in the page's colours.
 *
 * Libraries for charts draw functions of a rising x; loops (twist and torque), maps and time charts here share one
 * look, and a redraw has to fit into a frame on a slow machine.
 */
import { extent, padded } from "./extent";
import { DrawnWhenVisible } from "./visible";
import { format, logarithmicTicks, shown, ticks } from "./units";

export interface Line {
  label: string;
  x: Float64Array;
  y: Float64Array;
  /** name of a colour of the style sheet */
  colour: string;
  width?: number;
  dash?: number[];
  /** of a pinned run: faint, and without an entry in the legend */
  faint?: boolean;
  /** radius of a dot at each point; with width 0 there are dots alone */
  points?: number;
  /** each point has its number beside it, from 1 on */
  numbered?: boolean;
}

/** Points at which the ground has one value. */
export interface Contour {
  text: string;
  x: Float64Array;
  y: Float64Array;
  label: [number, number];
}

export interface Axis {
  label: string;
  unit: string;
  logarithmic?: boolean;
  range?: [number, number];
  /** of the values 0, 1, 2, ... */
  names?: string[];
  /** counts what has no halves */
  whole?: boolean;
}

/** A point that is named, with a line from it to another y. */
export interface Mark {
  x: number;
  y: number;
  to?: number;
  text: string;
  colour: string;
}

export interface Chart {
  x: Axis;
  y: Axis;
  lines: Line[];
  /** a ground that is the darker, the higher the value there */
  shade?: { value: (x: number, y: number) => number };
  /** of that ground */
  contours?: Contour[];
  /** intervals of x that are set apart */
  spans?: [number, number][];
  marks?: Mark[];
  /** y of a line across the chart */
  level?: number;
}

const ANGLE = /°|deg(rees)?\]/; // with ticks at halves and thirds of a right angle
const NAMES = 8; // along an axis; more are told on demand
const CELLS: [number, number] = [72, 48]; // of a shade
const MARGIN = { left: 66, right: 12, top: 8, bottom: 34 };

export class Plot {
  private readonly canvas = document.createElement("canvas");
  private readonly cursor = document.createElement("div");
  private chart?: Chart;
  private readonly seen: DrawnWhenVisible;
  private marked?: [number, number?];
  private width = 0;
  private height = 0;
  private toX: Scale = (x) => x;
  private toY: Scale = (y) => y;
  private xRange: [number, number] = [0, 1];
  private yRange: [number, number] = [0, 1];

  /** atOnce: drawn with the first frame, before the browser says whether it is in the window. */
  constructor(
    readonly root: HTMLElement,
    label: string,
    atOnce = false,
  ) {
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", label);
    this.cursor.className = "cursor";
    this.root.append(this.canvas, this.cursor);
    this.seen = new DrawnWhenVisible(this.root, () => this.paint(), atOnce);
    new ResizeObserver(() => this.fit()).observe(this.root);
  }

  draw(chart: Chart): void {
    this.chart = chart;
    if (this.width > 0) this.seen.changed();
  }

  /** The canvas, painted also where nobody sees it. */
  picture(): HTMLCanvasElement {
    this.seen.catchUp();
    return this.canvas;
  }

  /** Where something is, in pixels of the page. */
  place(x: number, y: number): [number, number] {
    return [this.toX(x), this.toY(y)];
  }
  /** The value on the x axis below a pixel. */
  valueAt(pixel: number): number {
    const share = (pixel - MARGIN.left) / (this.width - MARGIN.left - MARGIN.right);
    return between(this.xRange, Math.min(1, Math.max(0, share)), this.chart?.x.logarithmic);
  }

  /** The values below a point. */
  valuesAt(left: number, top: number): [number, number] {
    const share = (this.height - MARGIN.bottom - top) / (this.height - MARGIN.top - MARGIN.bottom);
    return [this.valueAt(left), between(this.yRange, Math.min(1, Math.max(0, share)), this.chart?.y.logarithmic)];
  }

  /** A line at x, or with y a point there; it does not redraw the chart. */
  mark(x: number, y?: number): void {
    this.marked = [x, y];
    if (this.width === 0) return;
    const [left, top] = this.place(x, y ?? 0);
    const inside = left >= MARGIN.left - 1 && left <= this.width - MARGIN.right + 1;
    this.cursor.hidden = !inside;
    this.cursor.classList.toggle("point", y !== undefined);
    this.cursor.style.transform = `translate(${left}px, ${y === undefined ? MARGIN.top : top}px)`;
    if (y === undefined) this.cursor.style.height = `${this.height - MARGIN.top - MARGIN.bottom}px`;
  }

  private fit(): void {
    this.width = this.root.clientWidth;
    this.height = this.root.clientHeight;
    const density = window.devicePixelRatio || 1;
    this.canvas.width = Math.round(this.width * density);
    this.canvas.height = Math.round(this.height * density);
    this.canvas.getContext("2d")!.setTransform(density, 0, 0, density, 0, 0);
    if (this.chart && this.width > 0) this.seen.changed();
  }

  private paint(): void {
    const { x, y, lines } = this.chart!;
    const c = this.canvas.getContext("2d")!;
    const style = getComputedStyle(this.root);
    const colour = (name: string): string => style.getPropertyValue(`--${name}`).trim();
    this.xRange = x.range ?? padded(extent(lines.map((l) => l.x)), 0.06);
    this.yRange = y.range ?? padded(extent(lines.map((l) => l.y)));
    const { spans = [], marks = [], level } = this.chart!;
    const [right, bottom] = [this.width - MARGIN.right, this.height - MARGIN.bottom];
    this.toX = scale(this.xRange, [MARGIN.left, right], x.logarithmic);
    this.toY = scale(this.yRange, [bottom, MARGIN.top], y.logarithmic);
    c.clearRect(0, 0, this.width, this.height);
    c.font = `12px ${style.fontFamily}`;
    for (const [from, to] of spans) this.span(c, from, to, colour("grid"));
    if (this.chart!.shade) this.shade(c, this.chart!.shade.value, colour("text"));
    this.axes(c, x, y, colour);
    c.save();
    c.beginPath();
    c.rect(MARGIN.left, MARGIN.top, this.width - MARGIN.left - MARGIN.right, this.height - MARGIN.top - MARGIN.bottom);
    c.clip();
    if (level !== undefined) this.across(c, level, colour("edge"));
    this.contours(c, colour);
    for (const line of lines) {
      c.strokeStyle = c.fillStyle = colour(line.colour);
      c.globalAlpha = line.faint ? 0.5 : 1;
      c.lineWidth = line.width ?? 1.75;
      c.setLineDash(line.dash ?? []);
      if (line.width !== 0) this.trace(c, line);
      if (line.points) this.dots(c, line, line.points);
    }
    c.globalAlpha = 1;
    c.setLineDash([]);
    const numbers = lines
      .filter((line) => line.numbered)
      .flatMap(({ x, y, colour: ink }) =>
        Array.from(x, (value, k): Mark => ({ x: value, y: y[k]!, text: `${k + 1}`, colour: ink })),
      );
    this.name(c, [...marks, ...numbers], colour);
    c.restore();
    if (this.marked) this.mark(...this.marked);
  }

  private shade(c: CanvasRenderingContext2D, value: (x: number, y: number) => number, ink: string): void {
    const [columns, rows] = CELLS;
    const { x, y } = this.chart!;
    const values = Array.from({ length: columns * rows }, (_, k) => {
      const [i, j] = [k % columns, Math.floor(k / columns)];
      return value(
        between(this.xRange, (i + 0.5) / columns, x.logarithmic),
        between(this.yRange, 1 - (j + 0.5) / rows, y.logarithmic),
      );
    });
    const [low, high] = extent([values]);
    const [red, green, blue] = channels(ink);
    const image = new ImageData(columns, rows);
    values.forEach((v, k) => {
      const share = high > low ? (v - low) / (high - low) : 0;
      if (!Number.isNaN(v)) image.data.set([red, green, blue, Math.round(255 * (0.08 + 0.42 * share))], 4 * k);
    });
    const cells = document.createElement("canvas");
    [cells.width, cells.height] = CELLS;
    cells.getContext("2d")!.putImageData(image, 0, 0);
    const width = this.width - MARGIN.left - MARGIN.right;
    c.drawImage(cells, MARGIN.left, MARGIN.top, width, this.height - MARGIN.top - MARGIN.bottom);
  }

  /** Where there are more points than pixels, the lowest and the highest of each column. */
  private trace(c: CanvasRenderingContext2D, { x, y }: Line): void {
    const { toX, toY } = this;
    const n = x.length;
    const rising = n > 1 && x === this.chart!.lines[0]!.x && x[n - 1]! > x[0]! && !this.chart!.x.logarithmic;
    const per = rising ? Math.floor(n / (2 * this.width)) : 0;
    c.beginPath();
    if (per < 2) {
      let drawing = false; // a value that is none makes a gap
      for (let k = 0; k < n; ++k) {
        const [left, top] = [toX(x[k]!), toY(y[k]!)];
        const there = Number.isFinite(left) && Number.isFinite(top);
        if (there && drawing) c.lineTo(left, top);
        else if (there) c.moveTo(left, top);
        drawing = there;
      }
    } else {
      for (let k = 0; k < n; k += per) {
        let [low, high] = [k, k];
        for (let j = k; j < Math.min(n, k + per); ++j) {
          if (y[j]! < y[low]!) low = j;
          if (y[j]! > y[high]!) high = j;
        }
        for (const j of [Math.min(low, high), Math.max(low, high)]) c.lineTo(toX(x[j]!), toY(y[j]!));
      }
    }
    c.stroke();
  }

  /** Lines of one value with that value, where these do not cover each other. */
  private contours(c: CanvasRenderingContext2D, colour: (name: string) => string): void {
    const written: [number, number][] = [];
    c.setLineDash([]);
    c.textAlign = "center";
    c.textBaseline = "middle";
    for (const { text, x, y, label } of this.chart!.contours ?? []) {
      c.strokeStyle = colour("edge");
      c.lineWidth = 1;
      c.beginPath();
      let drawn = false;
      for (let k = 0; k < x.length; k++) {
        const seen = Number.isFinite(x[k]!);
        if (seen) c[drawn ? "lineTo" : "moveTo"](...this.place(x[k]!, y[k]!));
        drawn = seen;
      }
      c.stroke();
      const [left, top] = this.place(...label);
      if (written.some(([a, b]) => Math.abs(left - a) < 34 && Math.abs(top - b) < 13)) continue;
      this.halo(c, text, left, top, colour);
      written.push([left, top]);
    }
  }

  /** A text that is read over lines. */
  private halo(
    c: CanvasRenderingContext2D,
    text: string,
    left: number,
    top: number,
    colour: (name: string) => string,
  ): void {
    c.strokeStyle = colour("surface");
    c.lineWidth = 3;
    c.strokeText(text, left, top);
    c.fillStyle = colour("text");
    c.fillText(text, left, top);
  }

  private dots(c: CanvasRenderingContext2D, { x, y }: Line, radius: number): void {
    c.beginPath();
    for (let k = 0; k < x.length; ++k) {
      const [left, top] = this.place(x[k]!, y[k]!);
      if (!Number.isFinite(left) || !Number.isFinite(top)) continue;
      c.moveTo(left + radius, top);
      c.arc(left, top, radius, 0, 2 * Math.PI);
    }
    c.fill();
  }

  private span(c: CanvasRenderingContext2D, from: number, to: number, ink: string): void {
    const inside = (v: number): number => Math.min(this.width - MARGIN.right, Math.max(MARGIN.left, this.toX(v)));
    c.fillStyle = ink;
    c.fillRect(inside(from), MARGIN.top, inside(to) - inside(from), this.height - MARGIN.top - MARGIN.bottom);
  }

  private across(c: CanvasRenderingContext2D, value: number, ink: string): void {
    c.strokeStyle = ink;
    c.lineWidth = 1;
    c.setLineDash([4, 3]);
    c.beginPath();
    c.moveTo(MARGIN.left, this.toY(value));
    c.lineTo(this.width - MARGIN.right, this.toY(value));
    c.stroke();
  }

  /** Points with their names, as far as these do not cover each other. */
  private name(c: CanvasRenderingContext2D, marks: Mark[], colour: (name: string) => string): void {
    const written: [number, number, number][] = []; // left, right, baseline
    c.textBaseline = "middle";
    c.textAlign = "left";
    for (const { x, y, to, text, colour: ink } of marks) {
      const [left, top] = this.place(x, y);
      c.strokeStyle = c.fillStyle = colour(ink);
      c.lineWidth = 2;
      c.beginPath();
      c.moveTo(left, top);
      c.lineTo(left, to === undefined ? top : this.toY(to));
      c.stroke();
      c.beginPath();
      c.arc(left, top, 3.5, 0, 2 * Math.PI);
      c.fill();
      const wide = c.measureText(text).width;
      const begin = left + 7 + wide < this.width - MARGIN.right ? left + 7 : left - 7 - wide;
      const line = [top - 9, top + 10, top - 24, top + 25].find((at) =>
        written.every(([a, b, other]) => begin > b + 4 || begin + wide < a - 4 || Math.abs(other - at) > 13),
      );
      if (line === undefined || text === "") continue;
      this.halo(c, text, begin, line, colour);
      written.push([begin, begin + wide, line]);
    }
  }

  private axes(c: CanvasRenderingContext2D, x: Axis, y: Axis, colour: (name: string) => string): void {
    const sx = shown(x.unit, Math.max(...this.xRange.map(Math.abs)));
    const sy = shown(y.unit, Math.max(...this.yRange.map(Math.abs)) / 1.06);
    const bottom = this.height - MARGIN.bottom;
    c.strokeStyle = colour("grid");
    c.fillStyle = colour("muted");
    c.lineWidth = 1;
    c.textBaseline = "middle";
    c.textAlign = "right";
    c.beginPath();
    const at = ([low, high]: [number, number], axis: Axis, s: { factor: number }, count: number): number[] =>
      axis.names
        ? axis.names.flatMap((_, k) => (axis.names!.length <= NAMES ? [k] : []))
        : axis.logarithmic
          ? logarithmicTicks(low, high)
          : ticks(low / s.factor, high / s.factor, count, ANGLE.test(axis.label + axis.unit), axis.whole).map(
              (v) => v * s.factor,
            );
    for (const v of at(this.yRange, y, sy, Math.max(2, this.height / 42))) {
      const top = Math.round(this.toY(v)) + 0.5;
      c.moveTo(MARGIN.left, top);
      c.lineTo(this.width - MARGIN.right, top);
      c.fillText(format(v / sy.factor, 6), MARGIN.left - 6, top);
    }
    c.textAlign = "center";
    c.textBaseline = "top";
    for (const v of at(this.xRange, x, sx, Math.max(2, this.width / 90))) {
      const left = Math.round(this.toX(v)) + 0.5;
      c.moveTo(left, MARGIN.top);
      c.lineTo(left, bottom);
      const text = x.names?.[v] ?? format(v / sx.factor, 6);
      c.fillText(text, Math.min(left, this.width - 0.5 * c.measureText(text).width), bottom + 5);
    }
    c.stroke();
    c.textBaseline = "bottom";
    c.textAlign = "right";
    c.fillText(written(x.label, sx.unit), this.width - MARGIN.right, this.height - 1);
    c.save();
    c.translate(1, MARGIN.top);
    c.rotate(-Math.PI / 2);
    c.textBaseline = "top";
    c.fillText(written(y.label, sy.unit), 0, 0);
    c.restore();
  }
}

function written(label: string, unit: string): string {
  return unit ? `${label} [${unit}]`.trim() : label;
}

type Scale = (value: number) => number;

/** From values to pixels. */
function scale([low, high]: [number, number], [from, to]: [number, number], logarithmic = false): Scale {
  if (logarithmic) return (v) => from + (to - from) * (Math.log(v / low) / Math.log(high / low));
  const factor = (to - from) / (high - low);
  return (v) => from + (v - low) * factor;
}

/** The value at a share of an axis. */
function between([low, high]: [number, number], share: number, logarithmic = false): number {
  return logarithmic ? low * (high / low) ** share : low + share * (high - low);
}

/** Red, green and blue of #rrggbb. */
function channels(colour: string): [number, number, number] {
  const value = parseInt(colour.slice(1), 16);
  return [value >> 16, (value >> 8) & 255, value & 255];
}
