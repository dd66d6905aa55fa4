/** Writes the pages of all tests once: `inject("directory")` says where. */
import { execFileSync } from "node:child_process";
import { mkdtempSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import type { TestProject } from "vitest/node";

const root = fileURLToPath(new URL("../..", import.meta.url));

/** A directory with the pages of pages.py and the samples of Python. */
export default function setup({ provide }: TestProject): void {
  const directory = mkdtempSync(join(tmpdir(), "lostmotion-page-"));
  execFileSync(join(root, ".venv/bin/python"), [join(root, "page/tests/pages.py"), directory], { stdio: "inherit" });
  provide("directory", directory);
}

declare module "vitest" {
  export interface ProvidedContext {
    directory: string;
  }
}
