/** Which contacts are stuck, and which way the others slip, over time. */
const [ROW, TEXT, BAR, LEFT, RIGHT] = [36, 17, 14, 66, 12];

export class ContactStrip {
  readonly canvas = document.createElement("canvas");

  constructor(readonly root: HTMLElement) {
    this.canvas.setAttribute("role", "img");
    root.append(this.canvas);
  }

  /** rows: each with its modes at instants of equal distance; reach: share of the width that they take. */
  draw(rows: { label: string; modes: Float64Array }[], reach = 1): void {
    const [width, height] = [this.root.clientWidth, ROW * rows.length + 4];
    const density = window.devicePixelRatio || 1;
    this.root.style.height = `${height}px`;
    this.canvas.width = Math.round(width * density);
    this.canvas.height = Math.round(height * density);
    const c = this.canvas.getContext("2d")!;
    c.setTransform(density, 0, 0, density, 0, 0);
    const style = getComputedStyle(this.root);
    const [text, still, moving] = ["text", "stuck", "slips"].map((name) =>
      style.getPropertyValue(`--${name}`).trim(),
    ) as [string, string, string];
    c.font = `12px ${style.fontFamily}`;
    c.textBaseline = "middle";
    const shares: string[] = [];
    rows.forEach(({ label, modes }, row) => {
      const [top, last] = [row * ROW + 2, modes.length - 1];
      const x = (k: number): number => LEFT + reach * (k / last) * (width - LEFT - RIGHT);
      let stuck = 0;
      for (let k = 0; k < last;) {
        let end = k + 1;
        while (end < last && modes[end] === modes[k]) ++end;
        if (modes[k] === 0) stuck += end - k;
        segment(c, modes[k] === 0 ? still : moving, modes[k]!, x(k), x(end) - x(k), top + TEXT);
        k = end;
      }
      const share = `${label}: stuck ${((100 * stuck) / last).toFixed(0)} %`;
      shares.push(share);
      c.fillStyle = text;
      c.fillText(share, LEFT, top + TEXT / 2);
    });
    this.canvas.setAttribute("aria-label", `Contacts over time. ${shares.join("; ")}.`);
  }
}

/** Stuck: full; forward: the upper half; backward: the lower half. */
function segment(
  c: CanvasRenderingContext2D,
  colour: string,
  mode: number,
  x: number,
  width: number,
  top: number,
): void {
  c.fillStyle = colour;
  const half = BAR / 2;
  c.fillRect(x, mode < 0 ? top + half : top, width + 0.3, mode === 0 ? BAR : half);
}
