/** Draws only what is in the window; the rest when it comes into it. */

export class DrawnWhenVisible {
  private late = false;

  /** inside: whether it counts as in the window until the browser says. */
  constructor(
    of: Element,
    private readonly draw: () => void,
    private inside = false,
  ) {
    new IntersectionObserver((entries) => {
      this.inside = entries.at(-1)!.isIntersecting;
      if (this.inside) this.catchUp();
    }).observe(of);
  }

  /** There is something new to draw. */
  changed(): void {
    this.late = true;
    if (this.inside) this.catchUp();
  }

  /** Draws also what nobody sees, for a picture. */
  catchUp(): void {
    if (!this.late) return;
    this.late = false;
    this.draw();
  }
}
