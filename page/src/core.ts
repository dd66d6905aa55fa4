/** The core, compiled to WebAssembly, behind its C interface (bindings/c/lostmotion.h). */
import type { CoreInput, Reference, Signal } from "./core_input";
import { course } from "./moves";
import { breakpoints, sines } from "./signals";

/** Samples of all variables of one run, its energies and its switchings. */
export interface Run {
  time: Float64Array;
  values: Map<string, Float64Array>;
  units: Map<string, string>;
  /** [J] by name */
  energies: Map<string, number>;
  switchings: number;
  /** how long the core took */
  milliseconds: number;
}

/** Torques [N·m] at a dry contact, as `lm.explain` has them. */
export interface ContactState {
  name: string;
  /** -1 slips backward, 0 stuck, 1 slips forward */
  mode: number;
  /** [rad/s] */
  speed: number;
  /** held, or while slipping taken */
  torque: number;
  /** it holds torques up to this, and down to minus that */
  forward: number;
  backward: number;
}
/** Constant commands from which on a motor turns its shaft; of a drive in the short form, its load. */
export interface MotorState {
  name: string;
  forward: number;
  backward: number;
}
export interface Explanation {
  contacts: ContactState[];
  motors: MotorState[];
}

/** The sentence that Python would give. */
export class CoreError extends Error {}

type Call = (...values: number[]) => number;
const [SAMPLES, ENERGIES] = [0, 1]; // lm_part
const [CONTACTS, MOTORS] = [0, 1]; // lm_explained
const MESSAGE = 1000; // bytes for an error

export class Core {
  private readonly calls: Record<string, Call>;
  private readonly memory: WebAssembly.Memory;
  private taken: number[] = [];

  static async load(bytes: BufferSource): Promise<Core> {
    return new Core((await WebAssembly.instantiate(bytes, {})).instance);
  }

  constructor(instance: WebAssembly.Instance) {
    const { memory, ...calls } = instance.exports;
    this.memory = memory as WebAssembly.Memory;
    this.calls = calls as Record<string, Call>;
    this.call("_initialize");
  }

  /** Runs the scenario; nothing of it stays in the core. */
  run(input: CoreInput): Run {
    const begun = performance.now();
    return this.with(input, (scenario) => {
      const result = this.call("lm_scenario_run", scenario, 1, 0);
      if (result === 0) throw this.error("lm_scenario_error", scenario);
      try {
        if (this.call("lm_result_status", result) !== 0) throw this.error("lm_result_error", result);
        return this.taken_out(result, input, begun);
      } finally {
        this.call("lm_result_free", result);
      }
    });
  }

  /** What holds each contact at an instant of the run. */
  explain(input: CoreInput, time: number): Explanation {
    // The interval of lm.explain, so that the bits are the same.
    return this.with({ ...input, interval: 1e-3 }, (scenario) => {
      const found = this.call("lm_scenario_explain", scenario, time);
      if (found === 0) throw this.error("lm_scenario_error", scenario);
      const rows = <Row>(what: number, row: (name: string, values: Float64Array) => Row): Row[] =>
        Array.from({ length: this.call("lm_explanation_count", found, what) }, (_, k) =>
          row(
            this.text(this.call("lm_explanation_name", found, what, k)),
            this.numbers(this.call("lm_explanation_values", found, what, k), 5),
          ),
        );
      const contacts = rows(CONTACTS, (name, [mode, speed, torque, forward, backward]) => ({
        name,
        mode: mode!,
        speed: speed!,
        torque: torque!,
        forward: forward!,
        backward: backward!,
      }));
      const motors = rows(MOTORS, (name, [forward, backward]) => ({ name, forward: forward!, backward: backward! }));
      this.call("lm_explanation_free", found);
      return { contacts, motors };
    });
  }

  private with<Found>(input: CoreInput, use: (scenario: number) => Found): Found {
    let scenario = 0;
    try {
      scenario = this.read(input);
      return use(scenario);
    } finally {
      this.call("lm_scenario_free", scenario);
      for (const address of this.taken) this.call("free", address);
      this.taken = [];
    }
  }

  private read(input: CoreInput): number {
    const { with_gap: gap } = input;
    const packed = gap && (input.values[gap.key] ?? 0) > 0 ? gap.numbers : input.numbers;
    const numbers = unpacked(packed);
    const message = this.reserve(MESSAGE);
    const scenario = this.call("lm_scenario_read", this.doubles(numbers), numbers.length, message, MESSAGE);
    if (scenario === 0) throw new CoreError(this.text(message));
    try {
      this.change(scenario, input);
      return scenario;
    } catch (error) {
      this.call("lm_scenario_free", scenario);
      throw error;
    }
  }

  private change(scenario: number, input: CoreInput): void {
    const must = (status: number): void => {
      if (status !== 0) throw this.error("lm_scenario_error", scenario);
    };
    const count = this.call("lm_scenario_parameter_count", scenario);
    for (let k = 0; k < count && Object.keys(input.values).length > 0; ++k) {
      const value = input.values[this.text(this.call("lm_scenario_parameter_key", scenario, k))];
      if (value !== undefined) must(this.call("lm_scenario_set", scenario, k, value));
    }
    for (const k of input.changed_inputs)
      must(this.call("lm_scenario_set_signal", scenario, k, this.signal(input.inputs[k]!)));
    for (const k of input.changed_references)
      must(this.call("lm_scenario_set_reference", scenario, k, ...this.reference(input.references[k]!)));
    must(this.call("lm_scenario_set_times", scenario, input.duration, input.interval));
  }

  private taken_out(result: number, { interval, duration }: CoreInput, begun: number): Run {
    const samples = this.call("lm_result_samples", result);
    const names = this.names(result, SAMPLES);
    const all = this.numbers(this.call("lm_result_values", result, SAMPLES), names.length * samples).slice();
    const energies = this.names(result, ENERGIES);
    const joules = this.numbers(this.call("lm_result_values", result, ENERGIES), energies.length);
    return {
      time: Float64Array.from({ length: samples }, (_, k) =>
        k * interval > duration * (1 + 1e-12) ? duration : k * interval,
      ),
      values: new Map(names.map((name, k) => [name, all.subarray(k * samples, (k + 1) * samples)])),
      units: new Map(names.map((name, k) => [name, this.text(this.call("lm_result_unit", result, k))])),
      energies: new Map(energies.map((name, k) => [name, joules[k]!])),
      switchings: this.call("lm_result_switching_count", result),
      milliseconds: performance.now() - begun,
    };
  }

  private names(result: number, part: number): string[] {
    const count = this.call("lm_result_count", result, part);
    return Array.from({ length: count }, (_, k) => this.text(this.call("lm_result_name", result, part, k)));
  }

  /** lm_signal, for 32 bit addresses */
  private signal(of: Signal): number {
    const address = this.reserve(16);
    const words = [...this.table(breakpoints(of)), ...this.table(sines(of))];
    new Uint32Array(this.memory.buffer, address, 4).set(words);
    return address;
  }
  private reference(of: Reference): number[] {
    const moves = of.moves === null ? [] : [course(of.moves)];
    const pieces = breakpoints({ ...of, courses: [...of.courses, ...moves] }, 3);
    return [...this.table(pieces), ...this.table(sines(of))];
  }
  /** Address and number of rows. */
  private table(rows: number[][]): [number, number] {
    return [this.doubles(rows.flat()), rows.length];
  }

  // --- memory, freed at the end of a run; views are made anew, since it grows ---

  private reserve(bytes: number): number {
    const address = this.call("malloc", Math.max(8, bytes));
    if (address === 0) throw new CoreError("there is no memory for this run; shorten it");
    this.taken.push(address);
    return address;
  }
  private doubles(values: ArrayLike<number>): number {
    const address = this.reserve(8 * values.length);
    this.numbers(address, values.length).set(values);
    return address;
  }
  private numbers(address: number, count: number): Float64Array {
    return new Float64Array(this.memory.buffer, address, count);
  }
  private text(address: number): string {
    const bytes = new Uint8Array(this.memory.buffer, address);
    return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
  }
  private error(of: string, object: number): CoreError {
    return new CoreError(this.text(this.call(of, object)));
  }
  private call(name: string, ...values: number[]): number {
    const called = this.calls[name];
    if (!called) throw new CoreError(`the core has no function ${name}`);
    return called(...values);
  }
}

const kept = new Map<string, Float64Array>();

/** Doubles out of base64; each text is decoded once. */
function unpacked(packed: string): Float64Array {
  let numbers = kept.get(packed);
  if (!numbers) {
    const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
    numbers = new Float64Array(bytes.buffer);
    kept.set(packed, numbers);
  }
  return numbers;
}
