// Opens a live page in Chromium and prints, each as the least of several [ms], the time until its first charts are
// shown, until the whole run is, and the median time of a frame while a slider moves in each: node first_plot.mjs PAGE.html
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const { chromium } = createRequire(new URL("../page/package.json", import.meta.url))("playwright-core");
const browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox", "--disable-gpu"] });
let [first, whole, frame] = [Infinity, Infinity, Infinity];
for (let round = 0; round < 5; ++round) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 900 } });
  await page.goto(pathToFileURL(process.argv[2]).href);
  await page.waitForFunction(() => ["first-plot", "whole-run"].every((m) => performance.getEntriesByName(m).length > 0));
  const times = await page.evaluate(async () => {
    const slider = document.querySelector('input[type="range"][id]');
    const next = () => new Promise((done) => requestAnimationFrame(done));
    const at = [await next()];
    for (let k = 0; k < 100; ++k) {
      slider.value = String(300 + ((k * 7) % 400));
      slider.dispatchEvent(new Event("input"));
      at.push(await next());
    }
    const frames = at.slice(1).map((t, k) => t - at[k]).sort((a, b) => a - b);
    return [...["first-plot", "whole-run"].map((m) => performance.getEntriesByName(m)[0].startTime), frames[50]];
  });
  first = Math.min(first, times[0]);
  whole = Math.min(whole, times[1]);
  frame = Math.min(frame, times[2]);
  await page.close();
}
await browser.close();
console.log(`${first} ${whole} ${frame}`);
