/** The train as a drawing that moves: shafts as discs, slides as carriages, and each gear as a tooth in its gap. */
import type { Run } from "./core";
import type { Description, GearView, ShaftView } from "./description";
import { svg } from "./dom";
import { extent, largest } from "./extent";
import { angles, unitsOf, words } from "./kinematics";
import { format, shown, SLIDING, TURNING } from "./units";

const [DISC, MESH, HEIGHT] = [150, 210, 210]; // widths of a shaft and of a gear, height of all
const MIDDLE = 92;
const TOOTH = 13; // half its width
const REACH = 44; // of the largest twist
const FRAME = 1 / 60;
const TRAVEL = 40; // of a carriage to both sides
const LOOKS = 300; // samples by which its travel is found
const ROUNDING = 1e-9; // of the largest speed: at rest, no speed is shown

/** Shows a sample; pace: how much of a second of the drive passes in a second of the user. */
type Mover = (k: number, pace: number) => void;
/** A part of the drawing, and how it moves in a run. */
interface Part {
  element: SVGElement;
  mover: (d: Description, run: Run) => Mover;
}

export class Drawing {
  readonly root = svg("svg", { role: "img", "aria-label": "The drive train in motion" });
  private movers: Mover[] = [];
  private parts: Part[] = [];

  /** To another run of the same train; show() then moves it. */
  use(d: Description, run: Run): void {
    if (this.parts.length === 0) this.build(d);
    this.movers = this.parts.map((part) => part.mover(d, run));
  }

  private build(d: Description): void {
    let x = 0;
    d.shafts.forEach((shaft) => {
      d.gears.forEach((gear, number) => {
        if (gear.output !== shaft.name) return;
        this.parts.push(mesh(gear, number, x));
        x += MESH;
      });
      this.parts.push(shaft.slide ? carriage(shaft, x) : disc(shaft, x));
      x += DISC;
    });
    this.root.setAttribute("viewBox", `0 0 ${x} ${HEIGHT}`);
    this.root.style.maxWidth = `${x * 1.25}px`;
    this.root.replaceChildren(...this.parts.map((part) => part.element));
  }

  show(k: number, pace: number): void {
    for (const move of this.movers) move(k, pace);
  }
}

function disc(shaft: ShaftView, x: number): Part {
  const { name, motor } = shaft;
  const radius = motor ? 34 : 46;
  const [cx, cy] = [x + DISC / 2, MIDDLE];
  const spokes = svg(
    "g",
    {},
    ...[0, 120, 240].map((a) => svg("line", { x1: 0, y1: 0, x2: 0, y2: -radius + 5, transform: `rotate(${a})` })),
  );
  const mark = svg("circle", { cx: 0, cy: -radius + 9, r: 5, class: "mark" });
  const turning = svg("g", { class: "turning" }, spokes, mark);
  const smear = svg("path", { class: "smear" });
  const lock = svg("path", { class: "lock", d: "M-9 0h18v13h-18z M-5.5 0v-5a5.5 5.5 0 0 1 11 0v5" });
  const place = svg("g", { transform: `translate(${cx} ${cy})` });
  place.append(svg("circle", { r: radius, class: motor ? "rotor" : "load" }), smear, turning, lock);
  lock.setAttribute("transform", `translate(${radius - 2} ${radius - 10})`);
  const group = svg("g", {});
  if (motor) group.append(svg("rect", { x: cx - 47, y: cy - 47, width: 94, height: 94, rx: 10, class: "housing" }));
  const told = speedBelow(shaft, cx, lock);
  group.append(place, ...told.texts);
  const mover = (d: Description, run: Run): Mover => {
    const speeds = run.values.get(shaft.speed);
    const tell = told.mover(run);
    return (k, pace) => {
      const angle = angles(d, run, k).get(name) ?? 0;
      const sweep = (speeds?.[k] ?? 0) * pace * FRAME * 4;
      turning.setAttribute("transform", `rotate(${(angle * 180) / Math.PI})`);
      smear.setAttribute("d", Math.abs(sweep) > 0.6 ? arc(angle, sweep, radius - 9) : "");
      tell(k);
    };
  };
  return { element: group, mover };
}

/** A slide on its rail; its travel in the run fills the rail. */
function carriage(shaft: ShaftView, x: number): Part {
  const [cx, cy] = [x + DISC / 2, MIDDLE];
  const lock = svg("path", {
    class: "lock",
    d: "M-9 0h18v13h-18z M-5.5 0v-5a5.5 5.5 0 0 1 11 0v5",
    transform: "translate(0 -44)",
  });
  const ends = [-1, 1].map((side) => svg("line", { x1: side * 70, x2: side * 70, y1: 4, y2: 34, class: "rail" }));
  const marks = Array.from({ length: 9 }, (_, k) => (k - 4) * (TRAVEL / 4));
  const scale = svg("path", { class: "rail", d: marks.map((at) => `M${at} 31v6`).join("") });
  const moving = svg("g", {}, svg("rect", { x: -28, y: -22, width: 56, height: 44, rx: 5, class: "load" }));
  moving.append(svg("path", { class: "pointer", d: "M0 31l-6 -9h12z" }), lock);
  const place = svg("g", { transform: `translate(${cx} ${cy})` });
  place.append(svg("rect", { x: -70, y: 24, width: 140, height: 7, class: "rack" }), ...ends, scale, moving);
  const told = speedBelow(shaft, cx, lock);
  const mover = (d: Description, run: Run): Mover => {
    const at = (k: number): number => angles(d, run, k).get(shaft.name) ?? 0;
    const count = run.values.get(shaft.speed)?.length ?? 1;
    const some = Array.from({ length: LOOKS }, (_, j) => at(Math.round(((count - 1) * j) / (LOOKS - 1))));
    const [low, high] = extent([some]);
    const share = high > low ? (2 * TRAVEL) / (high - low) : 0;
    const tell = told.mover(run);
    return (k) => {
      moving.setAttribute("transform", `translate(${(at(k) - 0.5 * (low + high)) * share} 0)`);
      tell(k);
    };
  };
  return { element: svg("g", {}, place, ...told.texts), mover };
}

/** Name and speed below a shaft or a slide, and the lock of one that is stuck. */
function speedBelow(
  shaft: ShaftView,
  x: number,
  lock: SVGElement,
): { texts: SVGElement[]; mover: (run: Run) => (k: number) => void } {
  const speed = svg("text", { x, y: HEIGHT - 26, class: "value" });
  const texts = [svg("text", { x, y: HEIGHT - 44, class: "name" }, words(shaft.name)), speed];
  const mover = (run: Run): ((k: number) => void) => {
    const speeds = run.values.get(shaft.speed);
    const contact = shaft.contact === null ? undefined : run.values.get(shaft.contact);
    const most = speeds ? largest(speeds) : 0;
    const unit = shown((shaft.slide ? SLIDING : TURNING).speed, most);
    return (k) => {
      lock.style.display = contact?.[k] === 0 ? "" : "none";
      const now = speeds && Math.abs(speeds[k]!) > ROUNDING * most ? speeds[k]! : 0;
      speed.textContent = speeds ? `${format(now / unit.factor, 3)} ${unit.unit}` : "";
    };
  };
  return { texts, mover };
}

/** The tooth of the input between two flanks of the output, each on a spring: enlarged. */
function mesh(gear: GearView, number: number, x: number): Part {
  const [cx, cy] = [x + MESH / 2, MIDDLE];
  const tooth = svg("path", { class: "tooth", d: `M${-TOOTH} -34 L${-TOOTH + 4} 22 H${TOOTH - 4} L${TOOTH} -34 Z` });
  const flanks = [-1, 1].map((side) => ({
    side,
    plate: svg("path", { class: "flank" }),
    spring: svg("path", { class: "spring" }),
  }));
  const rack = svg("rect", { x: -80, y: 30, width: 160, height: 8, class: "rack" });
  const group = svg("g", { transform: `translate(${cx} ${cy})` });
  group.append(
    svg("line", { x1: -MESH / 2 - 30, y1: 0, x2: -86, y2: 0, class: "shaft" }),
    svg("line", { x1: 86, y1: 0, x2: MESH / 2 + 30, y2: 0, class: "shaft" }),
  );
  group.append(svg("rect", { x: -88, y: -52, width: 176, height: 96, rx: 12, class: "lens" }), rack);
  for (const f of flanks) group.append(f.spring, f.plate);
  const twist = svg("text", { x: 0, y: HEIGHT - MIDDLE - 26, class: "value" });
  const torque = svg("text", { x: 0, y: HEIGHT - MIDDLE - 8, class: "value" });
  const title = svg("text", { x: 0, y: HEIGHT - MIDDLE - 44, class: "name" });
  group.append(tooth, title, twist, torque);
  const mover = (d: Description, run: Run): Mover => {
    const { backlash, ratio } = d.gears[number]!;
    const units = unitsOf(d, gear.output);
    const linear = units === SLIDING;
    const stage = linear ? `${format((2e3 * Math.PI) / ratio)} mm to a turn` : `${format(ratio)}:1`;
    title.textContent = `${words(gear.name)} ${stage}`;
    const twists = gear.twist === null ? undefined : run.values.get(gear.twist);
    const torques = run.values.get(gear.output_torque);
    const gap = 0.5 * backlash;
    const scale = twists ? REACH / Math.max(largest(twists), gap, 1e-12) : 0;
    const unit = shown(units.angle, twists ? largest(twists) : 0);
    const torqueUnit = shown(units.torque, torques ? largest(torques) : 0);
    return (k) => {
      const now = twists?.[k] ?? 0;
      const at = now * scale;
      tooth.setAttribute("transform", `translate(${at} 0)`);
      for (const { side, plate, spring } of flanks) {
        const pushed = side * (TOOTH + (gap > 0 ? Math.max(gap * scale, side * at) : side * at));
        plate.setAttribute("d", `M${pushed} -30 L${pushed - side * 3} 20`);
        plate.classList.toggle("pressed", side * now > gap * (1 + 1e-9) && twists !== undefined);
        spring.setAttribute("d", zigzag(pushed, side * 80));
      }
      twist.textContent = twists
        ? `${linear ? "deflection" : "twist"} ${format(now / unit.factor, 3)} ${unit.unit}`
        : "rigid";
      torque.textContent = torques ? `${format(torques[k]! / torqueUnit.factor, 3)} ${torqueUnit.unit}` : "";
    };
  };
  return { element: group, mover };
}

function zigzag(from: number, to: number): string {
  const n = 8;
  const points = Array.from({ length: n + 1 }, (_, k) => {
    const up = k === 0 || k === n ? 0 : k % 2 ? -7 : 7;
    return `${(from + ((to - from) * k) / n).toFixed(2)} ${(-5 + up).toFixed(2)}`;
  });
  return `M${points.join(" L")}`;
}

/** What a mark has swept over. */
function arc(angle: number, sweep: number, radius: number): string {
  const turned = Math.max(-5.5, Math.min(5.5, sweep));
  const at = (a: number): string => `${(radius * Math.sin(a)).toFixed(2)} ${(-radius * Math.cos(a)).toFixed(2)}`;
  const large = Math.abs(turned) > Math.PI ? 1 : 0;
  return `M${at(angle - turned)} A${radius} ${radius} 0 ${large} ${turned > 0 ? 1 : 0} ${at(angle)}`;
}
