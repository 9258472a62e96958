// The settings of this tab: in the form, in the address behind #, and in this tab's storage.
import { $, make, options, show } from "./dom.js";

// limits with a slider: name, label, unit, least and greatest of the slider
const LIMITS = [
  ["feed", "feed", "mm/s", 1, 1000],
  ["acceleration", "acceleration", "mm/s²", 10, 20000],
  ["jerk", "jerk", "mm/s³", 100, 1e6],
  ["axis_velocity", "axis velocity", "mm/s", 1, 1000],
  ["axis_acceleration", "axis acceleration", "mm/s²", 10, 20000],
  ["axis_jerk", "axis jerk", "mm/s³", 100, 1e6],
  ["chord_error", "chord error", "mm", 1e-5, 0.1],
];
const MORE = [
  ["centripetal", "centripetal", "mm/s²", 10, 20000],
  ["deceleration", "deceleration", "mm/s²", 10, 20000],
  ["deceleration_jerk", "jerk, slowing", "mm/s³", 100, 1e6],
  ["axis_velocity_step", "velocity step", "mm/s", 0.1, 100],
];
const STEPS = 400;

const encode = (settings) => {
  const bytes = new TextEncoder().encode(JSON.stringify(settings));
  return btoa(Array.from(bytes, (b) => String.fromCharCode(b)).join("")).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
};

export const decode = (text) => {
  const found = /#?s=([A-Za-z0-9_-]+)/.exec(text);
  if (!found) return null;
  try {
    const bytes = Uint8Array.from(atob(found[1].replaceAll("-", "+").replaceAll("_", "/")), (c) => c.charCodeAt(0));
    return JSON.parse(new TextDecoder().decode(bytes));
  } catch {
    return null;
  }
};

// three digits, as a slider gives them
const rounded = (value) => String(Number(value.toPrecision(3)));
const textOf = (value) => (value !== null && typeof value === "object"
  ? Object.entries(value).map(([axis, each]) => `${axis}=${each}`).join(", ") : String(value ?? ""));

export class Settings {
  // changed(moving): the user has changed something; moving while a slider is being dragged
  constructor(changed) {
    this.changed = changed;
    this.value = null;
    this.inputs = new Map();
    this.ownMachine = null;
  }

  build(offer) {
    this.offer = offer;
    options($("shapes"), [["", "choose ..."], ...offer.shapes.map((each) => [each.example, `${each.name}: ${each.what}`])]);
    options($("strategy"), [["", "by the limits"], ...offer.strategies.map((name) => [name, name])]);
    options($("method"), offer.methods.map((each) => [each.name, each.name]));
    $("limits").replaceChildren(...LIMITS.map((limit) => this.row(limit)));
    $("more-limits").replaceChildren(...MORE.map((limit) => this.row(limit)));
    const on = (id, event, change) => $(id).addEventListener(event, () => { change($(id)); this.touched(false); });
    on("shapes", "change", (e) => { if (e.value) this.value.source = { shape: e.value }; });
    on("shape", "change", (e) => { if (e.value.trim()) this.value.source = { shape: e.value.trim() }; });
    on("which", "change", (e) => {
      const { which, ...source } = this.value.source;
      this.value.source = e.value ? { ...source, which: Number(e.value) } : source;
    });
    on("clearance", "change", (e) => { this.value.source = { ...this.value.source, clearance: e.value.trim() || undefined }; });
    on("keep-order", "change", (e) => { this.value.source = { ...this.value.source, keep_order: e.checked || undefined }; });
    on("chord", "change", (e) => {
      const { chord, ...source } = this.value.source;
      this.value.source = e.value ? { ...source, chord: Number(e.value) } : source;
    });
    on("offsets", "change", (e) => { this.value.source = { ...this.value.source, offsets: e.value.trim() || undefined }; });
    on("by-control", "change", (e) => this.byControl(e.checked));
    on("smooth", "change", (e) => { this.value.smooth = e.value.trim(); });
    on("tangential", "change", (e) => { this.value.tangential = e.checked; });
    on("strategy", "change", (e) => { this.value.strategy = e.value || null; });
    on("method", "change", (e) => { this.value.method = e.value; });
    on("period", "change", (e) => { this.value.period = e.value.trim(); });
    on("machine", "change", (e) => { this.value.machine = e.value === "own:" ? this.ownMachine : e.value ? { name: e.value } : null; });
    $("settings").addEventListener("submit", (event) => event.preventDefault());
  }

  row([name, label, unit, low, high]) {
    const text = make("input", { id: `limit-${name}`, type: "text", spellcheck: "false", inputmode: "decimal", placeholder: "none", "aria-describedby": `unit-${name} error-limits.${name}` });
    const slider = make("input", { type: "range", min: "0", max: String(STEPS), step: "1", "aria-label": `${label}, slider` });
    const error = make("p", { class: "error", id: `error-limits.${name}`, role: "alert", hidden: true });
    const move = (moving) => {
      text.value = rounded(low * (high / low) ** (slider.value / STEPS));
      this.value.limits[name] = text.value;
      slider.setAttribute("aria-valuetext", `${text.value} ${unit}`);
      slider.classList.remove("off");
      this.touched(moving);
    };
    slider.addEventListener("input", () => move(true));
    slider.addEventListener("change", () => move(false));
    text.addEventListener("change", () => {
      const value = text.value.trim();
      if (value) this.value.limits[name] = value; else delete this.value.limits[name];
      this.slide(name, this.said(name));
      this.touched(false);
    });
    this.inputs.set(name, { text, slider, low, high, unit });
    return make("div", { class: "limit", data: { field: `limits.${name}` } },
      make("label", { for: `limit-${name}` }, label), text, make("span", { class: "unit", id: `unit-${name}` }, unit), slider, error);
  }

  // a limit as it stands in its field; null for none, and for what is no bare number
  said(name) { return Number(textOf(this.value.limits[name])) || null; }

  // put a slider where a value in base units is; null for none
  slide(name, value) {
    const { slider, low, high, unit } = this.inputs.get(name);
    slider.classList.toggle("off", value === null);
    if (value === null) { slider.setAttribute("aria-valuetext", "no limit"); return; }
    slider.value = String(Math.round((STEPS * Math.log(value / low)) / Math.log(high / low)));
    slider.setAttribute("aria-valuetext", `${value} ${unit}`);
  }

  touched(moving) {
    this.fill();
    this.keep(moving);
    this.changed(moving);
  }

  load(settings) {
    const usual = this.offer.usual;
    this.value = structuredClone({ ...usual, ...settings, limits: { ...(settings?.limits ?? usual.limits) } });
    if (this.value.machine?.toml) this.ownMachine = this.value.machine;
    this.fill();
    for (const [name] of this.inputs) this.slide(name, this.said(name));
    $("more").open = MORE.some(([name]) => textOf(this.value.limits[name]));
    this.keep();
  }

  // the first settings: of the address, of this tab, or the usual ones; those of a page that was reloaded know its file
  first() {
    const stored = JSON.parse(sessionStorage.getItem("settings"));
    this.value = stored;
    this.load(stored && this.fragment() === location.hash ? stored : decode(location.hash) ?? stored);
  }

  // browsers complain of an address that changes with every pixel of a slider
  keep(moving = false) {
    sessionStorage.setItem("settings", JSON.stringify(this.value));
    if (!moving) history.replaceState(null, "", `/${this.fragment()}`);
  }

  fragment() {
    const { file, ...source } = this.value.source; // an upload is known to this studio alone
    return `#s=${encode({ ...this.value, source })}`;
  }

  // a program is run by a machine that has a control, a motion followed by one that has axes
  byControl(on) {
    const { machine } = this.value;
    const { machines } = this.offer;
    this.value.by_control = on;
    if (machine?.toml || machines.find((each) => each.name === machine?.name)?.[on ? "control" : "axes"]) return;
    this.value.machine = on ? { name: machines.find((each) => each.control).name } : null;
  }

  fill() {
    const { source } = this.value;
    show($("limits-of-axes"), source.format !== "arm");
    if (source.format !== "G-code" && this.value.by_control) this.byControl(false);
    const { limits, machine, by_control: whole } = this.value;
    const own = this.ownMachine ? [["own:", `${this.ownMachine.name} (yours)`]] : [];
    options($("machine"), [["", "none"], ...own, ...this.offer.machines.filter((each) => whole || each.axes).map((each) => [each.name, `${each.name}: ${each.title}`])],
      machine?.toml ? "own:" : machine?.name ?? "");
    $("shape").value = source.shape ?? "";
    $("shape").placeholder = source.shape ? "" : "butterfly?scale=2";
    $("shapes").value = this.offer.shapes.find((each) => each.name === source.shape?.split(/[:?]/)[0])?.example ?? "";
    const named = source.curves ? "edited curve" : source.name;
    show($("source-name"), Boolean(named));
    $("source-name").textContent = [named, source.table].filter(Boolean).join(", tools of ");
    const many = (source.paths ?? []).length;
    show($("which-field"), many > 1);
    if (many > 1) options($("which"), [["", `all ${many} as one motion`], ...source.paths.map((name, k) => [String(k + 1), name])], String(source.which ?? ""));
    for (const name of ["clearance-field", "keep-order-field"]) show($(name), many > 1 && !source.which);
    $("clearance").value = source.clearance ?? "";
    $("keep-order").checked = Boolean(source.keep_order);
    show($("chord-field"), /\.dat$/i.test(source.name ?? ""));
    $("chord").value = source.chord ?? "";
    for (const name of ["control-field", "offsets-field"]) show($(name), source.format === "G-code");
    $("by-control").checked = whole;
    $("offsets").value = source.offsets ?? "";
    $("smooth").value = textOf(this.value.smooth);
    $("tangential").checked = this.value.tangential;
    $("strategy").value = this.value.strategy ?? "";
    $("method").value = this.value.method;
    $("period").value = textOf(this.value.period);
    for (const [name, { text }] of this.inputs) text.value = textOf(limits[name]);
  }

  // show what is wrong beside its field; false if there is a problem without one
  problems(fields) {
    for (const element of document.querySelectorAll(".error")) show(element, false);
    for (const element of document.querySelectorAll("[aria-invalid]")) element.removeAttribute("aria-invalid");
    for (const [field, words] of Object.entries(fields)) {
      const place = $(`error-${field}`) ?? $("error-");
      place.textContent = words;
      show(place, true);
      place.closest("details")?.setAttribute("open", "");
      const box = document.querySelector(`[data-field="${CSS.escape(field)}"]`);
      box?.querySelector("input, select")?.setAttribute("aria-invalid", "true");
    }
  }
}
