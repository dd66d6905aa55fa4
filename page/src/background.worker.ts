/** Worker in the background of the page, for what would hold it up: long runs, explanations, and responses one point at a time. */
import { Core, CoreError, type Explanation, type Run } from "./core";
import type { CoreInput } from "./core_input";
import { type Point, respond } from "./response";

export type Task =
  | { kind: "core"; bytes: ArrayBuffer }
  | { kind: "run"; input: CoreInput }
  | { kind: "explanation"; input: CoreInput; time: number }
  | { kind: "response"; input: CoreInput; variable: string; amplitudes: number[]; frequencies: number[] };

export type Answer =
  | { kind: "run"; run: Run }
  | { kind: "explanation"; time: number; explanation: Explanation }
  | { kind: "response"; points: Point[]; done: boolean }
  /** the sentence of the core */
  | { kind: "failure"; of: "run" | "explanation"; message: string };

export interface Numbered<Content> {
  number: number;
  content: Content;
}

let core: Promise<Core> | undefined;
let newest = 0; // response

function answer(number: number, content: Answer): void {
  const message: Numbered<Answer> = { number, content };
  postMessage(message);
}

onmessage = async ({ data: { number, content: task } }: MessageEvent<Numbered<Task>>): Promise<void> => {
  if (task.kind === "core") {
    core = Core.load(task.bytes);
    return;
  }
  if (task.kind === "response") newest = number;
  const loaded = await core!;
  if (task.kind === "response") return respondAll(loaded, number, task);
  try {
    if (task.kind === "run") answer(number, { kind: "run", run: loaded.run(task.input) });
    else {
      const explanation = loaded.explain(task.input, task.time);
      answer(number, { kind: "explanation", time: task.time, explanation });
    }
  } catch (error) {
    if (!(error instanceof CoreError)) throw error;
    answer(number, { kind: "failure", of: task.kind, message: error.message });
  }
};

async function respondAll(loaded: Core, number: number, task: Task & { kind: "response" }): Promise<void> {
  for (const amplitude of task.amplitudes) {
    const points: Point[] = [];
    for (const frequency of task.frequencies) {
      await new Promise((done) => setTimeout(done)); // another task may come in
      if (number !== newest) return;
      try {
        points.push(respond(loaded, task.input, task.variable, amplitude, frequency));
      } catch (error) {
        if (!(error instanceof CoreError)) throw error; // a motion without a continuation: a gap in the line
      }
    }
    answer(number, { kind: "response", points, done: amplitude === task.amplitudes.at(-1) });
  }
}
