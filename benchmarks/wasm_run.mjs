// Runs a description in a core of the live page in Chromium, and prints the least time of a run [ms], each the mean of
// as many as take 20 ms, since the clock of a page is coarse: node wasm_run.mjs CORE.wasm DESCRIPTION.bin REPEATS
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const [, , module, file, repeats] = process.argv;
const { chromium } = createRequire(new URL("../page/package.json", import.meta.url))("playwright-core");
const browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox", "--disable-gpu"] });
const page = await browser.newPage();
const given = [module, file].map((path) => readFileSync(path).toString("base64"));
const best = await page.evaluate(
  async ([code, numbers, count]) => {
    const [binary, bytes] = [code, numbers].map((text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)));
    const core = (await WebAssembly.instantiate(binary, {})).instance.exports;
    core._initialize();
    const at = core.malloc(bytes.length);
    new Uint8Array(core.memory.buffer).set(bytes, at);
    const scenario = core.lm_scenario_read(at, bytes.length / 8, core.malloc(1000), 1000);
    let least = Infinity;
    for (let k = 0; k < count; ++k) {
      await new Promise((done) => setTimeout(done)); // the faster code of the browser may come in
      const begun = performance.now();
      let [runs, passed] = [0, 0];
      for (; passed < 20; ++runs, passed = performance.now() - begun) core.lm_result_free(core.lm_scenario_run(scenario, 1, 0));
      least = Math.min(least, passed / runs);
    }
    return least;
  },
  [...given, Number(repeats)],
);
await browser.close();
console.log(best);
