/** What Python writes into the page: what the core takes, what is drawn, and what can be changed. All values in SI. */
import type { CoreInput } from "./core_input";
import { unpacked } from "./wasm";

export interface Description {
  name: string;
  title: string;
  version: string;
  core: CoreInput;
  /** from the first motor on */
  shafts: ShaftView[];
  gears: GearView[];
  motors: MotorView[];
  contacts: { label: string; variable: string; slide: boolean }[];
  /** neither a controller nor the steps of a driver turn its motors, so that a response to its command is drawn */
  open_loop: boolean;
  /** margins of the loops of the controllers, with the values of the file */
  loops: LoopView[];
  /** of controllers, over time */
  figures: { title: string; unit: string; series: { variable: string; minus?: string; label: string }[] }[];
  sliders: Slider[];
  /** the scenario file: tables, lists, numbers, texts */
  scenario: Table;
}

/** Elements with the names of their variables; null: there is none. */
export interface ShaftView {
  name: string;
  speed: string;
  angle: string | null;
  contact: string | null;
  motor: boolean;
  /** moves along a straight line: [m], [m/s] and [N] */
  slide: boolean;
}
export interface GearView {
  name: string;
  input: string;
  output: string;
  ratio: number;
  /** its housing stands, so that the ratio holds between the speeds */
  fixed: boolean;
  twist: string | null;
  output_torque: string;
  /** total, at the output; 0 where there is none */
  backlash: number;
  losses: LossMap | null;
}
/** values[load][speed] of the loss coefficient, over relative speed and load */
export interface LossMap {
  speeds: number[];
  loads: number[];
  values: number[][];
  rated_speed: number;
  rated_torque: number;
}
/** One loop of a controller in one regime of the drive; null where a curve does not cross. */
export interface LoopView {
  loop: string;
  regime: string;
  meaning: string;
  stable: boolean;
  gain_margin: number | null;
  /** [rad] */
  phase_margin: number | null;
  /** [Hz] */
  crossover: number | null;
  sensitivity_peak: number | null;
  bandwidth: number | null;
}
export interface MotorView {
  name: string;
  shaft: string;
  torque: string;
  command: string | null;
}

export interface Slider {
  /** in the scenario file */
  key: string;
  group: string;
  label: string;
  /** as shown, and what one of it is in SI */
  unit: string;
  factor: number;
  value: number;
  min: number;
  max: number;
  /** equal ways on the slider are equal ratios */
  logarithmic: boolean;
  /** a parameter of the core by this key, the duration, or where the number stands in an input or in a reference */
  target:
    | "parameter"
    | "duration"
    | { input: number; path: (string | number)[] }
    | { reference: number; path: (string | number)[] };
  /** where it stands in the description, for what is drawn */
  view?: (string | number)[];
  /** other keys that the scenario file needs with this one */
  needs?: Record<string, number>;
}

export type Value = number | string | boolean | null | Value[] | Table;
export interface Table {
  [key: string]: Value;
}

/** The description in the page. */
export async function read(document: Document): Promise<Description> {
  return JSON.parse(new TextDecoder().decode(await unpacked(document, "description"))) as Description;
}
