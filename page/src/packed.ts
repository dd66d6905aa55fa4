/** What Python (reports/packed.py) writes into a report: a header and arrays, whose bytes stand by their places in a number. */
import { unpacked } from "./wasm";

export interface LineData {
  label: string;
  x: number;
  y: number;
  colour: string;
  /** 0: points alone */
  width: number;
  dash: number[];
  faint: boolean;
  /** radius of its points */
  points?: number;
  /** of the points */
  names?: string[];
  /** the points are numbered, as the key of the chart has them */
  numbered?: boolean;
}
export interface AxisData {
  label: string;
  unit: string;
  logarithmic: boolean;
  range?: [number, number];
  names?: string[];
}
export interface LinesData {
  kind: "lines";
  x: AxisData;
  y: AxisData;
  lines: LineData[];
  spans: [number, number][];
  marks: { x: number; y: number; to?: number; text: string; colour: string }[];
  level?: number;
  ground?: { x: number; y: number; values: number; label: string };
  /** segments of two points with NaN behind each, and the point at which the value is written */
  contours?: { text: string; x: number; y: number; label: [number, number] }[];
}
export interface ContactsData {
  kind: "contacts";
  rows: { label: string; modes: number }[];
  duration: number;
}
export interface FlowsData {
  kind: "flows";
  energies: Record<string, number>;
}
export type ChartData = LinesData | ContactsData | FlowsData | { kind: "still" };

export interface Packed {
  charts: ChartData[];
  arrays: Float64Array<ArrayBuffer>[];
}

export function arraysOf(content: ArrayBuffer): Packed {
  const size = new DataView(content).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(content, 4, size))) as {
    charts: ChartData[];
    lengths: number[];
  };
  let at = 4 + size;
  const arrays = header.lengths.map((n) => {
    const shuffled = new Uint8Array(content, at, 8 * n);
    at += 8 * n;
    const bytes = new Uint8Array(8 * n);
    for (let b = 0; b < 8; ++b) for (let k = 0; k < n; ++k) bytes[8 * k + b] = shuffled[b * n + k]!;
    return new Float64Array(bytes.buffer);
  });
  return { charts: header.charts, arrays };
}

export async function read(document: Document): Promise<Packed> {
  return arraysOf(await unpacked(document, "data"));
}
