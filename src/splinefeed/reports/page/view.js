// Where a picture of the path lies on the screen: from mm to pixels and back, panned, zoomed, and in space turned.

export const MARGIN = { left: 58, right: 78, top: 16, bottom: 40 };

const BOXED = 96; // left of a box, for what it measures up

export class View {
  constructor() {
    this.turn = [-0.6, 1.05]; // about z, and down from above, rad: a usual look at a part
    this.space = false;
    this.fitWhole = true;
  }

  // a point of the picture's plane in mm, of x, y and z
  flat(x, y, z) {
    if (!this.space) return [x, y];
    const [a, b] = this.turn;
    const along = Math.cos(a) * x - Math.sin(a) * y;
    const away = Math.sin(a) * x + Math.cos(a) * y;
    return [along, Math.cos(b) * away + Math.sin(b) * z];
  }

  fit(points, width, height) {
    let [left, right, low, high] = [Infinity, -Infinity, Infinity, -Infinity];
    for (let k = 0; k < points.x.length; k++) {
      const [u, v] = this.flat(points.x[k], points.y[k], points.z ? points.z[k] : 0);
      if (Number.isNaN(u + v)) continue;
      left = Math.min(left, u); right = Math.max(right, u); low = Math.min(low, v); high = Math.max(high, v);
    }
    const aside = this.space ? BOXED : MARGIN.left;
    const across = width - aside - MARGIN.right;
    const up = height - MARGIN.top - MARGIN.bottom;
    this.square = !points.overTime;
    this.scaleX = (0.94 * across) / Math.max(right - left, 1e-9);
    this.scaleY = (0.94 * up) / Math.max(high - low, 1e-9);
    if (this.square) this.scaleX = this.scaleY = Math.min(this.scaleX, this.scaleY);
    this.middle = [(left + right) / 2, (low + high) / 2];
    this.centre = [aside + across / 2, MARGIN.top + up / 2];
    this.fitWhole = true;
  }

  screen(x, y, z) {
    const [u, v] = this.flat(x, y, z);
    return [this.centre[0] + this.scaleX * (u - this.middle[0]), this.centre[1] - this.scaleY * (v - this.middle[1])];
  }

  // mm at a pixel, in the plane
  place(px, py) {
    return [this.middle[0] + (px - this.centre[0]) / this.scaleX, this.middle[1] - (py - this.centre[1]) / this.scaleY];
  }

  pan(dx, dy) {
    this.middle = [this.middle[0] - dx / this.scaleX, this.middle[1] + dy / this.scaleY];
    this.fitWhole = false;
  }

  zoom(factor, px, py) {
    const [u, v] = this.place(px, py);
    this.scaleX *= factor; this.scaleY *= factor;
    const [u2, v2] = this.place(px, py);
    this.middle = [this.middle[0] + u - u2, this.middle[1] + v - v2];
    this.fitWhole = false;
  }

  rotate(dx, dy) {
    this.turn = [this.turn[0] + 0.01 * dx, Math.min(Math.max(this.turn[1] + 0.01 * dy, 0), Math.PI)];
  }
}

// round numbers between two values, some `count` of them
export const ticks = (low, high, count) => {
  const raw = (high - low) / Math.max(count, 1);
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((digit) => digit * power).find((each) => each >= raw);
  const found = [];
  for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  return { at: found, text: (value) => (Math.abs(value) < step / 2 ? "0" : String(Number(value.toPrecision(6)))) };
};
