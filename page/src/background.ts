/** Tasks of the page that a worker computes in the background. Of each kind the newest task counts; while one runs, only the last of those that wait is kept. */
import type { Answer, Numbered, Task } from "./background.worker";
import BackgroundWorker from "./background.worker?worker&inline";

type Kind = "run" | "explanation" | "response";
type Take = (answer: Answer) => void;
interface Asked {
  task: Task;
  take: Take;
}

export class Background {
  private worker?: Worker;
  private number = 0;
  private readonly running = new Map<Kind, { number: number; take: Take }>();
  private readonly waiting = new Map<Kind, Asked>();

  constructor(private readonly bytes: ArrayBuffer) {}

  /** take: is called with each answer, unless a newer task of the same kind has come in. */
  ask(task: Task & { kind: Kind }, take: Take): void {
    if (task.kind !== "response" && this.running.has(task.kind)) this.waiting.set(task.kind, { task, take });
    else this.begin(task.kind, { task, take });
  }

  private begin(kind: Kind, { task, take }: Asked): void {
    this.worker ??= this.launched();
    this.number += 1;
    this.running.set(kind, { number: this.number, take });
    this.post(task);
  }

  private launched(): Worker {
    const worker = new BackgroundWorker();
    worker.onmessage = ({ data: { number, content } }: MessageEvent<Numbered<Answer>>) => {
      const kind = content.kind === "failure" ? content.of : content.kind;
      const asked = this.running.get(kind);
      if (asked?.number !== number) return;
      if (content.kind === "response" && !content.done) return asked.take(content);
      this.running.delete(kind);
      const next = this.waiting.get(kind);
      this.waiting.delete(kind);
      if (next) this.begin(kind, next);
      asked.take(content);
    };
    const message: Numbered<Task> = { number: 0, content: { kind: "core", bytes: this.bytes } };
    worker.postMessage(message);
    return worker;
  }

  private post(task: Task): void {
    const message: Numbered<Task> = { number: this.number, content: task };
    this.worker!.postMessage(message);
  }
}
