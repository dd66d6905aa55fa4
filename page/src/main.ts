/** The page: what is shown, and what follows what. */
import "./style.css";
import { Actions } from "./actions";
import { Background } from "./background";
import { type Changes, changed, fromFragment, toFragment } from "./changes";
import { Controls } from "./controls";
import { Core, CoreError, type Run } from "./core";
import { type Description, read } from "./description";
import { byId } from "./dom";
import { Drawing } from "./drawing";
import { EnergyCard } from "./energy_card";
import { LoopCard } from "./loop_card";
import { MarginCard } from "./margin_card";
import { MapCard } from "./map_card";
import { Player } from "./player";
import { PlayerBar } from "./player_bar";
import { ResponseCard } from "./response_card";
import { StuckCard } from "./stuck_card";
import { ContactStrip } from "./contact_strip";
import { TimeCharts } from "./time_charts";
import { format } from "./units";
import { unpacked } from "./wasm";

const LONG = 8; // ms of a run from which on the next one is computed in the background of the page, which then goes on moving
// Of the first run: where this share takes longer, it is shown alone until the whole is there.
const [BEGINNING, SHORT, LONG_COMPILED] = [1 / 64, 0.6, 20]; // ms

class Page {
  private readonly changes: Changes;
  private d: Description;
  private run?: Run;
  private long = false;
  private complete = false; // has a whole run been shown? Its beginning alone is not played
  private warning = ""; // of the address, beside the first run
  private pinned?: Run;
  private waiting = false;
  private readonly player: Player;
  private readonly bar: PlayerBar;
  private readonly drawing = new Drawing();
  private readonly charts = new TimeCharts(byId("time-charts"), (time) => this.bar.hold(time));
  private readonly strip = new ContactStrip(byId("strip"));
  private readonly loops = new LoopCard(byId("cards"));
  private readonly maps = new MapCard(byId("cards"));
  private readonly background: Background;
  private readonly stand: StuckCard;
  private readonly energy = new EnergyCard(byId("cards"));
  private readonly margins: MarginCard;
  private readonly response: ResponseCard;
  private readonly controls: Controls;
  private readonly actions: Actions;

  constructor(
    private readonly core: Core,
    private readonly original: Description,
    bytes: ArrayBuffer,
  ) {
    const { changes, unusable } = fromFragment(location.hash, original.sliders);
    this.changes = changes;
    this.d = changed(original, changes);
    byId("title").textContent = original.title || original.name;
    document.title = `${original.title || original.name} – lostmotion`;
    byId("drawing").append(this.drawing.root);
    this.player = new Player(this.d.core.duration, (time) => this.show(time));
    this.bar = new PlayerBar(byId("player"), this.player);
    this.background = new Background(bytes);
    this.stand = new StuckCard(byId("cards"), this.background);
    this.margins = new MarginCard(byId("cards"), original);
    this.response = new ResponseCard(byId("cards"), original, this.background);
    this.controls = new Controls(byId("controls"), original.sliders, changes, () => this.later());
    this.actions = new Actions(byId("actions"), {
      pin: (on) => {
        this.pinned = on ? this.run : undefined;
        this.paint();
      },
      reset: () => {
        this.changes.clear();
        this.controls.show();
        this.later();
      },
      redraw: () => this.paint(),
      scenario: () => this.d.scenario,
      run: () => this.run,
      pictures: () => [...this.charts.pictures(), this.strip.canvas],
      name: original.name,
      title: original.title || original.name,
    });
    if (unusable.length > 0) this.warning = `The address holds what this drive does not know: ${unusable.join(", ")}`;
    this.attempt(() => this.begin());
    addEventListener("resize", () => this.later());
    addEventListener("hashchange", () => this.follow());
  }

  /** Once in a frame, however often a slider reports. */
  private later(): void {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.d = changed(this.original, this.changes);
      this.compute();
      tell(this.changes, this.d);
      const fragment = toFragment(this.changes);
      // In a notebook the page has no address of its own.
      if (location.protocol !== "about:" && location.hash.slice(1) !== fragment)
        history.replaceState(null, "", fragment ? `#${fragment}` : location.pathname + location.search);
    });
  }

  private follow(): void {
    const { changes } = fromFragment(location.hash, this.original.sliders);
    this.changes.clear();
    for (const [key, value] of changes) this.changes.set(key, value);
    this.controls.show();
    this.later();
  }

  private compute(): void {
    if (this.long) this.computeInBackground();
    else this.attempt(() => this.use(this.core.run(this.d.core)));
  }

  /** The first run. */
  private begin(): void {
    const { core } = this.d;
    const samples = Math.max(1, Math.round((BEGINNING * core.duration) / core.interval));
    const first = { ...core, duration: samples * core.interval };
    let beginning = this.core.run(first);
    // Most of its time is that of the compiler, which is done with what a short run needs.
    if (beginning.milliseconds < LONG_COMPILED) beginning = this.core.run(first);
    if (beginning.milliseconds < SHORT) {
      this.use(this.core.run(core));
      return;
    }
    this.long = true;
    this.take(beginning);
    this.say(`the first ${format(beginning.time.at(-1)!, 3)} s; the rest is being solved`, false);
    whenShown(() => this.computeInBackground()); // it would take the processor from what draws
  }

  private computeInBackground(): void {
    this.background.ask({ kind: "run", input: this.d.core }, (answer) => {
      if (answer.kind === "run") this.use(answer.run);
      if (answer.kind === "failure") this.say(answer.message, true);
    });
  }

  private attempt(run: () => void): void {
    try {
      run();
    } catch (error) {
      if (!(error instanceof CoreError)) throw error;
      this.say(error.message, true);
    }
  }

  /** The run of the drive as it is. */
  private use(run: Run): void {
    this.long = run.milliseconds >= LONG;
    this.take(run);
    const { milliseconds, switchings, time } = run;
    this.say(
      this.warning ||
        `${format(time.at(-1)!, 3)} s, ${switchings} switchings, solved exactly in ${milliseconds.toFixed(1)} ms`,
      this.warning !== "",
    );
    this.warning = "";
    this.stand.use(this.d, run);
    this.margins.use(this.changes);
    this.response.use(this.d);
    if (this.complete) return;
    this.complete = true;
    this.bar.start();
    whenShown(() => performance.mark("whole-run"));
  }

  /** What is shown from now on: a whole run, or its beginning. */
  private take(run: Run): void {
    if (!this.run) this.charts.build(this.d, run);
    this.run = run;
    this.paint();
  }

  private paint(): void {
    if (!this.run) return;
    this.drawing.use(this.d, this.run);
    this.charts.draw(this.d, this.run, this.pinned);
    this.strip.draw(rowsOf(this.d, this.run), this.run.time.at(-1)! / this.d.core.duration);
    this.loops.draw(this.d, this.run, this.pinned);
    this.maps.draw(this.d, this.run, this.pinned);
    this.energy.draw(this.run);
    this.response.draw();
    this.player.use(this.d.core.duration);
    this.actions.show();
  }

  private show(time: number): void {
    if (!this.run) return;
    const k = Math.min(this.run.time.length - 1, Math.round(time / this.d.core.interval));
    this.drawing.show(k, this.player.playing ? this.player.pace : 0);
    this.charts.mark(time, k);
    this.stand.mark(time);
    this.loops.mark(k);
    this.maps.mark(k);
    this.bar.show(time);
  }

  private say(text: string, failed: boolean): void {
    const summary = byId("summary");
    summary.textContent = text;
    summary.classList.toggle("failed", failed);
  }
}

/** Contacts as the strip shows them. */
function rowsOf(d: Description, { values }: Run): { label: string; modes: Float64Array }[] {
  const there = d.contacts.filter((c) => values.has(c.variable));
  return there.map(({ label, variable }) => ({ label, modes: values.get(variable)! }));
}

/** Once what is drawn now is shown: it is with the next frame; the one after begins when that is shown. */
function whenShown(then: () => void): void {
  requestAnimationFrame(() => requestAnimationFrame(then));
}

/** Tells a notebook that shows the page what is changed, and the scenario with it. */
function tell(changes: Changes, { scenario }: Description): void {
  if (parent !== window) parent.postMessage({ lostmotion: { values: Object.fromEntries(changes), scenario } }, "*");
}

const [bytes, description] = await Promise.all([unpacked(document, "core"), read(document)]);
new Page(await Core.load(bytes), description, bytes);
whenShown(() => performance.mark("first-plot"));
