/** Signals as the core takes them: straight lines from a time on, and sines. */
import type { Signal } from "./core_input";

export type Breakpoint = [time: number, value: number, slope: number];

/** The pieces of a signal, without steps of no height; from its last breakpoint on each is constant. */
function pieces(signal: Signal): Breakpoint[][] {
  return [
    ...signal.steps.filter(([height]) => height !== 0).map(([height, time]): Breakpoint[] => [[time, height, 0]]),
    ...signal.ramps.map(([rise, duration, begin]): Breakpoint[] => [
      [begin, 0, rise / duration],
      [begin + duration, rise, 0],
    ]),
    ...signal.courses,
  ];
}

function at(piece: Breakpoint[], time: number): [number, number] {
  let found: Breakpoint | undefined;
  for (const point of piece) if (point[0] <= time) found = point;
  return found ? [found[1] + found[2] * (time - found[0]), found[2]] : [0, 0];
}

/** All but the sines, from t = 0 on: in the same order of additions as in Python, so that the bits are the same. */
export function breakpoints(signal: Signal): Breakpoint[] {
  const waiting = pieces(signal).sort((a, b) => a[0]![0] - b[0]![0]);
  const times = [...new Set([0, ...waiting.flat().map((point) => point[0])])].sort((a, b) => a - b);
  let active: Breakpoint[][] = [];
  let final = 0; // sum of the pieces that are past their last breakpoint and constant from there on
  const found: Breakpoint[] = [];
  for (const time of times) {
    while (waiting[0] && waiting[0][0]![0] <= time) active.push(waiting.shift()!);
    const here = active.map((piece) => at(piece, time));
    const value = signal.mean + here.reduce((sum, [v]) => sum + v, final);
    found.push([time, value, here.reduce((sum, [, slope]) => sum + slope, 0)]);
    const past = active.map((piece) => time >= piece.at(-1)![0]);
    final += here.reduce((sum, [v], k) => (past[k] ? sum + v : sum), 0);
    active = active.filter((_, k) => !past[k]);
  }
  return found;
}

export function sines(signal: Signal): [number, number, number][] {
  return signal.sines.filter(([amplitude]) => amplitude !== 0);
}
