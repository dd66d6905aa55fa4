import { expect, test } from "vitest";
import { toml } from "../src/toml";

test("tables, lists, texts and numbers; what is missing is left out", () => {
  const written = toml({
    title: 'a "b"',
    command: { mean: 0, steps: [{ height: -0.15, time: 0.1 }], chirp: null },
    shafts: { motor: {}, load: { inertia: 8e-7 } },
    gearbox: {
      losses: {
        speeds: [0, 0.5],
        values: [
          [1, 2],
          [3, 1e21],
        ],
      },
      "odd name": true,
    },
  });
  expect(written).toBe(`title = "a \\"b\\""

[command]
mean = 0
steps = [{ height = -0.15, time = 0.1 }]

[shafts.motor]

[shafts.load]
inertia = 8e-7

[gearbox]
"odd name" = true

[gearbox.losses]
speeds = [0, 0.5]
values = [[1, 2], [3, 1e+21]]`);
});
