import { expect, test } from "vitest";
import { fundamental, SAMPLES } from "../src/response";

test("the fundamental is free of the mean and of harmonics", () => {
  const at = (k: number): number => (2 * Math.PI * k) / SAMPLES;
  const values = Array.from(
    { length: 3 * SAMPLES },
    (_, k) => 5 + 3 * Math.sin(at(k) - 0.7) + 2 * Math.cos(3 * at(k)) + Math.sin(31 * at(k)),
  );
  const { re, im } = fundamental(values, SAMPLES, SAMPLES);
  expect(Math.hypot(re, im)).toBeCloseTo(3, 12);
  expect(Math.atan2(im, re)).toBeCloseTo(-0.7, 12);
});
