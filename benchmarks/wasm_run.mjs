// Runs a description in a core of the live page, and prints the least time of a run [ms]:
// node wasm_run.mjs CORE.wasm DESCRIPTION.bin REPEATS
import { readFileSync } from "node:fs";

const [, , module, file, repeats] = process.argv;
const { instance } = await WebAssembly.instantiate(readFileSync(module), {});
const core = instance.exports;
core._initialize();
const bytes = readFileSync(file);
const at = core.malloc(bytes.length);
new Uint8Array(core.memory.buffer).set(bytes, at);
const scenario = core.lm_scenario_read(at, bytes.length / 8, core.malloc(1000), 1000);
let best = Infinity;
for (let k = 0; k < Number(repeats); ++k) {
  const begun = performance.now();
  core.lm_result_free(core.lm_scenario_run(scenario, 1, 0));
  best = Math.min(best, performance.now() - begun);
}
console.log(best);
