"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const root = document.documentElement;
  const small = () => window.innerWidth < 640;
  const config = { responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d"] };

  const colours = () => {
    const style = getComputedStyle(root);
    const of = (name) => style.getPropertyValue(name).trim();
    return { ink: of("--ink"), paper: of("--paper"), line: of("--line"), faint: of("--faint") };
  };

  // what the theme says of a layout, by dotted names that Plotly.relayout takes
  const themed = (layout) => {
    const c = colours();
    const out = { "font.color": c.ink, paper_bgcolor: c.paper, plot_bgcolor: c.paper,
      "hoverlabel.bgcolor": c.paper, "hoverlabel.bordercolor": c.line, "hoverlabel.font.color": c.ink };
    for (const key of Object.keys(layout)) {
      if (/^[xy]axis\d*$/.test(key)) {
        out[key + ".gridcolor"] = c.line; out[key + ".zerolinecolor"] = c.line; out[key + ".linecolor"] = c.faint;
      }
      if (key === "scene") {
        for (const a of ["xaxis", "yaxis", "zaxis"]) {
          out[`scene.${a}.gridcolor`] = c.line; out[`scene.${a}.backgroundcolor`] = c.paper;
          out[`scene.${a}.zerolinecolor`] = c.line;
        }
      }
    }
    return out;
  };

  // figures are drawn one by one, so that the numbers can be read and the page moved meanwhile; all at once for a printer
  const drawn = [];
  const waiting = Object.entries(data.figures).filter(([id]) => document.getElementById(id));
  const draw = () => {
    const [id, figure] = waiting.shift();
    const place = document.getElementById(id);
    if (small()) {
      figure.layout.margin.l = Math.min(figure.layout.margin.l, 62);
      if (id === "path") figure.layout.height = Math.round(0.85 * window.innerWidth);
    }
    for (const [name, value] of Object.entries(themed(figure.layout))) {
      const steps = name.split(".");
      const last = steps.pop();
      let at = figure.layout;
      for (const step of steps) at = at[step] ??= {};
      at[last] = value;
    }
    Plotly.newPlot(place, figure.data, figure.layout, config);
    drawn.push(place);
  };
  const drawAll = () => { while (waiting.length) draw(); };
  const drawNext = () => {
    if (waiting.length) draw();
    if (waiting.length) setTimeout(drawNext, 0);
    else root.dataset.ready = "yes";
  };

  const apply = (theme) => {
    root.dataset.theme = theme;
    for (const place of drawn) Plotly.relayout(place, themed(place.layout));
  };
  const wished = window.matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
  root.dataset.theme = wished;
  drawNext();
  let before = wished; // paper is white
  window.addEventListener("beforeprint", () => { drawAll(); before = root.dataset.theme; apply("light"); });
  window.addEventListener("afterprint", () => apply(before));
  document.getElementById("theme").addEventListener("click", () => apply(root.dataset.theme === "dark" ? "light" : "dark"));

  const choice = document.getElementById("colour");
  if (choice) choice.addEventListener("change", () => {
    const chosen = data.colours[choice.value];
    const bar = { title: { text: chosen.label, side: "right" }, thickness: 14 };
    const key = data.space ? "line" : "marker";
    Plotly.restyle("path", { [key + ".color"]: [chosen.values], [key + ".cmin"]: chosen.low, [key + ".cmax"]: chosen.high,
      [key + ".colorbar.title.text"]: bar.title.text }, [data.space ? 0 : 1]);
  });

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
})();
