/** Chromium, and pages that may neither ask for anything nor complain. */
import { execFileSync } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { type Browser, chromium, type Page } from "playwright-core";

const root = fileURLToPath(new URL("../..", import.meta.url));
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

/** A directory with the pages of pages.py and the samples of Python. */
export function pages(): string {
  const directory = mkdtempSync(join(tmpdir(), "lostmotion-page-"));
  execFileSync(join(root, ".venv/bin/python"), [join(root, "page/tests/pages.py"), directory], { stdio: "inherit" });
  return directory;
}

export interface Expected {
  changes: Record<string, number>;
  as_it_is: Record<string, (number | null)[]>;
  changed: Record<string, (number | null)[]>;
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

/** Waits until the first charts are drawn. */
export async function ready(page: Page): Promise<void> {
  await page.waitForFunction(() => performance.getEntriesByName("first-plot").length > 0);
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
