// The page: puts its parts together, and asks for a plan whenever something has changed.
import { $, show } from "./dom.js";
import { Editor } from "./edit.js";
import { Downloads, Jobs } from "./jobs.js";
import { Figures } from "./figures.js";
import { History } from "./history.js";
import { Link } from "./link.js";
import { PathPicture } from "./path.js";
import { Play } from "./play.js";
import { Program } from "./program.js";
import { Settings } from "./settings.js";
import { Share } from "./share.js";
import { limitsSheet, showCompared, showNumbers } from "./numbers.js";
import { Clock, timeBar } from "./time.js";
import { Tune } from "./tune.js";
import { curvesOf } from "./zoom.js";
import { takeFiles } from "./files.js";

const REST = 350; // ms without a change, after which the whole is planned

const link = new Link();
const picture = new PathPicture();
const clock = new Clock();
const figures = new Figures(clock);
const settings = new Settings((moving) => planner.want(moving));
const jobs = new Jobs(link);
const editor = new Editor(settings, picture);
const program = new Program(picture, figures, clock);
const play = new Play(link, settings, picture);
const tune = new Tune(link, settings, figures);
const downloads = new Downloads(link, settings);

clock.on((t) => { if (!play.on) picture.when(t); program.when(t); });
timeBar(clock, $("time"), () => (document.body.dataset.view === "program" ? program.said() : ""));

// what is being done, since when, and how to stop it; the numbers of before are dimmed meanwhile
const doing = {
  timer: 0,
  begin(kind, words) {
    if (document.body.dataset.busy === undefined) this.since = performance.now();
    document.body.dataset.busy = kind;
    this.words = words;
    clearInterval(this.timer);
    this.timer = setInterval(() => this.show(), 100);
  },
  show() {
    const seconds = (performance.now() - this.since) / 1000;
    show($("doing"), seconds > 0.3); // most end sooner
    const job = [...jobs.known.values()].find((each) => each.kind === "settle" && each.tab === link.tab);
    $("doing-words").textContent = `${job?.words || this.words}: ${seconds.toFixed(1)} s`;
  },
  end() {
    if (planner.asked) return; // newer settings came meanwhile, and are being planned
    delete document.body.dataset.busy;
    clearInterval(this.timer);
    show($("doing"), false);
  },
  stop() {
    link.send({ do: "stop" });
    planner.halt();
    this.end();
    $("verdict").className = "verdict bad";
    $("verdict").textContent = "Stopped: the numbers below are of the settings before.";
    document.body.dataset.shown = "stopped";
  },
};
$("stop-plan").addEventListener("click", () => doing.stop());

// one plan at a time is asked for, always the latest; when nothing moves any more, the final one
const planner = {
  number: 0, asked: null, wanted: false, timer: 0,
  want(moving) {
    this.wanted = true;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.rest(), moving ? REST : 30);
    if (moving) this.ask(false);
  },
  ask(rest) {
    if (this.asked || !link.open) return;
    this.number += 1;
    this.wanted = false;
    this.asked = { n: this.number, rest, at: performance.now(), settings: structuredClone(settings.value) };
    // while something moves, what is looked at is enough
    const look = rest ? null : { figure: figures.chosen, colour: $("colour").value };
    link.send({ do: "plan", n: this.number, settings: settings.value, rest, look });
    doing.begin("plan", `planning ${settings.value.by_control ? settings.value.source.name : settings.value.strategy || "by the limits"}`);
  },
  rest() {
    if (this.asked) { this.resting = true; return; }
    this.resting = false;
    settings.keep();
    this.ask(true);
  },
  halt() {
    clearTimeout(this.timer);
    this.asked = null;
    this.wanted = this.resting = false;
  },
  answered(n) {
    if (this.asked?.n !== n) return null;
    const asked = this.asked;
    this.asked = null;
    if (this.resting) this.rest();
    else if (this.wanted) this.ask(false);
    return asked;
  },
};

const now = { result: null, shown: null, pinned: null, final: false };

const render = async (result, shown, final, whole = true) => {
  now.rendered = result;
  const curves = await curvesOf(result.path);
  if (now.rendered !== result) return; // another came meanwhile
  const whose = result.program === undefined ? "motion" : "program";
  document.body.dataset.view = whose;
  settings.problems({});
  if (whose === "program") {
    Object.assign(now, { result: null, final });
    editor.set(null);
    play.order({ stop: true });
    program.set(result, shown, curves);
    document.body.dataset.shown = "final";
    return;
  }
  Object.assign(now, { result, shown, final });
  const { numbers, words, units } = result;
  showNumbers(numbers, words, shown, !final);
  picture.set(result.path, curves);
  clock.until(numbers.duration_s);
  editor.set(result.curves);
  play.ready();
  tune.ready();
  figures.set(whole ? result.figures : { ...figures.sets, ...result.figures }, { limits: limitsSheet(numbers, words, units) }, now.pinned?.result.figures);
  for (const [name] of settings.inputs) settings.slide(name, numbers.settings.limits[name] ?? settings.said(name));
  compare();
  $("pin").disabled = false;
  downloads.offer(result, final);
  document.body.dataset.shown = final && whole ? "final" : "preview";
};

const sideOf = (numbers, words, shown) => {
  const { limits, ...rest } = numbers.settings;
  return { numbers, words, shown, flat: { ...limits, strategy: numbers.strategy, method: numbers.method, period: rest.period, machine: numbers.machine, path: numbers.name } };
};

const compare = () => {
  const { pinned, result, shown } = now;
  showCompared(pinned && sideOf(pinned.result.numbers, pinned.result.words, pinned.shown), result && sideOf(result.numbers, result.words, shown));
};

const pin = (on) => {
  now.pinned = on ? { result: now.result, shown: now.shown } : null;
  $("pin").textContent = on ? "Unpin A" : "Pin as A";
  $("pin").setAttribute("aria-pressed", String(on));
  figures.pinned = now.pinned?.result.figures;
  figures.draw();
  compare();
};
$("pin").addEventListener("click", () => pin(!now.pinned));

link.on("welcome", (message) => {
  if (!settings.value) {
    settings.build(message.offer);
    downloads.build(message.offer);
    settings.first();
  }
  $("state").textContent = message.state;
  jobs.all(message.jobs);
  planner.asked = null;
  if (message.state === "ready") planner.want(false);
  document.body.dataset.ready = "yes";
});
link.on("state", (message) => {
  const before = $("state").textContent;
  $("state").textContent = message.words;
  document.body.dataset.state = message.words;
  if (message.words === "ready" && before !== "ready") planner.want(false);
});
link.on("lost", () => { $("state").textContent = "not connected: is splinefeed studio running?"; });

link.on("planned", (message) => {
  const asked = planner.answered(message.n);
  if (!asked) return;
  const { final, shown, result } = message.answer;
  if (result) render(result, shown, final, asked.rest);
  document.body.dataset.took = String(Math.round(performance.now() - asked.at));
  doing.end();
  if (!final && asked.rest && !planner.asked) {
    link.send({ do: "job", kind: "settle", title: settings.value.by_control ? settings.value.source.name : settings.value.strategy ?? "", settings: settings.value });
    doing.begin("settle", `planning ${settings.value.by_control ? settings.value.source.name : settings.value.strategy || "by the limits"}`);
  }
});
link.on("refused", (message) => {
  planner.answered(message.n);
  doing.end();
  settings.problems(message.error.fields);
  $("verdict").className = "verdict bad";
  $("verdict").textContent = "These settings cannot be run; see the messages beside them.";
});
link.on("done", (message) => {
  const { kind } = message.job;
  if (kind === "settle" && JSON.stringify(message.settings) === JSON.stringify(settings.value)) {
    const { result, shown, final } = message.answer;
    render(result, shown, final);
    doing.end();
  }
  if (kind === "make") downloads.fetch(message.answer);
  if (kind === "tune") tune.show(message.answer);
  if (kind === "read") opened(message.answer);
});
link.on("failed", (message) => {
  doing.end();
  settings.problems(message.error.fields);
});

let reading = null;
let tools = {};
let robot = {};
const read = (source) => { reading = source; link.send({ do: "job", kind: "read", title: source.name, source }); };
const opened = (found) => {
  const source = { ...reading, name: found.name, format: found.format };
  if (found.paths.length > 1) Object.assign(source, { paths: found.paths.map((each) => `${each.name} (${each.curves} curves)`) });
  if (found.format === "G-code" && settings.value.source.file !== source.file) settings.byControl(true);
  settings.value.source = source;
  settings.touched(false);
};
takeFiles({
  dropped: (source) => read({ ...source, ...tools, ...(/\.json$/i.test(source.name) ? robot : {}) }),
  robot: ({ file, name }) => {
    robot = { robot: file };
    const source = reading ?? settings.value.source;
    if (/\.json$/i.test(source.name ?? "")) read({ ...source, ...robot }); else settings.problems({ source: `${name} is kept for the motion that is dropped next` });
  },
  tools: ({ file, name }) => {
    tools = { tools: file, table: name };
    const source = reading ?? settings.value.source;
    if (source.file) read({ ...source, ...tools }); else settings.problems({ source: `${name} is kept for the program that is dropped next` });
  },
  machine: (name, toml) => { settings.ownMachine = settings.value.machine = { name, toml }; settings.touched(false); },
  settings: (text) => link.send({ do: "share", text }),
  refused: (words) => settings.problems({ source: words }),
});
link.on("opened", (message) => {
  if (message.pin && now.result) pin(true);
  settings.load(message.settings);
  planner.want(false);
});

const history = new History(link);
const share = new Share(link, settings);
link.on("entries", (message) => history.show(message));
link.on("history", () => history.ask());
link.on("toml", (message) => share.toml(message.text));

const wear = (theme) => {
  document.documentElement.dataset.theme = theme;
  picture.draw();
  figures.draw();
};
wear(localStorage.getItem("theme") ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"));
$("theme").addEventListener("click", () => {
  const theme = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
  localStorage.setItem("theme", theme);
  wear(theme);
});
window.addEventListener("hashchange", () => { settings.first(); planner.want(false); });
for (const button of document.querySelectorAll("dialog .close")) button.addEventListener("click", () => button.closest("dialog").close());
show($("shown"), false);
Object.assign(window, { picture, clock }); // for people who look at the page from outside, such as its tests
link.connect();
