// Runs each description of a directory in the WebAssembly module: node webassembly.mjs MODULE DIRECTORY
// Prints the SHA-256 of each variable's samples.
import { createHash } from "node:crypto";
import { readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";

const [, , modulePath, directory] = process.argv;
const { instance } = await WebAssembly.instantiate(readFileSync(modulePath), {});
const core = instance.exports;
core._initialize();

// Views are made anew, since the memory grows.
const text = (at) => {
  const bytes = new Uint8Array(core.memory.buffer);
  return Buffer.from(bytes.subarray(at, bytes.indexOf(0, at))).toString();
};

const told = {};
for (const file of readdirSync(directory).filter((name) => name.endsWith(".bin"))) {
  const description = readFileSync(join(directory, file));
  const at = core.malloc(description.length);
  new Uint8Array(core.memory.buffer).set(description, at);
  const error = core.malloc(1000);
  const scenario = core.lm_scenario_read(at, description.length / 8, error, 1000);
  if (!scenario) throw new Error(`${file}: ${text(error)}`);
  const result = core.lm_scenario_run(scenario, 1, 100000);
  if (!result || core.lm_result_status(result)) throw new Error(`${file}: ${text(core.lm_scenario_error(scenario))}`);
  const samples = core.lm_result_samples(result);
  const digests = {};
  for (let k = 0; k < core.lm_result_count(result, 0); ++k) {
    const values = new Float64Array(core.memory.buffer, core.lm_result_values(result, 0) + 8 * k * samples, samples);
    const own = values.map((v) => (Number.isNaN(v) ? NaN : v)); // one NaN is like another
    digests[text(core.lm_result_name(result, 0, k))] = createHash("sha256").update(new Uint8Array(own.buffer)).digest("hex");
  }
  told[file.replace(/\.bin$/, "")] = digests;
  core.lm_result_free(result);
  core.lm_scenario_free(scenario);
}
console.log(JSON.stringify(told));
