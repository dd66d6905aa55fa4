/** Play, pause, the instant and the pace. */
import { h } from "./dom";
import type { Player } from "./player";

const PACES: [string, number][] = [
  ["real time", 1],
  ["1/2", 1 / 2],
  ["1/5", 1 / 5],
  ["1/10", 1 / 10],
  ["1/50", 1 / 50],
  ["1/200", 1 / 200],
];

export class PlayerBar {
  private readonly button = h("button", { type: "button", click: () => this.toggle() });
  private readonly slider = h("input", { type: "range", min: 0, max: 1000, step: 1, "aria-label": "Time" });
  private readonly time = h("output", {});
  private readonly pace = h("select", { "aria-label": "Pace" });

  constructor(
    root: HTMLElement,
    private readonly player: Player,
  ) {
    this.slider.addEventListener("input", () => this.hold((Number(this.slider.value) / 1000) * player.length));
    PACES.forEach(([label], k) => this.pace.append(h("option", { value: k }, label)));
    this.pace.addEventListener("change", () => (player.pace = PACES[Number(this.pace.value)]![1]));
    const fitting = PACES.findIndex(([, pace]) => player.length / pace >= 6);
    this.pace.value = String(fitting < 0 ? PACES.length - 1 : fitting);
    player.pace = PACES[Number(this.pace.value)]![1];
    root.append(this.button, this.slider, this.time, this.pace);
    this.label();
  }

  /** Plays, unless the user wants little motion. */
  start(): void {
    if (matchMedia("(prefers-reduced-motion: reduce)").matches) return this.hold(this.player.length / 3);
    this.player.play();
    this.label();
  }

  hold(time: number): void {
    this.player.pause();
    this.player.seek(time);
    this.label();
  }

  show(time: number): void {
    this.time.textContent = `${time.toFixed(3)} s`;
    this.slider.value = String(Math.round((1000 * time) / this.player.length));
    this.slider.setAttribute("aria-valuetext", `${time.toFixed(3)} s`);
  }

  private toggle(): void {
    if (this.player.playing) this.player.pause();
    else this.player.play();
    this.label();
  }

  private label(): void {
    this.button.textContent = this.player.playing ? "❚❚ Pause" : "▶ Play";
  }
}
