// Gains of the machine's axes: by which rule, what it found, and a button that takes them.
import { $, make, show, table } from "./dom.js";
import { digits, length } from "./numbers.js";

const SHORT = { position_gain: "kv", velocity_kp: "kp", velocity_ki: "ki", velocity_feed_forward: "vff", acceleration_feed_forward: "aff" };
const gains = (values, units) => Object.entries(values).filter(([, value]) => value !== 0).map(([name, value]) => `${SHORT[name] ?? name} ${digits(value, 4)} ${units[name]}`).join(", ");
const margin = (m) => {
  if (!m.stable) return ["", "", "", ""];
  const or = (value, unit) => (value === null ? "none" : `${digits(value, 3)} ${unit}`);
  return [or(m.gain_margin_db, "dB"), or(m.gain_fall_db, "dB"), or(m.phase_margin, "°"), or(m.bandwidth, "Hz")];
};
// how near a loop is to unstable, and how far it swings at rest
const state = (each, ending) => {
  const found = each[`margins${ending}`];
  const swing = each[`rest_swing${ending}`];
  const turning = each.rest_swing_unit === "rad";
  const size = swing === null ? "runs away" : turning ? `${digits((swing * 180) / Math.PI, 3)}°` : length(swing);
  return `${found.stable ? (found.close ? "close to unstable" : "stable") : "unstable"}, swing at rest ${size}${each[`hunts${ending}`] ? " (hunts)" : ""}`;
};

export class Tune {
  constructor(link, settings, figures) {
    Object.assign(this, { link, settings, figures });
    $("tune-rule").addEventListener("change", () => this.kinds());
    $("tune-start").addEventListener("click", () => this.start());
  }

  ready() { show($("tune"), Boolean(this.settings.value.machine)); }

  kinds() {
    const path = $("tune-rule").value === "path";
    for (const each of document.querySelectorAll(".tune-by-rule")) show(each, !path);
    for (const each of document.querySelectorAll(".tune-by-path")) show(each, path);
  }

  start() {
    const rule = $("tune-rule").value;
    const how = rule === "path" ? { rule, runs: Number($("tune-runs").value), feed_forward: $("tune-forward").checked }
      : { rule, kind: $("tune-kind").value };
    this.link.send({ do: "job", kind: "tune", title: this.settings.value.machine.name, settings: this.settings.value, how });
  }

  show({ numbers, figures, machine, rule }) {
    const rows = Object.entries(numbers.axes).flatMap(([axis, each]) => [["old", "_before"], ["new", ""]].map(([when, ending]) =>
      make("tr", {}, ...[axis, when, gains(each[`gains${ending}`], each[`gain_units${ending}`]), ...margin(each[`margins${ending}`]), state(each, ending)].map((text) => make("td", {}, text)))));
    const head = ["axis", "gains", "", "gain may rise", "may fall", "phase margin", "bandwidth", "loop"];
    const [before, after] = [numbers.contour_error_max_before_mm, numbers.contour_error_max_mm];
    const errors = numbers.stopped ? `With the new gains the machine stops: ${numbers.stopped}` : `Largest contour error on this path: ${length(before)} before, ${length(after)} with the new gains${after > before ? ": worse. Keep the old gains, or tune by the contour error on this path" : ""}.`;
    const take = make("button", { type: "button", id: "take-gains", onclick: () => {
      this.settings.ownMachine = this.settings.value.machine = machine;
      this.settings.touched(false);
    } }, `Take these gains as ${machine.name}`);
    const sheet = make("div", { class: `tuned${after > before ? " worse" : ""}`, data: { before: String(before), after: String(after) } }, make("p", { role: "status" }, `${machine.name}, ${rule}: ${errors}`), make("div", { class: "row" }, take), table(head, rows));
    for (const name of ["errors", "spectra"]) if (figures[name]) this.figures.sets[name] = figures[name];
    this.figures.add("tuning", figures.tuning, sheet, figures.loops);
  }
}
