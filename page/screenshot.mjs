// Draws docs/images/live.png: `lostmotion live position-axis -o out/axis.html && node page/screenshot.mjs out/axis.html`.
import { resolve } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const [file] = process.argv.slice(2);
if (!file) throw new Error("name the live page: node page/screenshot.mjs out/axis.html");
const browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox"] });
const page = await browser.newPage({ viewport: { width: 1440, height: 900 } });
await page.goto(pathToFileURL(resolve(file)).href);
await page.waitForTimeout(8000); // The axis is on its way back then.
await page.screenshot({ path: fileURLToPath(new URL("../docs/images/live.png", import.meta.url)) });
await browser.close();
