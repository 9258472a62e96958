// The page of a report: figures come one by one, those in sight first; light and dark, colours, printing.
import { dressed } from "./dress.js";
import { numbersOf } from "./dom.js";
import { Listing } from "./listing.js";
import { PathPicture } from "./path.js";
import { Clock, timeBar } from "./time.js";
import { Curves, Stack, firstNotBelow, unpacked } from "./zoom.js";

{
  const { figures, series, program } = JSON.parse(document.getElementById("data").textContent);
  const root = document.documentElement;
  const clock = new Clock();
  const stack = new Stack(clock);
  const picture = figures.path ? new PathPicture() : null;
  root.dataset.theme = window.matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";

  // room for each figure from the start, so that nothing moves when it comes
  const waiting = Object.entries(figures).map(([id, figure]) => ({ place: document.getElementById(id), figure })).filter(({ place, figure }) => place && figure.layout);
  for (const { place, figure } of waiting) place.style.minHeight = `${dressed(figure).layout.height}px`;
  const drawn = [];

  // Plotly lies in the page compressed, which is read sooner than the whole
  const text = (id) => document.getElementById(id).textContent;
  let curves = null;
  const library = async () => {
    const script = document.createElement("script");
    script.textContent = new TextDecoder().decode(await unpacked(text("plotly")));
    if (series.length) curves = new Curves(series, await unpacked(text("points")));
    document.head.append(script); // runs at once
    if (!picture) return;
    picture.set(figures.path, curves);
    const { track } = picture;
    if (!track) return;
    clock.on((t) => picture.when(t));
    timeBar(clock, document.getElementById("time"), program ? listed() : undefined);
    clock.until(track.t[track.t.length - 1]);
    window.clock = clock; // for people who look at the page from outside, such as its tests
    window.picture = picture;
  };

  // the lines of the program follow the time, and set it; gives what is said of the time
  const listed = () => {
    const begin = numbersOf(program.begin), line = numbersOf(program.line);
    const at = (t) => line[Math.max(firstNotBelow(begin, t + 1e-9) - 1, 0)];
    if (!program.text) return (t) => `line ${at(t)}`;
    let choosing = false;
    const list = new Listing(document.getElementById("listing"), (chosen) => {
      const k = line.indexOf(chosen);
      choosing = true; // a line without a move stays chosen
      list.look(chosen);
      if (k >= 0) clock.to(begin[k]);
      choosing = false;
    });
    list.set(program.text);
    clock.on((t) => { if (!choosing && at(t) !== list.line) list.look(at(t)); });
    return (t) => `line ${at(t)}`;
  };

  const PAPER = { width: 690, height: 940, path: 440 }; // what fits on A4 and on Letter, pixels
  let printing = false;
  const show = ({ place, figure }) => {
    const size = printing ? { width: PAPER.width, height: Math.min(dressed(figure).layout.height, PAPER[place.id] ?? PAPER.height) } : {};
    return stack.draw(place, figure, curves, { size });
  };

  // figures are drawn one by one, those in sight first
  const draw = () => {
    const inSight = ({ place }) => { const box = place.getBoundingClientRect(); return box.bottom > 0 && box.top < window.innerHeight; };
    const next = waiting.find(inSight) ?? waiting[0];
    waiting.splice(waiting.indexOf(next), 1);
    drawn.push(next);
    show(next);
    root.dataset.drawn = drawn.map(({ place }) => place.id).join(" ");
  };
  const drawAll = () => { while (window.Plotly && waiting.length) draw(); };
  const drawNext = () => {
    if (waiting.length) draw();
    if (waiting.length) setTimeout(drawNext, 0);
    else { root.dataset.ready = "yes"; performance.mark("ready"); }
  };
  const begin = () => library().then(drawNext, () => {
    for (const { place } of waiting) place.textContent = "This browser is too old to draw the figures; the numbers do not need it.";
  });
  // after the first paint; a page that is not looked at is never painted
  if (document.hidden) begin(); else requestAnimationFrame(() => setTimeout(begin, 0));

  const apply = (theme) => {
    root.dataset.theme = theme;
    for (const each of drawn) show(each);
    picture?.paint();
  };
  let before = root.dataset.theme; // paper is white, and narrower than a window
  window.addEventListener("beforeprint", () => {
    drawAll();
    before = root.dataset.theme;
    printing = true;
    apply("light");
  });
  window.addEventListener("afterprint", () => {
    printing = false;
    apply(before);
    for (const { place } of drawn) Plotly.Plots.resize(place);
  });
  document.getElementById("theme").addEventListener("click", () => apply(root.dataset.theme === "dark" ? "light" : "dark"));

  const copy = document.getElementById("copy");
  if (copy) copy.addEventListener("click", async (event) => {
    const text = document.getElementById("command").textContent;
    try {
      await navigator.clipboard.writeText(text);
      event.target.textContent = "copied";
    } catch {
      const range = document.createRange();
      range.selectNodeContents(document.getElementById("command"));
      const selection = window.getSelection();
      selection.removeAllRanges();
      selection.addRange(range);
      event.target.textContent = "selected: press Ctrl-C";
    }
  });
}
