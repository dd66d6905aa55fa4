import { readFileSync } from "node:fs";
import { join } from "node:path";
import type { Browser, BrowserContextOptions, Page } from "playwright-core";
import { afterAll, beforeAll, expect, inject, test } from "vitest";
import { arraysOf, type LinesData } from "../src/packed";
import { barriers, launch, unpacked, watch } from "./browser";

let browser: Browser;
const directory = inject("directory");
beforeAll(async () => {
  browser = await launch();
});
afterAll(() => browser?.close());

async function open(name: string, options: BrowserContextOptions = {}): Promise<{ page: Page; seen: string[] }> {
  const page = await browser.newPage({ viewport: { width: 1280, height: 900 }, ...options });
  const seen = watch(page);
  await page.goto(`file://${join(directory, `${name}.html`)}`);
  if (options.javaScriptEnabled !== false)
    await page.waitForFunction(() => performance.getEntriesByName("drawn").length > 0);
  return { page, seen };
}

test("a report carries the bits of Python", () => {
  const { buffer, byteOffset, byteLength } = unpacked(join(directory, "charts.html"), "data");
  const { charts, arrays } = arraysOf(buffer.slice(byteOffset, byteOffset + byteLength));
  const wanted = JSON.parse(readFileSync(join(directory, "charts.json"), "utf-8"));
  const [line] = (charts[0] as LinesData).lines;
  expect([...arrays[line!.x]!]).toEqual(wanted.x);
  expect([...arrays[line!.y]!].map((v) => (Number.isNaN(v) ? null : v))).toEqual(wanted.y);
});

test.each([
  ["charts", "light", 1280],
  ["charts", "dark", 390],
  ["servo", "light", 800],
  ["servo", "dark", 390],
  ["run", "light", 390],
  ["check", "dark", 800],
  ["response", "light", 390],
  ["rig", "dark", 390],
  ["track", "light", 390],
  ["study", "dark", 800],
  ["monitor", "light", 390],
  ["identified", "dark", 390],
] as const)("the report %s has no barrier that axe finds (%s, %i pixels)", async (name, colorScheme, width) => {
  const { page, seen } = await open(name, { colorScheme, viewport: { width, height: 900 } });
  expect(await barriers(page)).toEqual([]);
  expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(width);
  expect(seen).toEqual([]);
  await page.close();
});

test("without JavaScript the figures and tables of a report are there", async () => {
  const { page, seen } = await open("charts", { javaScriptEnabled: false });
  expect(await page.locator("figure svg[role=img]").count()).toBe(7); // all but the energy and the matrix, which are tables
  expect(await page.locator("table").count()).toBe(3);
  expect(seen).toEqual([]);
  await page.close();
});

test("the cursor reads all charts over the same quantity, and a zoom shows the same part of them", async () => {
  const { page, seen } = await open("charts");
  const gain = page.getByRole("group", { name: /^Gain/ });
  await gain.focus();
  await page.keyboard.press("ArrowLeft"); // from the middle of 0.1 to 1000 Hz, by a hundredth
  const readings = await page.locator("figure output").allTextContents();
  expect(readings.slice(0, 2)).toEqual(["1.072", "1"]); // 10/x at 9.329 Hz, the sample nearest to 9.120 Hz
  const drawn = (): Promise<string[]> =>
    page.locator("canvas").evaluateAll((all) => all.slice(0, 2).map((c) => (c as HTMLCanvasElement).toDataURL()));
  const whole = await drawn();
  await page.keyboard.press("+");
  await page.waitForTimeout(100);
  const part = await drawn();
  expect(part.map((p, k) => p === whole[k])).toEqual([false, false]);
  await page.keyboard.press("Escape");
  await page.waitForTimeout(100);
  expect(await drawn()).toEqual(whole);
  expect(seen).toEqual([]);
  await page.close();
});

test("a point of a scatter tells its name", async () => {
  const { page } = await open("charts");
  const place = page.getByRole("group", { name: /^Designs/ });
  await place.scrollIntoViewIfNeeded();
  const box = (await place.boundingBox())!;
  const middle = box.x + 66 + (box.width - 66 - 12) / 2; // between the margins of the chart, where the second of three is
  for (let k = 0; k < 40; ++k) {
    await page.mouse.move(middle, box.y + (box.height * k) / 40);
    if (await place.locator(".tip").isVisible()) break;
  }
  expect(await place.locator(".tip").textContent()).toBe("second: cost 1, mass 1");
  await page.close();
});

test("a report is light on paper", async () => {
  const { page } = await open("charts", { colorScheme: "dark" });
  const background = (): Promise<string> =>
    page.evaluate(() => getComputedStyle(document.documentElement).backgroundColor);
  expect(await background()).toBe("rgb(20, 23, 27)");
  await page.evaluate(() => dispatchEvent(new Event("beforeprint")));
  expect(await background()).toBe("rgb(251, 251, 250)");
  await page.close();
});
