/** Chromium, and pages that may neither ask for anything nor complain. */
import { existsSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { gunzipSync } from "node:zlib";
import axe from "axe-core";
import { type Browser, chromium, type Page } from "playwright-core";
import type { Description } from "../src/description";

const FLAGS = [
  "--no-sandbox",
  "--disable-gpu",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];

export function launch(): Promise<Browser> {
  const executablePath = ["/usr/bin/chromium", "/usr/bin/chromium-browser"].find((path) => existsSync(path));
  if (!executablePath) throw new Error("Chromium is missing: apt-get install chromium");
  return chromium.launch({ executablePath, args: FLAGS });
}

/** A script of a page, by its id. */
function script(file: string, id: string): string {
  return new RegExp(`<script [^>]*id="${id}">(.*?)</script>`, "s").exec(readFileSync(file, "utf-8"))![1]!;
}
export function unpacked(file: string, id: string): Buffer<ArrayBuffer> {
  return Buffer.from(gunzipSync(Buffer.from(script(file, id), "base64")));
}
export function coreOf(file: string): Buffer<ArrayBuffer> {
  return unpacked(file, "core");
}
export function descriptionOf(file: string): Description {
  return JSON.parse(unpacked(file, "description").toString("utf-8")) as Description;
}

export interface Expected {
  changes: Record<string, number>;
  as_it_is: Record<string, (number | null)[]>;
  changed: Record<string, (number | null)[]>;
  explained: { time: number; contacts: (string | number)[][]; motors: (string | number)[][] }[];
  responses: { amplitude: number; frequency: number; re: number; im: number }[];
}
export function expected(directory: string, name: string): Expected {
  return JSON.parse(readFileSync(join(directory, `${name}.json`), "utf-8")) as Expected;
}

/** What a page has said or asked for, which should be nothing. */
export function watch(page: Page): string[] {
  const seen: string[] = [];
  page.on("console", (message) => seen.push(`console: ${message.text()}`));
  page.on("pageerror", (error) => seen.push(`error: ${error.message}`));
  page.on("request", (request) => {
    const url = request.url();
    if (!/^(data|blob):/.test(url) && !url.startsWith("file:///tmp/")) seen.push(`request: ${url}`);
  });
  return seen;
}

/** What axe finds wrong with a page. */
export async function barriers(page: Page): Promise<string[]> {
  await page.evaluate(axe.source);
  const { violations } = await page.evaluate(() => (globalThis as any).axe.run());
  const places = (v: any): string[] => v.nodes.map((n: any) => n.html).slice(0, 3);
  return violations.map((v: any) => `${v.id}: ${places(v).join(" ")}`);
}

/** Waits until the whole run is shown. */
export async function ready(page: Page): Promise<void> {
  await page.waitForFunction(() => performance.getEntriesByName("whole-run").length > 0);
}

/** The samples of the page's CSV file, by variable. */
export async function table(page: Page): Promise<Record<string, number[]>> {
  const [download] = await Promise.all([
    page.waitForEvent("download"),
    page.getByRole("button", { name: "CSV" }).click(),
  ]);
  const [heading, ...rows] = readFileSync(await download.path(), "utf-8")
    .trim()
    .split("\n");
  const names = heading!.split(",").map((name) => name.split(" ")[0]!);
  const columns = rows.map((row) => row.split(",").map(Number));
  return Object.fromEntries(names.map((name, k) => [name, columns.map((row) => row[k]!)]));
}
