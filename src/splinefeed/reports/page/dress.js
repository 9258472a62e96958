// What figures wear: Plotly knows no style sheets, so colours of the page's theme are put into their plain data.
// Report and studio share this file.

// matplotlib's viridis (CC0), ten of its colours; white paper does not show the brightest, nor the night the darkest
const VIRIDIS = ["#440154", "#482878", "#3e4989", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b", "#fde725"];
const SEEN = { light: [0, 0.9], dark: [0.14, 1] };
// colours of lines in the dark, by those on white paper
const DARK = { "#0072b2": "#56b4e9", "#d55e00": "#f0803c", "#009e73": "#2bc79a", "#772200": "#ee0055", "#1a1a1a": "#ececec", "#6b6b6b": "#a9afb5", "#8800ff": "#8844ff", "#7a3e9d": "#c9a0e8", "#b84f00": "#f0803c", "#007a59": "#2bc79a", "#a34f7b": "#cc79a7" };

const isDark = () => document.documentElement.dataset.theme === "dark";

export const colours = () => {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(["ink", "paper", "panel", "line", "faint", "bar", "bad"].map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
};

// the colour of viridis at a share of what is seen of it, 0 to 1
export const shade = (share) => {
  const [from, to] = SEEN[isDark() ? "dark" : "light"];
  const at = (from + (to - from) * Math.min(Math.max(share, 0), 1)) * (VIRIDIS.length - 1);
  const low = Math.min(Math.floor(at), VIRIDIS.length - 2);
  const part = (hex, k) => parseInt(hex.slice(1 + 2 * k, 3 + 2 * k), 16);
  return `rgb(${[0, 1, 2].map((k) => Math.round(part(VIRIDIS[low], k) + (at - low) * (part(VIRIDIS[low + 1], k) - part(VIRIDIS[low], k)))).join(",")})`;
};
const scale = () => Array.from({ length: 17 }, (_, k) => [k / 16, shade(k / 16)]);

const dyed = (text) => (isDark() ? text.replace(/#[0-9a-f]{6}\b/gi, (colour) => DARK[colour.toLowerCase()] ?? colour) : text);

// the colour of an area, by that of its edge
const faded = (colour) => `rgba(${[1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16)).join(",")},0.35)`;

const dressedTrace = (trace) => {
  const own = (paint) => paint && { ...paint, ...(typeof paint.color === "string" ? { color: dyed(paint.color) } : {}), ...(paint.colorscale ? { colorscale: scale() } : {}) };
  const out = { ...trace };
  if (trace.line) out.line = own(trace.line);
  if (trace.fillcolor) out.fillcolor = faded(out.line.color);
  if (trace.marker) out.marker = own(trace.marker);
  if (trace.colorscale) out.colorscale = scale();
  return out;
};

// a colour bar across the top, where there is no room beside the figure
const across = { orientation: "h", x: 0.5, xanchor: "center", y: 1, yanchor: "bottom", lenmode: "fraction", len: 1, thickness: 10 };
const narrowTrace = (trace) => {
  const own = (paint) => (paint?.colorbar ? { ...paint, colorbar: { ...paint.colorbar, ...across, ypad: trace.type === "heatmap" ? 24 : 10, title: { ...paint.colorbar.title, side: "top" } } } : paint);
  return { ...own(trace), ...(trace.line ? { line: own(trace.line) } : {}), ...(trace.marker ? { marker: own(trace.marker) } : {}) };
};

const dressedLayout = (layout, c) => {
  const axis = { gridcolor: c.line, zerolinecolor: c.line, linecolor: c.faint };
  const out = { uirevision: "kept", ...layout, paper_bgcolor: c.paper, plot_bgcolor: c.paper, font: { ...layout.font, color: c.ink },
    hoverlabel: { bgcolor: c.paper, bordercolor: c.faint, font: { color: c.ink } } };
  for (const key of Object.keys(layout)) if (/^[xy]axis\d*$/.test(key)) out[key] = { ...layout[key], ...axis };
  if (layout.annotations) out.annotations = layout.annotations.map((each) => ({ ...each, text: dyed(each.text) }));
  if (layout.shapes) out.shapes = layout.shapes.map((each) => ({ ...each, line: { ...each.line, color: dyed(each.line.color) }, ...(each.label ? { label: { ...each.label, font: { ...each.label.font, color: dyed(each.label.font.color) } } } : {}) }));
  if (layout.scene) {
    out.scene = { ...layout.scene };
    for (const name of ["xaxis", "yaxis", "zaxis"]) {
      out.scene[name] = { ...layout.scene[name], gridcolor: c.line, zerolinecolor: c.faint, linecolor: c.faint, showbackground: false, showspikes: false };
    }
  }
  return out;
};

// a figure with less around it: for the width of a telephone
const narrow = ({ data, layout }, width) => {
  const heat = data.some((trace) => trace.type === "heatmap");
  const bar = data.some((trace) => trace.colorbar || trace.marker?.colorbar || trace.line?.colorbar);
  const margin = { ...layout.margin, l: heat ? Math.min(0.85 * layout.margin.l, 0.42 * width) : Math.min(layout.margin?.l ?? 62, 54), r: 14, ...(bar ? { t: heat ? 96 : 64 } : {}) };
  const out = { ...layout, margin };
  for (const { yaxis } of data.filter((trace) => trace.type === "heatmap")) { // room for the names of its rows
    const key = yaxis.replace("y", "yaxis");
    out[key] = { ...layout[key], tickfont: { size: 10.5 } };
    out.height = layout.height + 100;
  }
  if (layout.shapes) out.shapes = layout.shapes.map((each) => (each.label ? { ...each, label: { ...each.label, textposition: "start" } } : each));
  // many curves of a panel: their names in a line of their own below what they are
  if (layout.annotations) out.annotations = layout.annotations.map((each) => (each.text.split("<span").length > 2 ? { ...each, text: each.text.replace("  <span", "<br><span"), align: "left", font: { size: 10.5 } } : each));
  if (layout.scene || layout.yaxis?.scaleanchor) out.height = Math.round(0.95 * width);
  if (layout.scene) out.margin = { l: 4, r: 4, t: 64, b: 4 };
  return { data: data.map(narrowTrace), layout: out };
};

// a figure, plain data as Python made it, as this page shows it
export const dressed = (figure) => {
  const width = document.documentElement.clientWidth;
  const { data, layout } = width < 640 ? narrow(figure, width) : figure;
  return { data: data.map(dressedTrace), layout: dressedLayout(layout, colours()) };
};
