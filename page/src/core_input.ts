/** What the core takes: the description of a scenario, and what is changed in it. All values in SI. */

export interface CoreInput {
  /** the numbers of lostmotion.portable.description: doubles, lowest byte first, in base64 */
  numbers: string;
  /** of the same scenario with a gap where it has none, which is another torsion curve: taken while the key has a value above 0 */
  with_gap: { key: string; numbers: string } | null;
  /** commands and load torques, in the order of the core */
  inputs: Signal[];
  /** of sampled controllers, in the order of the core; null: the page cannot change it */
  references: (Reference | null)[];
  duration: number;
  interval: number;
  /** parameters that are changed, by their keys */
  values: Record<string, number>;
  /** numbers of the inputs, and of the references, that are changed */
  changed_inputs: number[];
  changed_references: number[];
}

/** The sum of all that is given. */
export interface Signal {
  mean: number;
  /** amplitude, frequency [Hz], phase [rad] */
  sines: [number, number, number][];
  /** height, time */
  steps: [number, number][];
  /** rise, duration, begin */
  ramps: [number, number, number][];
  /** other courses: each (time, value, derivatives) from a time on */
  courses: number[][][];
}

export interface Reference extends Signal {
  moves: Moves | null;
}

/** From rest to rest; what a move does not have (null) is that of all. */
export interface Moves {
  start: number;
  begin: number;
  speed: number | null;
  acceleration: number | null;
  /** null for all: without limit */
  jerk: number | null;
  dwell: number;
  moves: {
    to: number;
    speed: number | null;
    acceleration: number | null;
    jerk: number | null;
    dwell: number | null;
  }[];
}
