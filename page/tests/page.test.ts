import { readFileSync, statSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { execFileSync } from "node:child_process";
import { fileURLToPath } from "node:url";
import type { Browser, BrowserContextOptions, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, inject, test } from "vitest";
import { barriers, descriptionOf, expected, launch, ready, table, watch } from "./browser";

let browser: Browser;
const directory = inject("directory");
beforeAll(async () => {
  browser = await launch();
});
afterAll(() => browser?.close());

/** A page that must stay silent, opened as by a double click. */
async function open(
  name: string,
  options: BrowserContextOptions = {},
  fragment = "",
): Promise<{ page: Page; seen: string[] }> {
  const page = await browser.newPage({ viewport: { width: 1280, height: 900 }, reducedMotion: "reduce", ...options });
  const seen = watch(page);
  await page.goto(`file://${join(directory, `${name}.html`)}${fragment}`);
  await ready(page);
  return { page, seen };
}

function compare(found: Record<string, number[]>, wanted: Record<string, (number | null)[]>): void {
  const different = Object.entries(wanted).filter(
    ([name, values]) => !values.every((v, k) => Object.is(found[name]?.[k], v ?? NaN)),
  );
  expect(different.map(([name]) => name)).toEqual([]);
}

describe.each(["drive", "worm", "axis"])("the page of the %s", (name) => {
  test("has the same bits as Python, as it is and with changed values, and says and asks nothing", async () => {
    const wanted = expected(directory, name);
    const plain = await open(name);
    compare(await table(plain.page), wanted.as_it_is);
    const fragment = `#${Object.entries(wanted.changes)
      .map(([key, value]) => `${key}=${value}`)
      .join("&")}`;
    const changed = await open(name, {}, fragment);
    compare(await table(changed.page), wanted.changed);
    expect([...plain.seen, ...changed.seen]).toEqual([]);
    await plain.page.close();
    await changed.page.close();
  });
});

test.each([
  ["drive", "light", 1280],
  ["drive", "dark", 1280],
  ["drive", "light", 390],
  ["axis", "dark", 390],
] as const)("the page of the %s has no barrier that axe finds (%s, %i pixels)", async (name, colorScheme, width) => {
  const { page, seen } = await open(name, { colorScheme, viewport: { width, height: 900 } });
  expect(await barriers(page)).toEqual([]);
  expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(width);
  expect(seen).toEqual([]);
  await page.close();
});

test("a slider moved by the keyboard changes the run, the address and the file that Python reads", async () => {
  const { page, seen } = await open("drive");
  const before = await table(page);
  await page.getByRole("slider", { name: "friction torque" }).first().focus();
  for (let k = 0; k < 5; ++k) await page.keyboard.press("PageUp");
  await page.waitForFunction(() => location.hash.includes("motor.friction_torque="));
  const [download] = await Promise.all([
    page.waitForEvent("download"),
    page.getByRole("button", { name: "TOML" }).click(),
  ]);
  const file = join(directory, "downloaded.toml");
  writeFileSync(file, readFileSync(await download.path()));
  const script =
    "import sys, json, lostmotion as lm; print(json.dumps(lm.simulate(lm.load(sys.argv[1])).load_speed.values.tolist()))";
  const python = fileURLToPath(new URL("../../.venv/bin/python", import.meta.url));
  const expected = JSON.parse(execFileSync(python, ["-c", script, file], { encoding: "utf-8" }));
  expect(expected).not.toEqual(before.load_speed);
  await expect.poll(async () => (await table(page)).load_speed, { timeout: 30_000 }).toEqual(expected);
  expect(seen).toEqual([]);
  await page.close();
});

test("why it stands still is told for the instant shown, and follows a slider", async () => {
  const { page, seen } = await open("drive");
  const time = page.getByRole("slider", { name: "Time", exact: true });
  const answer = page.locator(".stand .answer");
  await time.fill("25");
  await page.waitForFunction(() => /^Stuck at 0.05 s: /.test(document.querySelector(".stand .answer")!.textContent!));
  expect(await answer.textContent()).toBe("Stuck at 0.05 s: motor, gearbox twist.");
  expect(await page.locator(".stand li").first().textContent()).toMatch(
    /^motor: stuck, holds .* mN·m more frees it forward, .* backward$/,
  );
  const field = page.getByRole("textbox", { name: "friction torque, mN·m" }).first();
  await field.fill("0");
  await field.press("Enter");
  await page.waitForFunction(() => !/motor/.test(document.querySelector(".stand .answer")!.textContent!));
  expect(seen).toEqual([]);
  await page.close();
});

test("a long run is worked out beside the page, which moves on meanwhile", async () => {
  const { page, seen } = await open("axis", {}, "#simulation.duration=13");
  const frames = await page.evaluate(async () => {
    const slider = document.querySelector<HTMLInputElement>('[id="controller.position.gain"]')!;
    const text = document.getElementById("summary")!.textContent;
    slider.value = "620";
    slider.dispatchEvent(new Event("input"));
    let frames = 0; // a run in the page itself would end within the first
    for (; document.getElementById("summary")!.textContent === text; ++frames) await new Promise(requestAnimationFrame);
    return frames;
  });
  expect(frames).toBeGreaterThan(2);
  expect(seen).toEqual([]);
  await page.close();
});

test("the margins of the loops are those of the file, and the page says when sliders differ from it", async () => {
  const { page, seen } = await open("axis");
  const rows = page.locator("table tbody tr");
  const { loops } = descriptionOf(join(directory, "axis.html"));
  expect(await rows.count()).toBe(loops.length);
  const note = page.locator("figure:has(table) .entry");
  expect(await note.textContent()).toMatch(/^exact/);
  await page.locator('[id="controller.position.gain"]').fill("700");
  await page.waitForFunction(() =>
    /lostmotion servo$/.test(document.querySelector("figure:has(table) .entry")!.textContent!),
  );
  expect(seen).toEqual([]);
  await page.close();
});

test("a pinned run stays in the charts, which are downloaded as a picture", async () => {
  const { page, seen } = await open("drive");
  const picture = async (): Promise<Buffer> => {
    const [download] = await Promise.all([
      page.waitForEvent("download"),
      page.getByRole("button", { name: "PNG" }).click(),
    ]);
    return readFileSync(await download.path());
  };
  const alone = await picture();
  expect(alone.subarray(1, 4).toString()).toBe("PNG");
  await page.getByRole("button", { name: "Pin" }).click();
  await page.locator('[id="load.inertia"]').fill("800");
  await page.waitForFunction(() => location.hash.includes("load.inertia="));
  const both = await picture();
  await page.getByRole("button", { name: "Pin" }).click();
  const changed = await picture();
  expect(both.equals(alone)).toBe(false);
  expect(both.equals(changed)).toBe(false);
  expect(seen).toEqual([]);
  await page.close();
});

test("it plays by itself, but not where little motion is wanted", async () => {
  const still = await open("drive");
  expect(await still.page.getByRole("button", { name: "Play" }).count()).toBe(1);
  const { page } = await open("drive", { reducedMotion: "no-preference" });
  await page.waitForFunction(() => Number(document.querySelector<HTMLInputElement>("#player input")!.value) > 0);
  await page.getByRole("button", { name: "Pause" }).press("Enter");
  expect(await page.getByRole("button", { name: "Play" }).count()).toBe(1);
  await still.page.close();
  await page.close();
});

test("a slide runs along its rail as far as the run takes it", async () => {
  const { page } = await open("slide");
  const offset = (): Promise<number> =>
    page.evaluate(() => {
      const moving = document.querySelector(".pointer")!.parentElement!;
      return Number(/translate\((\S+) /.exec(moving.getAttribute("transform")!)![1]);
    });
  const scrubber = page.locator("#player input");
  await scrubber.focus();
  await page.keyboard.press("Home");
  expect(await offset()).toBeCloseTo(-40, 0); // The axis begins at one end of its travel.
  await page.keyboard.press("End");
  expect(await offset()).toBeCloseTo(40, 0); // After the first move it is at the other.
  await page.close();
});

test("lines of one chart differ without colour, too", async () => {
  const { page } = await open("worm");
  const looks = await page.evaluate(() =>
    [...document.querySelectorAll("#time-charts figure")].map((figure) =>
      [...figure.querySelectorAll(".swatch line")].map(
        (line) => `${line.getAttribute("stroke-width")} ${line.getAttribute("stroke-dasharray")}`,
      ),
    ),
  );
  expect(looks.some((lines) => lines.length > 2)).toBe(true);
  for (const lines of looks) expect(new Set(lines).size).toBe(lines.length);
  await page.close();
});

test("a value out of the slider's range is marked and changes nothing", async () => {
  const { page } = await open("drive");
  const field = page.getByRole("textbox", { name: /^efficiency|^hysteresis efficiency/ }).first();
  await field.fill("7");
  await field.press("Enter");
  expect(await field.getAttribute("aria-invalid")).toBe("true");
  expect(new URL(page.url()).hash).toBe("");
  await page.close();
});

test("what an address holds that the drive does not know is said", async () => {
  const { page } = await open("drive", {}, "#load.mass=3");
  expect(await page.textContent("#summary")).toContain("load.mass=3");
  await page.close();
});

test("in a frame without an address, as in a notebook, it says what is changed", async () => {
  const page = await browser.newPage({ reducedMotion: "reduce" });
  const seen = watch(page);
  await page.setContent('<iframe style="width: 1000px; height: 700px"></iframe>');
  await page.evaluate(
    (html) => {
      const heard: unknown[] = ((window as any).heard = []);
      addEventListener("message", (event) => heard.push(event.data));
      document.querySelector("iframe")!.srcdoc = html;
    },
    readFileSync(join(directory, "drive.html"), "utf-8"),
  );
  const field = page.frameLocator("iframe").getByRole("textbox", { name: "ratio, number" });
  await field.fill("75");
  await field.press("Enter");
  await page.waitForFunction(() => (window as any).heard.length > 0);
  const { values, scenario } = await page.evaluate(() => (window as any).heard.at(-1).lostmotion);
  expect([values, scenario.gearbox.ratio]).toEqual([{ "gearbox.ratio": 75 }, 75]);
  expect(seen).toEqual([]);
  await page.close();
});

/** Milliseconds from frame to frame while a slider moves in each of them: of as many as 15 seconds hold, at most. */
async function frames(page: Page, count: number): Promise<number[]> {
  return page.evaluate(async (n) => {
    const slider = document.querySelector<HTMLInputElement>('input[type="range"][id="load.inertia"]')!;
    const next = (): Promise<number> => new Promise((done) => requestAnimationFrame(done));
    const times = [await next()];
    for (let k = 0; k < n && (k === 0 || times[k]! - times[0]! < 15_000); ++k) {
      slider.value = String(300 + ((k * 7) % 400));
      slider.dispatchEvent(new Event("input"));
      times.push(await next());
    }
    return times.slice(1).map((t, k) => t - times[k]!);
  }, count);
}

test("of a long run the beginning is shown until the whole is there", async () => {
  const page = await browser.newPage({ viewport: { width: 1280, height: 900 }, reducedMotion: "reduce" });
  const seen = watch(page);
  // What the page asks its worker waits until it is released.
  await page.addInitScript(() => {
    const held: (() => void)[] = [];
    const post = Worker.prototype.postMessage;
    Worker.prototype.postMessage = function (...message: [any]) {
      held.push(() => post.apply(this, message));
    };
    (window as any).release = () => {
      Worker.prototype.postMessage = post;
      for (const go of held) go();
    };
  });
  await page.goto(`file://${join(directory, "long.html")}`);
  await page.waitForFunction(() => performance.getEntriesByName("first-plot").length > 0);
  expect(await page.textContent("#summary")).toMatch(/^the first [\d.]+ s; the rest is being solved$/);
  const drawn = (): Promise<number> =>
    page.evaluate(async () => {
      const canvas = document.querySelector<HTMLCanvasElement>("#strip canvas")!;
      const { width, height } = canvas;
      const copy = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true })!;
      copy.drawImage(await createImageBitmap(canvas), 0, 0);
      const { data } = copy.getImageData(width >> 1, 0, width >> 1, height);
      return data.filter((v, k) => k % 4 === 3 && v > 0).length;
    });
  const before = await drawn();
  await page.evaluate(() => (window as any).release());
  await ready(page);
  expect(await page.textContent("#summary")).toContain("30 s,");
  expect(await drawn()).toBeGreaterThan(before);
  expect((await table(page)).time!.at(-1)).toBeCloseTo(30, 9);
  expect(seen).toEqual([]);
  await page.close();
});

test("figures: size, time to the first plot, and frames while a slider moves (printed, not judged)", async () => {
  const kilobytes = statSync(join(directory, "drive.html")).size / 1e3;
  const { page } = await open("drive", { reducedMotion: "no-preference" });
  const first = await page.evaluate(() => performance.getEntriesByName("first-plot")[0]!.startTime);
  const client = await page.context().newCDPSession(page);
  const report = [`page ${kilobytes.toFixed(0)} kB, first plot ${first.toFixed(0)} ms`];
  for (const slower of [1, 4]) {
    await client.send("Emulation.setCPUThrottlingRate", { rate: slower });
    const all = await frames(page, 120);
    const times = all.slice(Math.floor(all.length / 6)).sort((a, b) => a - b);
    const [median, high] = [0.5, 0.95].map((share) => times[Math.floor(share * times.length)]!) as [number, number];
    report.push(`processor / ${slower}: frame ${median.toFixed(1)} ms, 95 % within ${high.toFixed(1)} ms`);
    expect(median).toBeGreaterThan(0);
  }
  console.log(report.join("; "));
  await page.close();
});
