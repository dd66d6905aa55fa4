/** The buttons of the page: pin, reset, downloads, link, light and dark. */
import type { Run } from "./core";
import type { Table } from "./description";
import { h } from "./dom";
import { csv, picture, save } from "./download";
import { toml } from "./toml";

export interface Served {
  name: string;
  title: string;
  pin: (on: boolean) => void;
  reset: () => void;
  redraw: () => void;
  scenario: () => Table;
  /** none before the first one has succeeded */
  run: () => Run | undefined;
  pictures: () => HTMLCanvasElement[];
}

type Theme = "light" | "dark";

export class Actions {
  private readonly pinned = h(
    "button",
    { type: "button", "aria-pressed": "false", title: "Keep this run in the charts, to compare with" },
    "Pin",
  );
  private readonly theme = h("button", { type: "button" });

  constructor(
    root: HTMLElement,
    private readonly page: Served,
  ) {
    this.pinned.addEventListener("click", () => {
      const on = this.pinned.getAttribute("aria-pressed") !== "true";
      this.pinned.setAttribute("aria-pressed", String(on));
      this.page.pin(on);
    });
    const system = matchMedia("(prefers-color-scheme: dark)");
    this.use(system.matches ? "dark" : "light");
    system.addEventListener("change", () => {
      this.use(system.matches ? "dark" : "light");
      this.page.redraw();
    });
    let before: Theme = "light";
    addEventListener("beforeprint", () => {
      before = document.documentElement.dataset.theme as Theme;
      this.use("light");
      this.page.redraw();
      this.page.pictures();
    });
    addEventListener("afterprint", () => {
      this.use(before);
      this.page.redraw();
    });
    this.theme.addEventListener("click", () => {
      this.use(document.documentElement.dataset.theme === "dark" ? "light" : "dark");
      this.page.redraw();
    });
    root.append(
      this.pinned,
      button("Reset", "All values as in the file", () => this.page.reset()),
      button("TOML", "The scenario with these values, for lostmotion run", () =>
        save(`${page.name}.toml`, text(`${toml(page.scenario())}\n`)),
      ),
      button("CSV", "All variables over time", () => this.table()),
      button("PNG", "The charts as a picture", () => void this.picture()),
      this.theme,
    );
  }

  /** Nothing of the buttons depends on the run but what they do when pressed. */
  show(): void {
    this.theme.setAttribute("aria-label", `Change to ${this.other()} colours`);
    this.theme.textContent = this.other() === "dark" ? "☾ Dark" : "☀ Light";
  }

  private table(): void {
    const run = this.page.run();
    if (run) save(`${this.page.name}.csv`, text(csv(run)));
  }

  private async picture(): Promise<void> {
    const style = getComputedStyle(document.documentElement);
    const colour = (name: string): string => style.getPropertyValue(name).trim();
    save(
      `${this.page.name}.png`,
      await picture(this.page.title, this.page.pictures(), colour("--surface"), colour("--text")),
    );
  }

  private other(): Theme {
    return document.documentElement.dataset.theme === "dark" ? "light" : "dark";
  }
  private use(theme: Theme): void {
    document.documentElement.dataset.theme = theme;
    this.show();
  }
}

function button(label: string, title: string, click: () => void): HTMLElement {
  return h("button", { type: "button", title, click }, label);
}
function text(content: string): Blob {
  return new Blob([content], { type: "text/plain;charset=utf-8" });
}
