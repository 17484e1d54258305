// @ts-check
// Speed and power over the last seconds.

const SECONDS = 20;

export class Chart {
  /** @type {{seconds: number, feed: number, power: number}[]} */
  #past = [];
  #most = 100;
  #rests = false;
  /** The unit of its speeds. @type {import("state").Unit} */
  unit = {mm: 1, name: "mm", digits: 3};

  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
  }

  /**
   * Takes what is; answers whether the chart looks another way with it.
   * @param {{seconds: number, feed: number, power: number}} now
   */
  note(now) {
    const last = this.#past.at(-1);
    if (last && now.seconds < last.seconds) this.#past = [];
    this.#past.push(now);
    while (this.#past[0].seconds < now.seconds - SECONDS) this.#past.shift();
    const rests = this.#past.every(({feed, power}) => feed === 0 && power === now.power);
    const before = this.#rests;
    this.#rests = rests;
    return !rests || !before;
  }

  draw() {
    const {canvas} = this;
    const box = canvas.getBoundingClientRect();
    const density = window.devicePixelRatio || 1;
    const [width, height] = [Math.round(box.width), Math.round(box.height)];
    if (canvas.width !== width * density || canvas.height !== height * density) {
      [canvas.width, canvas.height] = [width * density, height * density];
    }
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    pen.setTransform(density, 0, 0, density, 0, 0);
    pen.clearRect(0, 0, width, height);
    const style = getComputedStyle(document.documentElement);
    const colour = (/** @type {string} */ name) => style.getPropertyValue(name).trim();
    const end = this.#past.at(-1)?.seconds ?? 0;
    const highest = Math.max(100, ...this.#past.map((one) => one.feed)) / this.unit.mm;
    this.#most = highest > this.#most ? round(highest) : highest < this.#most * 0.4 ? round(highest) : this.#most;
    const [left, right, top, floor] = [52, width - 8, 20, height - 18];
    const x = (/** @type {number} */ seconds) => right - ((end - seconds) / SECONDS) * (right - left);
    const y = (/** @type {number} */ share) => floor - share * (floor - top);
    pen.font = "11px system-ui, sans-serif";
    pen.fillStyle = colour("--soft");
    pen.strokeStyle = colour("--grid");
    pen.textAlign = "right";
    for (const share of [0, 0.5, 1]) {
      pen.fillText(String(Math.round(this.#most * share)), left - 6, y(share) + 4);
      line(pen, [[left, y(share)], [right, y(share)]]);
    }
    pen.textAlign = "center";
    for (let ago = 0; ago <= SECONDS; ago += 5) pen.fillText(ago ? `-${ago} s` : "now", Math.min(x(end - ago), right - 12), height - 4);
    pen.save();
    pen.translate(11, height / 2);
    pen.rotate(-Math.PI / 2);
    pen.fillText(`${this.unit.name}/min`, 0, 0);
    pen.restore();
    this.#area(pen, colour("--chart-power"), x, y);
    pen.strokeStyle = colour("--accent");
    pen.lineWidth = 2;
    line(pen, this.#past.map((one) => [x(one.seconds), y(Math.min(one.feed / this.unit.mm / this.#most, 1))]));
    pen.lineWidth = 1;
  }

  /**
   * Draws power as an area: full power is as high as the chart.
   * @param {CanvasRenderingContext2D} pen
   * @param {string} colour
   * @param {(seconds: number) => number} x
   * @param {(share: number) => number} y
   */
  #area(pen, colour, x, y) {
    if (this.#past.length < 2) return;
    pen.fillStyle = colour;
    pen.beginPath();
    pen.moveTo(x(this.#past[0].seconds), y(0));
    for (const one of this.#past) pen.lineTo(x(one.seconds), y(one.power));
    pen.lineTo(x(/** @type {{seconds: number}} */ (this.#past.at(-1)).seconds), y(0));
    pen.fill();
  }
}

/**
 * @param {CanvasRenderingContext2D} pen
 * @param {number[][]} points
 */
function line(pen, points) {
  pen.beginPath();
  points.forEach(([x, y], index) => (index ? pen.lineTo(x, y) : pen.moveTo(x, y)));
  pen.stroke();
}

/** @param {number} value */
function round(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return ([1, 1.5, 2, 3, 5, 7.5, 10].find((factor) => factor * power >= value) ?? 10) * power;
}
