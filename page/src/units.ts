/** Numbers and units as they are shown. */

const WRITTEN: Record<string, string> = { "N*m": "N·m", "1": "" };
/** Of what turns, and of what moves along a straight line. */
export const TURNING = { angle: "rad", speed: "rad/s", torque: "N*m" };
export const SLIDING = { angle: "m", speed: "m/s", torque: "N" };
const PREFIXES: [number, string][] = [
  [1e3, "k"],
  [1, ""],
  [1e-3, "m"],
  [1e-6, "µ"],
];

export interface Shown {
  unit: string;
  /** what one of it is in SI */
  factor: number;
}

/** Angles below this are in arcmin, as backlash and twist are everywhere, larger ones in degrees, as moves are. */
const SMALL_ANGLE = 0.1;

/** The unit in which values up to `largest` read well. */
export function shown(unit: string, largest: number): Shown {
  const written = WRITTEN[unit] ?? unit;
  if (unit === "rad" && largest > 0) {
    return largest < SMALL_ANGLE ? { unit: "arcmin", factor: Math.PI / 10800 } : { unit: "°", factor: Math.PI / 180 };
  }
  if (written === "" || largest === 0 || !Number.isFinite(largest)) return { unit: written, factor: 1 };
  const allowed = /^(rad|m\b)/.test(written) ? PREFIXES.slice(1) : PREFIXES;
  const [factor, prefix] = allowed.find(([f]) => largest >= f) ?? allowed.at(-1)!;
  return { unit: prefix + written, factor };
}

/** So many significant digits, without idle zeros, with a true minus sign. */
export function format(value: number, digits = 4): string {
  if (!Number.isFinite(value)) return "–";
  const text = Number(value.toPrecision(digits));
  const size = Math.abs(text);
  const written = size !== 0 && (size < 1e-4 || size >= 1e6) ? text.toExponential().replace("+", "") : String(text);
  return written.replace("-", "−");
}

/** Round values within [low, high], about `count` of them, at most a third more; whole ones, where what is counted has no halves. */
export function ticks(low: number, high: number, count: number, degrees = false, whole = false): number[] {
  const span = high - low;
  if (!(span > 0) || !Number.isFinite(span)) return [low];
  const raw = span / Math.max(1, count);
  const power = 10 ** Math.floor(Math.log10(raw));
  const round = [1, 2, 5, 10].map((f) => f * power);
  const found = (degrees && raw > 12 ? [15, 30, 45, 90, 180, 360, 720] : round).find((s) => s >= 0.75 * raw) ?? 1440;
  const step = whole ? Math.max(found, 1) : found;
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, k) => Number(((first + k) * step).toPrecision(12)));
}

/** Powers of ten, with 2 and 5 where there are few. */
export function logarithmicTicks(low: number, high: number): number[] {
  const exponents = Array.from(
    { length: Math.ceil(Math.log10(high)) - Math.floor(Math.log10(low)) + 1 },
    (_, k) => Math.floor(Math.log10(low)) + k,
  );
  const factors = high / low > 300 ? [1] : [1, 2, 5];
  const all = exponents.flatMap((e) => factors.map((f) => Number((f * 10 ** e).toPrecision(12))));
  return all.filter((x) => x >= low * (1 - 1e-9) && x <= high * (1 + 1e-9));
}
