/** Frequency response over amplitude: the drive is run with a sine until it repeats, and its fundamental is taken. */
import type { Core } from "./core";
import type { CoreInput } from "./core_input";

/** Samples in a period: the fundamental of a sum over them is free of harmonics up to the 62nd. */
export const SAMPLES = 64;
/** by which one period may differ from the one before, relative, to count as repeated */
export const REPEATED = 1e-3;
const PERIODS = [8, 24, 72]; // tried one after the other

export interface Phasor {
  re: number;
  im: number;
}

export interface Point {
  amplitude: number;
  frequency: number;
  /** of the response per unit of the command */
  gain: number;
  /** [rad], in (-2 pi, 0] as far as it lags */
  phase: number;
  /** false: it had not repeated after so many periods */
  settled: boolean;
}

/** The phasor of sin(2 pi k/n) in n samples from `begin` on: value = re sin + im cos. */
export function fundamental(values: ArrayLike<number>, begin: number, n: number): Phasor {
  let [re, im] = [0, 0];
  for (let k = 0; k < n; ++k) {
    const angle = (2 * Math.PI * k) / n;
    re += values[begin + k]! * Math.sin(angle);
    im += values[begin + k]! * Math.cos(angle);
  }
  return { re: (2 * re) / n, im: (2 * im) / n };
}

/** One point of the response of a variable to its command, the first input. */
export function respond(core: Core, input: CoreInput, variable: string, amplitude: number, frequency: number): Point {
  const interval = 1 / (frequency * SAMPLES);
  const command = {
    ...input.inputs[0]!,
    mean: 0,
    sines: [[amplitude, frequency, 0] as [number, number, number]],
    steps: [],
    ramps: [],
    courses: [],
  };
  const inputs = [command, ...input.inputs.slice(1)];
  const changed_inputs = [...new Set([0, ...input.changed_inputs])];
  let found: Phasor = { re: 0, im: 0 };
  let settled = false;
  for (const periods of PERIODS) {
    const run = core.run({ ...input, inputs, changed_inputs, interval, duration: periods / frequency });
    const values = run.values.get(variable)!;
    const before = fundamental(values, (periods - 2) * SAMPLES, SAMPLES);
    found = fundamental(values, (periods - 1) * SAMPLES, SAMPLES);
    settled = Math.hypot(found.re - before.re, found.im - before.im) <= REPEATED * Math.hypot(found.re, found.im);
    if (settled) break;
  }
  const angle = Math.atan2(found.im, found.re);
  return {
    amplitude,
    frequency,
    gain: Math.hypot(found.re, found.im) / amplitude,
    phase: angle > 0 ? angle - 2 * Math.PI : angle,
    settled,
  };
}
