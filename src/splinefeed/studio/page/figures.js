// The figures over time, drawn by Plotly when their tab is looked at; A, where it is pinned, dotted behind.
import { $, make, show } from "./dom.js";
import { Stack, curvesOf } from "./zoom.js";

const NAMES = { tools: "Time of tools", places: "Longest lines", limits: "Limits", motion: "Motion", binding: "Which limit binds", errors: "Axis errors", spectra: "Error spectra", tuning: "Tuning" };
const WORDS = {
  tools: "time along the lines of the program", motion: "travel, feed, acceleration, jerk and axes over time", binding: "the share of each limit over time",
  errors: "errors of the axes over time", spectra: "amplitude of the errors over frequency", tuning: "steps and loops before and after",
};
const PINNED = "#8a8f94";

export class Figures {
  constructor(clock) {
    this.sets = {};
    this.stack = new Stack(clock);
    this.sheets = {};
    this.beside = {}; // figures at the right of others, by their names
    this.chosen = "limits";
    $("tabs").addEventListener("keydown", (event) => {
      const tabs = [...$("tabs").children];
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      const next = tabs[(tabs.findIndex((tab) => tab.dataset.name === this.chosen) + step + tabs.length) % tabs.length];
      this.choose(next.dataset.name);
      next.focus();
    });
  }

  // the library, some MB of script: half a second in which the page does nothing else
  get loaded() {
    this.library ??= new Promise((resolve, reject) => {
      document.head.append(make("script", { src: "/page/plotly.min.js", onload: () => resolve(window.Plotly), onerror: reject }));
    });
    return this.library;
  }

  // figures by name, and sheets: elements that stand in for figures
  set(figures, sheets, pinned) {
    this.sets = { ...figures, ...(this.sets.tuning ? { tuning: this.sets.tuning } : {}) };
    const tuned = this.sheets.tuning;
    if (tuned && !tuned.classList.contains("past")) {
      tuned.classList.add("past");
      tuned.prepend(make("p", { class: "note", role: "status" }, "Tuned on the motion before: these errors are not those of the motion that is shown now. Tune again."));
    }
    this.pinned = pinned;
    this.sheets = { ...sheets, ...(this.sheets.tuning ? { tuning: this.sheets.tuning } : {}) };
    this.tabs();
    this.draw();
    requestAnimationFrame(() => setTimeout(() => this.loaded, 0)); // once the path is on the screen
  }

  // one more figure, with the sheet above it and another figure beside it, and look at it
  add(name, figure, sheet, beside) {
    this.sets = { ...this.sets, [name]: figure };
    this.beside = { [name]: beside };
    this.sheets[name] = sheet;
    this.choose(name);
  }

  tabs() {
    const names = Object.keys(NAMES).filter((name) => this.sets[name] || this.sheets[name]);
    if (!names.includes(this.chosen)) this.chosen = names[0];
    const there = [...$("tabs").children].map((tab) => tab.dataset.name);
    if (there.join() !== names.join()) {
      $("tabs").replaceChildren(...names.map((name) => make("button", { type: "button", role: "tab", id: `tab-${name}`, "aria-controls": "panel", data: { name }, onclick: () => this.choose(name) }, NAMES[name])));
    }
    for (const tab of $("tabs").children) {
      const chosen = tab.dataset.name === this.chosen;
      tab.setAttribute("aria-selected", String(chosen));
      tab.tabIndex = chosen ? 0 : -1;
    }
    $("panel").setAttribute("aria-labelledby", `tab-${this.chosen}`);
  }

  choose(name) {
    this.chosen = name;
    this.tabs();
    this.draw();
  }

  async draw() {
    const name = this.chosen;
    const sheet = this.sheets[name];
    $("sheet").replaceChildren(...(sheet ? [sheet] : []));
    show($("figure"), Boolean(this.sets[name]));
    show($("beside"), Boolean(this.beside[name]));
    if (!this.sets[name]) return;
    $("figure").setAttribute("aria-label", WORDS[name] ?? name);
    const Plotly = await this.loaded;
    if (this.chosen !== name || !this.sets[name]) return;
    const figure = this.sets[name];
    const curves = await curvesOf(figure);
    const pinned = name === "motion" ? this.pinned?.motion : null;
    const behind = pinned ? this.behind(pinned, figure, await curvesOf(pinned)) : [];
    if (this.chosen !== name || this.sets[name] !== figure) return;
    const layout = { ...figure.layout, uirevision: name };
    await this.stack.draw($("figure"), { data: [...behind, ...figure.data], layout }, curves);
    const other = this.beside[name];
    if (!other) return;
    $("beside").setAttribute("aria-label", "gain and phase of the loops over frequency");
    await this.stack.draw($("beside"), other, await curvesOf(other));
  }

  // the curves of A that have a panel in this figure
  behind(pinned, figure, own) {
    return pinned.data.flatMap((trace) => {
      const twin = figure.data.find((each) => each.name === trace.name);
      return twin ? [{ ...trace, own, yaxis: twin.yaxis, name: `A: ${trace.name}`, line: { color: PINNED, width: 1, dash: "dot" } }] : [];
    });
  }
}
