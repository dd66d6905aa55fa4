/**
 * Moves from rest to rest in the shortest time that limits of speed, acceleration and jerk permit, as
 * src/lostmotion/control/profiles.py derives them.
 */
import type { Moves } from "./core_input";
import type { Breakpoint } from "./signals";

const JERK_SIGNS = [1, 0, -1, 0, -1, 0, 1, 0];

interface Limits {
  speed: number;
  acceleration: number;
  /** Infinity: the speed is trapezoidal */
  jerk: number;
}

/** Time, position, speed, acceleration and jerk at the beginning of each segment of a move, and of the rest after it. */
export function segments(distance: number, { speed: v, acceleration: a, jerk }: Limits): Breakpoint[] {
  const D = Math.abs(distance);
  const byDistance = Math.cbrt(0.5 * D) / Math.cbrt(jerk);
  const [bySpeed, byAcceleration] = [Math.sqrt(v) / Math.sqrt(jerk), a / jerk];
  const t = Math.min(byDistance, bySpeed, byAcceleration);
  const reached = byAcceleration <= t;
  const A = reached ? a : jerk * t;
  const root = 0.5 * (Math.sqrt(t * t + (4 * D) / A) - t);
  const x = reached ? Math.min(v / A, root) : t;
  const atLimit = reached ? v / A < root : bySpeed < byDistance;
  const s = atLimit ? Math.max(D / v - x - t, 0) : 0;
  const c = Math.max(x - t, 0);
  const j = Number.isFinite(jerk) ? jerk : 0;
  const [p1, v1] = [(A * t * t) / 6, 0.5 * A * t];
  const [p2, v2] = [p1 + (v1 + 0.5 * A * c) * c, v1 + A * c];
  const V = A * (t + c);
  const p3 = 0.5 * (D - V * s);
  const positions = [0, p1, p2, p3, D - p3, D - p2, D - p1, D];
  const speeds = [0, v1, v2, V, V, v2, v1, 0];
  const accelerations = [0, A, A, 0, 0, -A, -A, 0];
  const sign = Math.sign(distance);
  let time = 0;
  return [0, t, c, t, s, t, c, t].map((duration, k) => {
    time += duration;
    return [time, ...[positions[k]!, speeds[k]!, accelerations[k]!, JERK_SIGNS[k]! * j].map((y) => sign * y)];
  });
}

/** The whole of a list of moves, from 0 on; a move without a limit of its own has that of all. */
export function course(moves: Moves): Breakpoint[] {
  const points: Breakpoint[] = [[0, moves.start]];
  let [begin, from] = [moves.begin, moves.start];
  for (const move of moves.moves) {
    const found = segments(move.to - from, {
      speed: move.speed ?? moves.speed!,
      acceleration: move.acceleration ?? moves.acceleration!,
      jerk: move.jerk ?? moves.jerk ?? Infinity,
    });
    for (const [time, position, ...rest] of found) points.push([begin + time!, position! + from, ...rest]);
    points.at(-1)![1] = move.to;
    begin += found.at(-1)![0]! + (move.dwell ?? moves.dwell);
    from = move.to;
  }
  return points.filter((point, k) => k === points.length - 1 || point[0]! < points[k + 1]![0]!);
}
