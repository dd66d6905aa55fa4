/** What can be taken along: the scenario, the samples, a picture. */
import type { Run } from "./core";
import { h } from "./dom";

export function save(name: string, content: Blob): void {
  const address = URL.createObjectURL(content);
  h("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}

/** One column for each variable, its unit in the heading. */
export function csv(run: Run): string {
  const names = [...run.values.keys()];
  const heading = ["time [s]", ...names.map((name) => `${name} [${run.units.get(name) || "1"}]`)];
  const columns = [run.time, ...run.values.values()];
  const rows = Array.from(run.time, (_, k) => columns.map((c) => written(c[k]!)).join(","));
  return `${[heading.join(","), ...rows].join("\n")}\n`;
}

/** All digits that tell a number from others, and the sign of a zero. */
function written(value: number): string {
  return Object.is(value, -0) ? "-0" : String(value);
}

/** Canvases below each other, with a title, on the colour of the page. */
export function picture(title: string, parts: HTMLCanvasElement[], background: string, ink: string): Promise<Blob> {
  const width = Math.max(...parts.map((p) => p.width));
  const density = window.devicePixelRatio || 1;
  const top = Math.round(34 * density);
  const sheet = h("canvas", { width, height: top + parts.reduce((sum, p) => sum + p.height, 0) });
  const c = sheet.getContext("2d")!;
  c.fillStyle = background;
  c.fillRect(0, 0, sheet.width, sheet.height);
  c.fillStyle = ink;
  c.font = `600 ${15 * density}px system-ui, sans-serif`;
  c.fillText(title, 8 * density, 22 * density);
  let y = top;
  for (const part of parts) {
    c.drawImage(part, 0, y);
    y += part.height;
  }
  return new Promise((done, failed) =>
    sheet.toBlob((blob) => (blob ? done(blob) : failed(new Error("no picture"))), "image/png"),
  );
}
