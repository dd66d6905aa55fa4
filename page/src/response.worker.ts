/** Works out responses beside the page, one point at a time; a new task takes the place of the present one. */
import { Core, CoreError } from "./core";
import type { CoreInput } from "./core_input";
import { type Point, respond } from "./response";

export interface Task {
  /** with the first task alone */
  core?: ArrayBuffer;
  number: number;
  input: CoreInput;
  variable: string;
  amplitudes: number[];
  frequencies: number[];
}
export interface Answer {
  number: number;
  points: Point[];
  done: boolean;
}

let core: Promise<Core> | undefined;
let newest = 0;

onmessage = async ({ data }: MessageEvent<Task>): Promise<void> => {
  newest = data.number;
  if (data.core) core = Core.load(data.core);
  const loaded = await core!;
  for (const amplitude of data.amplitudes) {
    const points: Point[] = [];
    for (const frequency of data.frequencies) {
      await new Promise((done) => setTimeout(done)); // a new task may come in
      if (data.number !== newest) return;
      try {
        points.push(respond(loaded, data.input, data.variable, amplitude, frequency));
      } catch (error) {
        if (!(error instanceof CoreError)) throw error; // a motion without a continuation: a gap in the line
      }
    }
    const answer: Answer = { number: data.number, points, done: amplitude === data.amplitudes.at(-1) };
    postMessage(answer);
  }
};
