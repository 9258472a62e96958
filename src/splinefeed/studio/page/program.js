// A program as a control runs it: its lines at the side, each with its time; a line and its place are chosen together.
import { $, make, numbersOf, table } from "./dom.js";
import { Listing } from "./listing.js";
import { digits, showHead } from "./numbers.js";
import { firstNotBelow } from "./zoom.js";

const KINDS = ["cutting", "rapid", "tool_change", "spindle", "dwell", "start"];
const seconds = (value) => `${value.toFixed(2)} s`;

// 1 h 2 min 3 s
const clock = (value) => {
  const whole = Math.round(value);
  const parts = [[Math.floor(whole / 3600), "h"], [Math.floor(whole / 60) % 60, "min"]].filter(([count]) => count);
  return [...parts, [whole % 60, "s"]].map((part) => part.join(" ")).join(" ");
};

export class Program {
  constructor(picture, figures, clock) {
    Object.assign(this, { picture, figures, clock });
    this.listing = new Listing($("listing"), (line) => this.choose(line), (line) => {
      const k = this.row.get(line);
      return k !== undefined && this.seconds[k] >= 0.005 ? seconds(this.seconds[k]) : "";
    });
  }

  get line() { return this.listing.line; }

  set(result, shown, curves) {
    const { numbers: n, lines, limits, path, figures, program, order } = result;
    const same = program === this.whole;
    this.whole = program;
    Object.assign(this, Object.fromEntries(Object.entries(lines).map(([name, column]) => [name === "line" ? "numbers" : name, numbersOf(column)])));
    this.row = new Map(Array.from(this.numbers, (line, k) => [line, k]));
    this.limits = limits;
    this.tools = n.operations.map((each) => each.tool || "no tool");
    this.listing.set(program);
    const cards = KINDS.filter((kind) => n[`${kind}_s`]).map((kind) => [kind.replace("_", " "), `${kind}_s`, seconds(n[`${kind}_s`]), `${((100 * n[`${kind}_s`]) / n.total_s).toFixed(1)} % of the time`]);
    showHead(n, true, `${n.name} takes ${clock(n.total_s)} on ${n.machine}.`, shown, [["cycle time", "total_s", seconds(n.total_s), `${n.blocks} blocks`], ...cards]);
    $("notes").replaceChildren(...n.notes.map((text) => make("li", {}, text)));
    this.order = { begin: numbersOf(order.begin), line: numbersOf(order.line) };
    this.picture.set(path, curves, this);
    this.figures.sets = this.figures.sheets = {};
    this.figures.set(figures, { tools: this.perTool(n), places: this.places(n) });
    this.listing.line = same ? this.line : 0;
    this.say();
    this.listing.draw();
    this.clock.until(n.total_s);
  }

  // the line of a time is chosen as that comes
  when(t) {
    if (!this.order || this.choosing || document.body.dataset.view !== "program") return;
    const k = Math.max(firstNotBelow(this.order.begin, t + 1e-9) - 1, 0);
    if (this.order.line[k] && this.order.line[k] !== this.line) this.look(this.order.line[k]);
  }

  // what the time is told with
  said() { return this.line ? `line ${this.line}` : ""; }

  perTool({ tools }) {
    const kinds = KINDS.filter((kind) => tools.some((each) => each[`${kind}_s`]));
    return table(["tool", "total", ...kinds.map((kind) => kind.replace("_", " "))], tools.map((each) => make("tr", { data: { tool: each.tool } },
      make("td", {}, each.tool || "no tool"), ...["total", ...kinds].map((kind) => make("td", {}, each[`${kind}_s`] ? seconds(each[`${kind}_s`]) : "")))));
  }

  places({ places, saves }) {
    const rows = places.map(({ line, seconds: s, beyond_feed_s: beyond, limit }) => make("tr", {},
      make("td", {}, line ? make("button", { type: "button", onclick: () => { this.choose(line); $("listing").focus(); } }, `line ${line}`) : "start"),
      ...[seconds(s), seconds(beyond), limit].map((text) => make("td", {}, text))));
    const better = saves.filter((each) => each.saves_s >= 0.005).map((each) => make("tr", {}, make("td", {}, each.what.replace(/[_.]/g, " ")), make("td", {}, seconds(each.saves_s))));
    return make("div", { class: "tuned" }, table(["place", "time", "beyond feed", "what binds"], rows), table(["20 % better", "saves"], better));
  }

  // the line with this number, here and on the picture
  choose(line) {
    this.look(line);
    const k = this.row.get(line);
    this.choosing = true; // the tool goes where the line ends, and the line stays chosen
    if (k !== undefined) this.clock.to(this.begin[k] + this.seconds[k]);
    this.choosing = false;
  }

  look(line) {
    this.listing.look(line);
    this.say();
    this.picture.draw();
  }

  say() {
    if (!this.line) { $("line-said").textContent = "Choose a line, or click on the path: where the tool is then, the time and what bounds it."; return; }
    const k = this.row.get(this.line);
    let before = this.numbers.length - 1; // where the tool is at a line that takes no time
    while (before > 0 && this.numbers[before] > this.line) before -= 1;
    const at = k ?? before;
    this.place = [this.x[at], this.y[at], this.z[at]];
    const place = ["x", "y", "z"].map((axis) => `${axis} ${this[axis][at].toFixed(3)}`).join(", ");
    const beyond = this.beyond[at] >= 0.005 && this.beyond[at] < this.seconds[at] ? // not where no feed is programmed
      ` (${seconds(this.beyond[at])} beyond the programmed feed)` : "";
    const took = k === undefined ? "no time" : `${seconds(this.seconds[k])}${beyond} from ${seconds(this.begin[k])} on, bound by ${this.limits[this.limit[k]]}`;
    $("line-said").textContent = `Line ${this.line}: ${took}; ${this.tools[this.operation[at]]}, ${place} mm.`;
  }

  // what the picture says at a point, and what it calls the operations
  told([line, feed]) {
    const k = this.row.get(line);
    return [`line ${line}: ${this.listing.text[line - 1]?.trim().slice(0, 40) ?? ""}`, `${seconds(this.seconds[k])} from ${seconds(this.begin[k])} on, bound by ${this.limits[this.limit[k]]}`, `${digits(feed, 4)} mm/min, ${this.tools[this.operation[k]]}`];
  }

  names({ label }) { return label === "operation" ? this.tools : null; }
}
