import { join } from "node:path";
import { expect, inject, test } from "vitest";
import { Core } from "../src/core";
import { fundamental, respond, SAMPLES } from "../src/response";
import { coreOf, descriptionOf, expected } from "./browser";

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

test("the response is that of the periodic motions that Python finds by shooting", async () => {
  const directory = inject("directory");
  const file = join(directory, "drive.html");
  const core = await Core.load(coreOf(file));
  for (const { amplitude, frequency, re, im } of expected(directory, "drive").responses) {
    const point = respond(core, descriptionOf(file).core, "load_speed", amplitude, frequency);
    const [x, y] = [point.gain * Math.cos(point.phase), point.gain * Math.sin(point.phase)];
    expect(point.settled).toBe(true);
    // One period differs from the one before by a thousandth at most, and the differences fall.
    expect(Math.hypot(x - re, y - im) / Math.hypot(re, im), `${amplitude} at ${frequency} Hz`).toBeLessThan(3e-3);
  }
});
