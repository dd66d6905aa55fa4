/** What the user has changed: values by the keys of the scenario file. */
import type { Description, Slider, Table, Value } from "./description";

/** Values in SI. */
export type Changes = Map<string, number>;

/** The description with the changes made. */
export function changed(original: Description, changes: Changes): Description {
  const d: Description = {
    ...original,
    core: structuredClone(original.core),
    gears: structuredClone(original.gears),
    scenario: structuredClone(original.scenario),
  };
  for (const slider of d.sliders) {
    const value = changes.get(slider.key);
    if (value === undefined) continue;
    change(d, slider, value);
    for (const [key, other] of Object.entries(slider.needs ?? {}))
      if (get(d.scenario, key) == null) set(d.scenario, key, other);
    set(d.scenario, slider.key, value);
  }
  return d;
}

function change(d: Description, { target, view, key }: Slider, value: number): void {
  if (target === "parameter") d.core.values[key] = value;
  else if (target === "duration") d.core.duration = value;
  else if ("input" in target) {
    put(d.core.inputs[target.input]!, target.path, value);
    if (!d.core.changed_inputs.includes(target.input)) d.core.changed_inputs.push(target.input);
  } else {
    put(d.core.references[target.reference]!, target.path, value);
    if (!d.core.changed_references.includes(target.reference)) d.core.changed_references.push(target.reference);
  }
  if (view) put(d, view, value);
}

type Path = (string | number)[];

function put(into: object, path: Path, value: number): void {
  let at: any = into;
  for (const key of path.slice(0, -1)) at = at[key];
  at[path.at(-1)!] = value;
}

/** Names and numbers of a dotted key. */
function parts(key: string): Path {
  return key.split(".").map((part) => (/^\d+$/.test(part) ? Number(part) : part));
}

function get(table: Table, key: string): Value | undefined {
  let at: any = table;
  for (const part of parts(key)) at = at?.[part];
  return at;
}

function set(table: Table, key: string, value: number): void {
  const path = parts(key);
  let at: any = table;
  for (const part of path.slice(0, -1)) at = at[part] ??= {};
  at[path.at(-1)!] = value;
}

/** The changes as the fragment of an address: motor.rotor_inertia=8e-6&... */
export function toFragment(changes: Changes): string {
  return [...changes].map(([key, value]) => `${key}=${value}`).join("&");
}

/** Entries that are no number, or of no slider, or out of its range, are returned as what cannot be used. */
export function fromFragment(fragment: string, sliders: Slider[]): { changes: Changes; unusable: string[] } {
  const changes: Changes = new Map();
  const unusable: string[] = [];
  for (const entry of fragment.replace(/^#/, "").split("&").filter(Boolean)) {
    const [key, text] = entry.split("=");
    const slider = sliders.find((s) => s.key === key);
    const value = Number(text);
    const usable = slider && text && Number.isFinite(value) && value >= slider.min && value <= slider.max;
    if (usable) changes.set(slider.key, value);
    else unusable.push(entry);
  }
  return { changes, unusable };
}
