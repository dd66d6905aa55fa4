import { join } from "node:path";
import { expect, inject, test } from "vitest";
import { Core } from "../src/core";
import { flows } from "../src/energy_card";
import { extent, padded } from "../src/extent";
import { coefficient, working } from "../src/map_card";
import { coreOf, descriptionOf } from "./browser";
import { format, logarithmicTicks, shown, ticks } from "../src/units";

test("units take the prefix that reads well", () => {
  expect(shown("rad", 3e-4)).toEqual({ unit: "arcmin", factor: Math.PI / 10800 });
  expect(shown("rad", 0.8)).toEqual({ unit: "°", factor: Math.PI / 180 });
  expect(shown("N*m", 2.5)).toEqual({ unit: "N·m", factor: 1 });
  expect(shown("N*m", 4e3)).toEqual({ unit: "kN·m", factor: 1e3 });
  expect(shown("rad/s", 4e3)).toEqual({ unit: "rad/s", factor: 1 });
  expect(shown("1", 1e-4)).toEqual({ unit: "", factor: 1 });
});

test("numbers are written briefly and with a true minus sign", () => {
  expect([format(-0.12345678), format(2), format(1.5e-9, 2), format(NaN)]).toEqual(["−0.1235", "2", "1.5e−9", "–"]);
});

test("ticks are round and within the range", () => {
  expect(ticks(-0.3, 1.1, 5)).toEqual([0, 0.5, 1]);
  expect(ticks(0, 2, 4)).toEqual([0, 0.5, 1, 1.5, 2]);
  expect(ticks(3, 3, 4)).toEqual([3]);
  expect(ticks(0, 2, 6, false, true)).toEqual([0, 1, 2]);
  expect(ticks(-0.43, 0.43, 4)).toEqual([-0.4, -0.2, 0, 0.2, 0.4]);
  expect(logarithmicTicks(0.5, 20)).toEqual([0.5, 1, 2, 5, 10, 20]);
});

test("an extent of equal values still has room", () => {
  expect(extent([[3, -1], [7]])).toEqual([-1, 7]);
  expect(padded([2, 2])).toEqual([0, 4]);
  expect(padded([0, 0])).toEqual([-1, 1]);
});

test("what flows in flows out again", () => {
  const ledger = { source: 10, mesh: 6, load: -1, stored_change: 5, "drum: load": 0, residual: 1e-12, turned_over: 99 };
  const { into, out, residual } = flows(new Map(Object.entries(ledger)));
  const sum = (all: { energy: number }[]): number => all.reduce((s, f) => s + f.energy, 0);
  expect([sum(into), sum(out), residual]).toEqual([11, 11, 1e-12]);
  expect(into.map((f) => f.label)).toEqual(["motor", "load"]);
});

test("the loss map is what stands at its nodes, and the last value beyond them", () => {
  const map = {
    speeds: [0, 1, 3],
    loads: [-1, 1],
    values: [
      [1, 2, 3],
      [5, 6, 7],
    ],
    rated_speed: 1,
    rated_torque: 1,
  };
  expect([coefficient(map, 1, -1), coefficient(map, 3, 1), coefficient(map, 9, 9)]).toEqual([2, 7, 7]);
  expect(coefficient(map, 2, 0)).toBeCloseTo((2 + 3 + 6 + 7) / 4, 12);
});

test("the working point stands in the map where the core takes its losses", async () => {
  const file = join(inject("directory"), "drive.html");
  const d = descriptionOf(file);
  const run = (await Core.load(coreOf(file))).run(d.core);
  const gear = d.gears[0]!;
  const { x, y } = working(d, { ...gear, losses: gear.losses! }, run);
  const taken = run.values.get("loss_coefficient")!;
  const slips = [...run.values.get("input_contact")!.keys()].filter((k) => run.values.get("input_contact")![k] !== 0);
  expect(slips.length).toBeGreaterThan(500);
  for (const k of slips) expect(coefficient(gear.losses!, x[k]!, y[k]!)).toBeCloseTo(taken[k]!, 12);
});
