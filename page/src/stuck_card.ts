/** Why does it stand still? What holds each contact at the instant shown, and what would free it. */
import type { Background } from "./background";
import type { Answer } from "./background.worker";
import type { ContactState, Explanation, MotorState, Run } from "./core";
import type { CoreInput } from "./core_input";
import type { Description } from "./description";
import { h, svg } from "./dom";
import { words } from "./kinematics";
import { format, shown, SLIDING, TURNING } from "./units";

const PATIENCE = 150; // ms between two questions while the instant moves
const [WIDTH, HEIGHT, SIDE] = [300, 21, 8]; // of a bar, with room at both ends

export class StuckCard {
  private readonly answer = h("p", { class: "answer", "aria-live": "polite" });
  private readonly list = h("ul", { class: "contacts" });
  private input?: CoreInput;
  private run?: Run;
  private commands = new Map<string, string | null>();
  private labels = new Map<string, string>();
  private slides = new Set<string>();
  private waiting = 0;
  private time = 0;
  private asked = -1;

  constructor(
    root: HTMLElement,
    private readonly background: Background,
  ) {
    const caption = h("figcaption", {}, h("b", {}, "Why does it stand still?"));
    root.append(h("figure", { class: "stand" }, caption, this.answer, this.list));
  }

  /** After a change of the drive. */
  use(d: Description, run: Run): void {
    this.input = d.core;
    this.run = run;
    this.commands = new Map(d.motors.map((m) => [m.name, m.command]));
    this.labels = new Map(d.contacts.map((c) => [c.variable, c.label]));
    this.slides = new Set(d.contacts.filter((c) => c.slide).map((c) => this.labels.get(c.variable)!));
    this.asked = -1;
    this.mark(this.time);
  }

  /** The instant shown. */
  mark(time: number): void {
    this.time = time;
    if (this.waiting === 0) this.waiting = window.setTimeout(() => this.ask(), PATIENCE);
  }

  private ask(): void {
    this.waiting = 0;
    const [input, time] = [this.input, this.time];
    if (!input || time === this.asked) return;
    this.asked = time;
    this.background.ask({ kind: "explanation", input, time }, (answer) => this.take(answer));
  }

  private take(answer: Answer): void {
    if (answer.kind === "explanation") this.show(answer.explanation);
    else this.list.replaceChildren();
  }

  private commandOf(motor: string): number | undefined {
    const variable = this.commands.get(motor);
    const values = variable ? this.run?.values.get(variable) : undefined;
    return values?.[Math.min(values.length - 1, Math.round(this.asked / this.input!.interval))];
  }

  private show({ contacts, motors }: Explanation): void {
    const named = contacts.map((c) => ({ ...c, name: this.labels.get(c.name) ?? words(c.name) }));
    const stuck = named.filter((c) => c.mode === 0 && Number.isFinite(c.forward));
    const at = `${format(this.asked, 4)} s`;
    this.answer.textContent =
      stuck.length === 0 ? `Nothing stands still at ${at}.` : `Stuck at ${at}: ${stuck.map((c) => c.name).join(", ")}.`;
    this.list.replaceChildren(
      ...named.map((c) =>
        h("li", {}, ...bar(c), h("b", {}, c.name), `: ${contact(c, this.slides.has(c.name) ? SLIDING : TURNING)}`),
      ),
      ...motors
        .filter((m) => this.commandOf(m.name) !== undefined || !Number.isNaN(m.forward)) // no stepper, which follows its field
        .map((m) => h("li", {}, motor(m, this.commandOf(m.name), motors.length > 1))),
    );
  }
}

/** What is true of a contact, as `lm.explain` says it. */
export function contact(c: ContactState, { speed, torque } = TURNING): string {
  if (c.mode !== 0)
    return `slips ${c.mode > 0 ? "forward" : "backward"} at ${withUnit(speed, c.speed)} and takes ${withUnit(torque, Math.abs(c.torque))}`;
  if (!Number.isFinite(c.forward)) return `rigid, holds ${withUnit(torque, c.torque)}`;
  return (
    `stuck, holds ${withUnit(torque, c.torque)} of +${withUnit(torque, c.forward)} / −${withUnit(torque, c.backward)}; ` +
    `${withUnit(torque, c.forward - c.torque)} more frees it forward, ${withUnit(torque, c.backward + c.torque)} backward`
  );
}

/** From rest, at the present torques of the gears. now: its present command, where there is one. */
export function motor({ name, forward, backward }: MotorState, now: number | undefined, several = false): string {
  const way = (command: number, side: string): string =>
    Number.isNaN(command)
      ? "at a command that statics do not determine"
      : Number.isFinite(command)
        ? `with a constant command ${side} ${format(command)}`
        : "at no command";
  const what = several ? `${words(name)} turns` : "it moves";
  const here = now === undefined ? "" : `; now it is ${format(now)}`;
  return `From rest ${what} forward ${way(forward, "above")}, backward ${way(backward, "below")}${here}.`;
}

function withUnit(unit: string, value: number): string {
  const s = shown(unit, Math.abs(value));
  return `${format(value / s.factor, 3)} ${s.unit}`;
}

/** The torque within what the contact can hold; nothing of one that slips. */
function bar({ mode, torque, forward, backward }: ContactState): SVGElement[] {
  const whole = forward + backward;
  if (mode !== 0 || !(whole > 0 && Number.isFinite(whole))) return [];
  const at = (value: number): number => SIDE + ((value + backward) / whole) * (WIDTH - 2 * SIDE);
  const [zero, x] = [at(0), at(torque)];
  return [
    svg(
      "svg",
      { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, "aria-hidden": "true" },
      svg("rect", { x: SIDE, y: 6, width: WIDTH - 2 * SIDE, height: 8, class: "held" }),
      svg("line", { x1: zero, x2: zero, y1: 3, y2: 17, class: "zero" }),
      svg("path", { d: `M${x} 4 V16 M${x} 15 l-5 5 h10 Z`, class: "torque" }),
    ),
  ];
}
