// What tests ask of a page: words that cannot be read, what keys can reach, and what has the focus.

const parts = (colour) => {
  const numbers = colour.match(/[\d.]+/g).map(Number);
  const scale = colour.startsWith("color(srgb") ? 255 : 1;
  return [...numbers.slice(0, 3).map((value) => scale * value), numbers[3] ?? 1];
};
const over = ([r, g, b, a], under) => [r, g, b].map((value, k) => a * value + (1 - a) * under[k]);
const light = (colour) => {
  const [r, g, b] = colour.map((v) => (v / 255 <= 0.03928 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
};
const behind = (element) => {
  const layers = [];
  for (let each = element; each; each = each.parentElement) layers.push(parts(getComputedStyle(each).backgroundColor));
  return layers.reverse().reduce((colour, next) => over(next, colour), [255, 255, 255]);
};
const OUT = "script, style, noscript, option, :disabled, [aria-disabled=true]";

// Words whose contrast with what is behind them is below 4.5 : 1, or 3 : 1 where they are large; those of disabled
// fields are left out, as WCAG 2.2 (1.4.3) does.
const faint = () => {
  const found = [], walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const text = walk.currentNode.textContent.trim(), element = walk.currentNode.parentElement;
    if (!/[\p{L}\p{N}]/u.test(text) || !element.getClientRects().length || element.closest(OUT)) continue;
    const style = getComputedStyle(element), paint = element instanceof SVGElement ? style.fill : style.color;
    if (style.visibility === "hidden" || !/^(rgb|color)/.test(paint)) continue;
    const back = behind(element);
    const [high, low] = [light(over(parts(paint), back)), light(back)].sort((x, y) => y - x);
    const ratio = (high + 0.05) / (low + 0.05), size = parseFloat(style.fontSize);
    const large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
    if (ratio < (large ? 3 : 4.5)) found.push(`${ratio.toFixed(2)} ${element.tagName} ${text.slice(0, 40)}`);
  }
  return found;
};

// All that is seen and can have the focus, each by a mark of its own.
const CAN = "a[href], button, input:not([type=radio]), select, textarea, summary, [tabindex='0']";
const reachable = () => [...document.querySelectorAll(CAN)]
  .filter((each) => !each.disabled && each.tabIndex >= 0 && each.checkVisibility({ visibilityProperty: true }))
  .map((each) => (each.dataset.stop ??= String(Math.random())));

// What has the focus: its mark, whether one sees that it has it, and what it is.
const here = () => {
  const element = document.activeElement, around = element.closest("label, .drop") ?? element;
  const ringed = (each) => getComputedStyle(each).outlineStyle !== "none" || getComputedStyle(each).boxShadow !== "none";
  const seen = element === document.body || ringed(element) || ringed(around);
  return [element.dataset.stop ?? "", seen, element.outerHTML.slice(0, 90)];
};

const named = (marks) => marks.map((mark) => document.querySelector(`[data-stop="${mark}"]`)?.outerHTML.slice(0, 90));
