/** Signals and references as the core takes them: pieces from a time on, and sines. */
import type { Signal } from "./core_input";

/** A time, a value, and its derivatives as far as they are not 0. */
export type Breakpoint = number[];

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

/** Value and derivatives of a polynomial some time after these were given. */
function taylor(derivatives: number[], time: number): number[] {
  return derivatives.map((_, order) => {
    let total = derivatives.at(-1)!;
    for (let k = derivatives.length - 2; k >= order; --k) total = derivatives[k]! + (total * time) / (k - order + 1);
    return total;
  });
}

function at(piece: Breakpoint[], time: number, derivatives: number): number[] {
  const [begin, ...given] = piece.findLast((point) => point[0]! <= time) ?? [0];
  return taylor(
    Array.from({ length: derivatives + 1 }, (_, k) => given[k] ?? 0),
    time - begin!,
  );
}

/**
 * All but the sines, from t = 0 on, with so many derivatives: in the same order of additions as in Python, so that the
 * bits are the same.
 */
export function breakpoints(signal: Signal, derivatives = 1): Breakpoint[] {
  const waiting = pieces(signal).sort((a, b) => a[0]![0]! - b[0]![0]!);
  const times = [...new Set([0, ...waiting.flat().map((point) => point[0]!)])].sort((a, b) => a - b);
  let active: Breakpoint[][] = [];
  let final = 0; // sum of the pieces that are past their last breakpoint and constant from there on
  const found: Breakpoint[] = [];
  for (const time of times) {
    while (waiting[0] && waiting[0][0]![0]! <= time) active.push(waiting.shift()!);
    const here = active.map((piece) => at(piece, time, derivatives));
    const value = signal.mean + here.reduce((sum, [v]) => sum + v!, final);
    const slopes = Array.from({ length: derivatives }, (_, n) => here.reduce((sum, d) => sum + d[n + 1]!, 0));
    found.push([time, value, ...slopes]);
    const past = active.map((piece) => time >= piece.at(-1)![0]!);
    final += here.reduce((sum, [v], k) => (past[k] ? sum + v! : sum), 0);
    active = active.filter((_, k) => !past[k]);
  }
  return found;
}

export function sines(signal: Signal): [number, number, number][] {
  return signal.sines.filter(([amplitude]) => amplitude !== 0);
}
