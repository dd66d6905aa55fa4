/**
 * A chart on a canvas: lines over time or over each other, in the page's colours.
 *
 * Libraries for charts draw functions of a rising x; loops (twist and torque), maps and time charts here share one
 * look, and a redraw has to fit into a frame on a slow machine.
 */
import { extent, padded } from "./extent";
import { Seen } from "./seen";
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
}

export interface Axis {
  label: string;
  unit: string;
  logarithmic?: boolean;
  range?: [number, number];
}

export interface Chart {
  x: Axis;
  y: Axis;
  lines: Line[];
  /** a ground that is the darker, the higher the value there */
  shade?: { value: (x: number, y: number) => number };
}

const CELLS: [number, number] = [72, 48]; // of a shade
const MARGIN = { left: 52, right: 12, top: 8, bottom: 34 };

export class Plot {
  private readonly canvas = document.createElement("canvas");
  private readonly cursor = document.createElement("div");
  private chart?: Chart;
  private readonly seen: Seen;
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
    this.seen = new Seen(this.root, () => this.paint(), atOnce);
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
    const [a, b] = this.xRange;
    return a + Math.min(1, Math.max(0, share)) * (b - a);
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
    const [right, bottom] = [this.width - MARGIN.right, this.height - MARGIN.bottom];
    this.toX = scale(this.xRange, [MARGIN.left, right], x.logarithmic);
    this.toY = scale(this.yRange, [bottom, MARGIN.top], y.logarithmic);
    c.clearRect(0, 0, this.width, this.height);
    c.font = `12px ${style.fontFamily}`;
    if (this.chart!.shade) this.shade(c, this.chart!.shade.value, colour("text"));
    this.axes(c, x, y, colour);
    c.save();
    c.beginPath();
    c.rect(MARGIN.left, MARGIN.top, this.width - MARGIN.left - MARGIN.right, this.height - MARGIN.top - MARGIN.bottom);
    c.clip();
    for (const line of lines) {
      c.strokeStyle = colour(line.colour);
      c.globalAlpha = line.faint ? 0.5 : 1;
      c.lineWidth = line.width ?? 1.75;
      c.setLineDash(line.dash ?? []);
      this.trace(c, line);
    }
    c.restore();
    if (this.marked) this.mark(...this.marked);
  }

  private shade(c: CanvasRenderingContext2D, value: (x: number, y: number) => number, ink: string): void {
    const [columns, rows] = CELLS;
    const [[x0, x1], [y0, y1]] = [this.xRange, this.yRange];
    const values = Array.from({ length: columns * rows }, (_, k) => {
      const [i, j] = [k % columns, Math.floor(k / columns)];
      return value(x0 + ((i + 0.5) / columns) * (x1 - x0), y1 - ((j + 0.5) / rows) * (y1 - y0));
    });
    const [low, high] = extent([values]);
    const [red, green, blue] = channels(ink);
    const image = new ImageData(columns, rows);
    values.forEach((v, k) => {
      const share = high > low ? (v - low) / (high - low) : 0;
      image.data.set([red, green, blue, Math.round(255 * (0.03 + 0.4 * share))], 4 * k);
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
      for (let k = 0; k < n; ++k) c.lineTo(toX(x[k]!), toY(y[k]!));
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
      axis.logarithmic
        ? logarithmicTicks(low, high)
        : ticks(low / s.factor, high / s.factor, count).map((v) => v * s.factor);
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
      c.fillText(format(v / sx.factor, 6), left, bottom + 5);
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

/** Red, green and blue of #rrggbb. */
function channels(colour: string): [number, number, number] {
  const value = parseInt(colour.slice(1), 16);
  return [value >> 16, (value >> 8) & 255, value & 255];
}
