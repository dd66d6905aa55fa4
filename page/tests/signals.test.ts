import { expect, test } from "vitest";
import type { Signal } from "../src/core_input";
import { breakpoints, sines } from "../src/signals";

const nothing: Signal = { mean: 0, sines: [], steps: [], ramps: [], courses: [] };

test("a constant is one breakpoint", () => {
  expect(breakpoints({ ...nothing, mean: 0.5 })).toEqual([[0, 0.5, 0]]);
});

test("steps add up from their times on, in whatever order they are given", () => {
  const signal = {
    ...nothing,
    mean: 1,
    steps: [
      [-3, 0.4],
      [2, 0.1],
    ] as [number, number][],
  };
  expect(breakpoints(signal)).toEqual([
    [0, 1, 0],
    [0.1, 3, 0],
    [0.4, 0, 0],
  ]);
});

test("a ramp rises in a straight line and stays", () => {
  expect(breakpoints({ ...nothing, ramps: [[4, 2, 1]] })).toEqual([
    [0, 0, 0],
    [1, 0, 2],
    [3, 4, 0],
  ]);
});

test("a step during a ramp keeps its slope", () => {
  const signal = {
    ...nothing,
    steps: [[10, 2]] as [number, number][],
    ramps: [[4, 2, 1]] as [number, number, number][],
  };
  expect(breakpoints(signal)).toEqual([
    [0, 0, 0],
    [1, 0, 2],
    [2, 12, 2],
    [3, 14, 0],
  ]);
});

test("a sine without an amplitude and a step without a height are none", () => {
  expect(breakpoints({ ...nothing, steps: [[0, 0.5]] })).toEqual([[0, 0, 0]]);
  expect(
    sines({
      ...nothing,
      sines: [
        [0, 1, 0],
        [2, 3, 0.5],
      ],
    }),
  ).toEqual([[2, 3, 0.5]]);
});
