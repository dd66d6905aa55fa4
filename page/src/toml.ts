/** A scenario as TOML. */
import type { Table, Value } from "./description";

const BARE = /^[A-Za-z0-9_-]+$/;

/** What is null is left out. */
export function toml(table: Table, path: string[] = []): string {
  const entries = Object.entries(table).filter(([, value]) => value !== null);
  const plain = entries.filter(([, value]) => !isTable(value));
  const lines = plain.map(([key, value]) => `${word(key)} = ${inline(value)}`);
  const head = path.length > 0 && plain.length > 0 ? [`[${path.map(word).join(".")}]`] : [];
  const own = [...head, ...lines].join("\n");
  const inner = entries
    .filter(([, value]) => isTable(value))
    .map(([key, value]) => toml(value as Table, [...path, key]));
  if (path.length > 0 && entries.length === 0) return `[${path.map(word).join(".")}]`;
  return [own, ...inner].filter(Boolean).join("\n\n");
}

function isTable(value: Value): value is Table {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

function word(key: string): string {
  return BARE.test(key) ? key : JSON.stringify(key);
}

function inline(value: Value): string {
  if (Array.isArray(value)) return `[${value.map(inline).join(", ")}]`;
  if (value === null) throw new Error("a list in a scenario holds nothing that is missing");
  if (isTable(value)) {
    const entries = Object.entries(value).filter(([, v]) => v !== null);
    return `{ ${entries.map(([k, v]) => `${word(k)} = ${inline(v)}`).join(", ")} }`;
  }
  if (typeof value === "number" && !Number.isFinite(value)) return value > 0 ? "inf" : "-inf";
  return typeof value === "string" ? JSON.stringify(value) : String(value);
}
