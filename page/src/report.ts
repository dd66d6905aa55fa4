/** The script of a report: its charts, from the data that the page carries. */
import { h } from "./dom";
import { ribbons } from "./energy_card";
import { LinesChart } from "./lines_chart";
import { type ContactsData, type Packed, read } from "./packed";
import { ContactStrip } from "./contact_strip";

interface Drawn {
  draw(): void;
}

class Contacts implements Drawn {
  private readonly strip: ContactStrip;

  constructor(
    place: HTMLElement,
    private readonly data: ContactsData,
    private readonly arrays: Packed["arrays"],
  ) {
    this.strip = new ContactStrip(place);
    new ResizeObserver(() => this.draw()).observe(place);
    this.draw();
  }

  draw(): void {
    this.strip.draw(this.data.rows.map(({ label, modes }) => ({ label, modes: this.arrays[modes]! })));
  }
}

function drawn(place: HTMLElement, { charts, arrays }: Packed): Drawn[] {
  const data = charts[Number(place.dataset.chart)]!;
  if (data.kind === "lines") return [new LinesChart(place, data, arrays)];
  if (data.kind === "contacts") return [new Contacts(place, data, arrays)];
  if (data.kind === "flows") place.prepend(ribbons(new Map(Object.entries(data.energies))));
  return [];
}

/** Charts of one group over the same quantity share cursor and zoom. */
function join(all: Drawn[][]): void {
  for (const group of all) {
    const lines = group.filter((c): c is LinesChart => c instanceof LinesChart && c.rising);
    for (const chart of lines) chart.companions = lines.filter((c) => c.data.x.label === chart.data.x.label);
  }
}

type Theme = "light" | "dark";

/** Light or dark: as the system has it, until the button is pressed; paper is light. */
function themes(root: HTMLElement, redraw: () => void, print: () => void): void {
  const system = matchMedia("(prefers-color-scheme: dark)");
  const { dataset } = document.documentElement;
  const now = (): Theme => (dataset.theme as Theme | undefined) ?? (system.matches ? "dark" : "light");
  const button = h("button", { type: "button" });
  const use = (theme?: Theme): void => {
    if (theme) dataset.theme = theme;
    else delete dataset.theme;
    button.textContent = now() === "dark" ? "☀ Light" : "☾ Dark";
    button.setAttribute("aria-label", `Change to ${now() === "dark" ? "light" : "dark"} colours`);
    redraw();
  };
  button.addEventListener("click", () => use(now() === "dark" ? "light" : "dark"));
  system.addEventListener("change", () => use());
  let before: Theme | undefined;
  addEventListener("beforeprint", () => {
    before = dataset.theme as Theme | undefined;
    use("light");
    print();
  });
  addEventListener("afterprint", () => use(before));
  root.append(button);
  use();
}

async function main(): Promise<void> {
  const data = await read(document);
  const groups = [...document.querySelectorAll(".charts")].map((group) =>
    [...group.querySelectorAll<HTMLElement>("[data-chart]")].flatMap((place) => drawn(place, data)),
  );
  join(groups);
  const all = groups.flat();
  themes(
    document.getElementById("actions")!,
    () => all.forEach((chart) => chart.draw()),
    () => all.forEach((chart) => chart instanceof LinesChart && chart.paint()),
  );
  performance.mark("drawn");
}

void main();
