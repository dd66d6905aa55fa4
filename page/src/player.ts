/** The instant that is shown: it runs through the run, or stands where the user puts it. */

export class Player {
  time = 0;
  playing = false;
  /** seconds of the drive in one second of the user */
  pace = 1;
  private last = 0;

  constructor(
    private duration: number,
    private readonly show: (time: number) => void,
  ) {}

  get length(): number {
    return this.duration;
  }

  use(duration: number): void {
    this.duration = duration;
    this.seek(Math.min(this.time, duration));
  }

  seek(time: number): void {
    this.time = Math.min(this.duration, Math.max(0, time));
    this.show(this.time);
  }

  play(): void {
    if (this.playing) return;
    this.playing = true;
    this.last = performance.now();
    requestAnimationFrame(this.step);
  }

  pause(): void {
    this.playing = false;
  }

  private readonly step = (now: number): void => {
    if (!this.playing) return;
    const passed = Math.min(0.1, Math.max(0, (now - this.last) / 1000));
    this.last = now;
    this.time += passed * this.pace;
    if (this.time > this.duration) this.time %= this.duration;
    this.show(this.time);
    requestAnimationFrame(this.step);
  };
}
