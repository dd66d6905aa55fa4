import { expect, test } from "vitest";
import { changed, fromFragment, toFragment } from "../src/changes";
import { position, value } from "../src/controls";
import type { Description, Slider } from "../src/description";

const slider = (key: string, more: Partial<Slider> = {}): Slider => ({
  key,
  group: "",
  label: key,
  unit: "",
  factor: 1,
  value: 2,
  min: 1,
  max: 4,
  logarithmic: false,
  target: "parameter",
  ...more,
});
const signal = { mean: 0, sines: [[0, 1, 0]] as [number, number, number][], steps: [], ramps: [], courses: [] };
const described = (...sliders: Slider[]): Description => ({
  name: "n",
  title: "t",
  version: "1",
  shafts: [],
  motors: [],
  contacts: [],
  open_loop: true,
  figures: [],
  sliders,
  gears: [
    {
      name: "g",
      input: "a",
      output: "b",
      ratio: 2,
      fixed: true,
      twist: null,
      output_torque: "T",
      backlash: 0,
      losses: null,
    },
  ],
  loops: [],
  core: {
    numbers: "",
    with_gap: null,
    inputs: [signal],
    references: [{ ...signal, moves: null }],
    duration: 1,
    interval: 0.1,
    values: {},
    changed_inputs: [],
    changed_references: [],
  },
  scenario: { gearbox: { ratio: 2 }, command: { mean: 0 }, shafts: [{ inertia: 1 }] },
});

test("a parameter goes to the core, to the drawing and to the file, and the original stays", () => {
  const original = described(slider("gearbox.ratio", { view: ["gears", 0, "ratio"] }));
  const d = changed(original, new Map([["gearbox.ratio", 3]]));
  expect([d.core.values, d.gears[0]!.ratio, d.scenario.gearbox]).toEqual([{ "gearbox.ratio": 3 }, 3, { ratio: 3 }]);
  expect([original.core.values, original.gears[0]!.ratio, original.scenario.gearbox]).toEqual([{}, 2, { ratio: 2 }]);
});

test("a signal is changed as a whole, and the file gets the keys that belong together", () => {
  const target = { input: 0, path: ["sines", 0, 0] };
  const d = changed(
    described(slider("command.amplitude", { target, needs: { "command.frequency": 1 } })),
    new Map([["command.amplitude", 0.5]]),
  );
  expect(d.core.inputs[0]!.sines).toEqual([[0.5, 1, 0]]);
  expect(d.core.changed_inputs).toEqual([0]);
  expect(d.scenario.command).toEqual({ mean: 0, amplitude: 0.5, frequency: 1 });
});

test("a reference is changed as a whole", () => {
  const target = { reference: 0, path: ["mean"] };
  const d = changed(
    described(slider("controller.reference.mean", { target })),
    new Map([["controller.reference.mean", 3]]),
  );
  expect([d.core.references[0]!.mean, d.core.changed_references]).toEqual([3, [0]]);
});

test("the address keeps every value to the last bit", () => {
  const changes = new Map([
    ["a.b", 0.1 + 0.2],
    ["c", 1e-7],
  ]);
  const sliders = [slider("a.b", { min: 0, max: 1 }), slider("c", { min: 0, max: 1 })];
  expect(fromFragment(`#${toFragment(changes)}`, sliders)).toEqual({ changes, unusable: [] });
});

test("what an address holds beyond the sliders and their ranges is said", () => {
  const { changes, unusable } = fromFragment("#a=3&b=1&a=x&a=9", [slider("a")]);
  expect(changes).toEqual(new Map([["a", 3]]));
  expect(unusable).toEqual(["b=1", "a=x", "a=9"]);
});

test.each([
  slider("linear", { min: -1, max: 3, factor: 1e-3 }),
  slider("logarithmic", { min: 1e-7, max: 1e-3, logarithmic: true, factor: 1e-4 }),
])("a slider's position and its value belong together ($key)", (s) => {
  for (const at of [0, 1, 250, 999, 1000]) expect(position(s, value(s, at))).toBe(at);
  expect([value(s, 0), value(s, 1000)]).toEqual([s.min, s.max]);
});
