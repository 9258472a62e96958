// The numbers of a run: the verdict, cards, the table of limits, and two runs side by side.
import { $, make, show, table } from "./dom.js";

const ROTARY = ["a", "b", "c", "theta"];

export const digits = (value, count = 6) => (value === null || value === undefined ? "none" : Number(value.toPrecision(count)).toString().replace("e+", "e"));

// a length in the unit that suits it
export const length = (value) => {
  if (value === null || value === undefined) return "none";
  if (value === 0) return "0";
  for (const [unit, factor, least] of [["mm", 1, 1], ["µm", 1e3, 1e-3], ["nm", 1e6, 1e-6]]) {
    if (Math.abs(value) >= least) return `${digits(value * factor, 3)} ${unit}`;
  }
  return `${value.toPrecision(2)} mm`;
};

const worst = (numbers) => Object.entries(numbers.limits).sort((one, two) => two[1].share - one[1].share)[0];
const percent = (share, count = 4) => `${digits(100 * share, count)} %`;

// title, key of the page of numbers, text, and words below
const cardsOf = (n, words) => {
  const cards = [["cycle time", "duration_s", `${digits(n.duration_s)} s`, `${n.ticks} setpoints`]];
  if (Object.values(n.axes)[0]?.unit === "mm") cards.push(["path length", "length_mm", `${digits(n.length_mm)} mm`, ""]);
  if (n.lower_bound_s) cards.push(["lower bound", "lower_bound_s", `${digits(n.lower_bound_s)} s`, "no motion within these limits is faster"]);
  const top = worst(n);
  if (top) cards.push(["largest share", "share", percent(top[1].share), words[top[0]] ?? top[0]]);
  for (const { name, key, unit, beside } of words.measures ?? []) {
    if (unit && unit !== (n.unit ?? "mm")) continue;
    cards.push([name, key, unit ? length(n[key]) : digits(n[key], 2), beside ? `${beside[0]} ${digits(n[beside[1]], 2)}` : "at most"]);
  }
  if (n.contour_error_max_mm !== undefined && n.contour_error_max_mm !== null) {
    cards.push(["contour error", "contour_error_max_mm", length(n.contour_error_max_mm), `rms ${length(n.contour_error_rms_mm)}`]);
  }
  for (const [axis, value] of Object.entries(n.tracking_error_max ?? {})) {
    cards.push([`following error ${axis}`, `tracking_error_max.${axis}`, ROTARY.includes(axis) ? `${digits(value, 3)}°` : length(value), "largest"]);
  }
  return cards;
};

const valueOf = (n, key) => (key === "share" ? worst(n)[1].share : key.split(".").reduce((at, name) => at?.[name], n));

const verdict = (n, words) => {
  if (n.ok) return `Checked: every limit holds, ${words.allowed}, in ${digits(n.duration_s)}\u00a0s.`;
  if (n.stopped) return `The machine stopped: ${n.stopped}`;
  const over = Object.entries(n.limits).filter(([, each]) => !each.ok).map(([name]) => words[name] ?? name);
  return over.length ? `Not kept: ${over.join(", ")}.` : `Not kept: ${n.problems[0] ?? "see the notes"}`;
};

// the verdict, what made it, and cards
export const showHead = (n, good, words, shown, cards) => {
  $("verdict").className = `verdict ${good ? "good" : "bad"}`;
  $("verdict").textContent = words;
  show($("shown"), true);
  $("shown").className = "badge";
  $("shown").textContent = shown;
  $("cards").replaceChildren(...cards.map(([title, key, text, below]) =>
    make("div", {}, make("dt", {}, title), make("dd", { data: { key, value: String(valueOf(n, key)) } }, text, make("small", {}, below)))));
};

export const showNumbers = (n, words, shown, preview) => {
  showHead(n, n.ok, verdict(n, words), preview ? `preview: ${shown}` : shown, cardsOf(n, words));
  $("shown").classList.toggle("preview", preview);
  $("notes").replaceChildren(...n.problems.map((text) => make("li", { class: "bad" }, text)), ...n.notes.map((text) => make("li", {}, text)));
};

export const limitsSheet = (n, words, units) => {
  const row = ([name, each]) => {
    const unit = units[name] ?? "";
    const state = each.ok ? "good" : "bad";
    const bar = make("span", { class: state });
    bar.style.width = `${Math.min(100 * each.share, 100).toFixed(2)}%`;
    const binds = n.bound_by[name];
    return make("tr", { data: { limit: name, worst: String(each.worst) } },
      make("td", {}, words[name] ?? name), make("td", {}, `${digits(each.worst, 5)} ${unit}`), make("td", {}, `${digits(each.limit, 5)} ${unit}`),
      make("td", {}, `${(100 * each.share).toFixed(4)} %`), make("td", { class: "share" }, bar), make("td", {}, `${digits(each.at_s)} ${units.s}`),
      make("td", {}, binds ? percent(binds, 3) : ""), make("td", { class: state }, each.ok ? "holds" : "OVER"));
  };
  return table(["limit", "worst", "allowed", "share", "", "at place", "binds", ""], Object.entries(n.limits).map(row));
};

// A and B side by side; settings that differ on top
export const showCompared = (a, b) => {
  show($("compare"), Boolean(a && b));
  if (!a || !b) return;
  const settings = Object.entries({ ...a.flat, ...b.flat }).filter(([name]) => a.flat[name] !== b.flat[name])
    .map(([name]) => [name.replace(/_/g, " "), a.flat[name] ?? "none", b.flat[name] ?? "none"]);
  const right = Object.fromEntries(cardsOf(b.numbers, b.words).map(([, key, text]) => [key, text]));
  const left = Object.fromEntries(cardsOf(a.numbers, a.words).map(([, key, text]) => [key, text]));
  const titles = Object.fromEntries([...cardsOf(a.numbers, a.words), ...cardsOf(b.numbers, b.words)].map(([title, key]) => [key, title]));
  const results = Object.entries(titles).map(([key, title]) => [title, left[key] ?? "none", right[key] ?? "none"]);
  const row = (kind) => ([title, one, two]) => make("tr", { class: kind }, make("th", { scope: "row" }, title), make("td", {}, one), make("td", {}, two));
  $("compare").replaceChildren(make("h2", {}, "A and B"), make("div", { class: "scroll" }, make("table", { class: "compared" },
    make("thead", {}, make("tr", {}, make("th", {}, ""), make("th", { scope: "col" }, `A: ${a.shown}`), make("th", { scope: "col" }, `B: ${b.shown}`))),
    make("tbody", {}, ...settings.map(row("setting")), ...results.map(row("result"))))));
};
