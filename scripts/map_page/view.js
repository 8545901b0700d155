// -- the view: which part of the world is seen, and how hands move it --------------------------------

const CLICK = 6; // px that a pointer may move during a click
const MOST_SCALE = 2000; // pixels a metre

class View {
  constructor(canvas) {
    this.canvas = canvas;
    this.dense = 1; // pixels of the display in a CSS pixel
    this.drawing = this.clicked = this.moved = () => {};
    this.pointers = new Map();
    this.asked = false;
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.listen();
  }

  get width() { return this.canvas.width; }
  get height() { return this.canvas.height; }

  pixel(x, y) {
    return [this.width / 2 + (x - this.x) * this.scale, this.height / 2 - (y - this.y) * this.scale];
  }

  world(px, py) {
    return [this.x + (px - this.width / 2) / this.scale, this.y - (py - this.height / 2) / this.scale];
  }

  resize() {
    const before = this.width / this.dense;
    this.dense = window.devicePixelRatio || 1;
    const { width, height } = this.canvas.getBoundingClientRect();
    this.canvas.width = Math.max(Math.round(width * this.dense), 1);
    this.canvas.height = Math.max(Math.round(height * this.dense), 1);
    if (this.scale === undefined) this.fit();
    else this.scale *= width / (before || width);
    this.draw();
  }

  fit() {
    const [left, right, bottom, top] = DATA.view;
    [this.x, this.y] = [(left + right) / 2, (bottom + top) / 2];
    this.scale = Math.min(this.width / (right - left), this.height / (top - bottom));
    this.least = this.scale / 4;
    this.draw();
  }

  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const [x, y] = this.world(px, py);
    this.scale = Math.min(Math.max(this.scale * factor, this.least), MOST_SCALE);
    const [nx, ny] = this.world(px, py);
    this.centre(this.x + x - nx, this.y + y - ny);
  }

  centre(x, y) {
    [this.x, this.y] = [x, y];
    this.draw();
  }

  pan(dx, dy) { this.centre(this.x - dx / this.scale, this.y + dy / this.scale); }

  draw() { // once a frame
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      this.drawing();
    });
  }

  listen() {
    const canvas = this.canvas;
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), ...this.at(event));
    }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (event) => this.up(event));
    }
    canvas.addEventListener("pointerleave", () => this.moved(null));
    canvas.addEventListener("keydown", (event) => this.key(event));
    for (const name of ["focus", "blur"]) canvas.addEventListener(name, () => this.draw());
  }

  at(event) {
    const box = this.canvas.getBoundingClientRect();
    return [(event.clientX - box.left) * this.dense, (event.clientY - box.top) * this.dense];
  }

  down(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, this.at(event));
    this.start = this.pointers.size === 1 ? this.at(event) : null;
  }

  move(event) {
    const now = this.at(event), before = this.pointers.get(event.pointerId);
    if (before) this.drag(event, now, before);
    this.moved(this.world(...now));
  }

  drag(event, now, before) {
    const other = [...this.pointers].find(([id]) => id !== event.pointerId);
    if (other) { // two fingers
      const apart = (at) => Math.hypot(at[0] - other[1][0], at[1] - other[1][1]);
      this.zoom(apart(now) / Math.max(apart(before), 1), ...other[1]);
    } else if (!this.start || Math.hypot(now[0] - this.start[0], now[1] - this.start[1]) > CLICK * this.dense) {
      this.start = null;
      this.pan(now[0] - before[0], now[1] - before[1]);
    } else return;
    this.pointers.set(event.pointerId, now);
  }

  up(event) {
    this.pointers.delete(event.pointerId);
    if (this.start && event.type === "pointerup") this.clicked(this.world(...this.start));
    this.start = null;
  }

  key(event) {
    const step = 0.1 * Math.min(this.width, this.height);
    const acts = {
      ArrowLeft: () => this.pan(step, 0), ArrowRight: () => this.pan(-step, 0),
      ArrowUp: () => this.pan(0, step), ArrowDown: () => this.pan(0, -step),
      "+": () => this.zoom(1.25), "=": () => this.zoom(1.25), "-": () => this.zoom(0.8),
      0: () => this.fit(), Enter: () => this.clicked([this.x, this.y]),
    };
    if (!acts[event.key] || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    acts[event.key]();
  }

  // -- lines, in CSS pixels ------------------------------------------------------------------------

  line(pen, points, colour, width, closed = false) {
    pen.strokeStyle = colour;
    pen.lineWidth = width * this.dense;
    pen.lineJoin = pen.lineCap = "round";
    pen.beginPath();
    points.forEach(([x, y]) => pen.lineTo(...this.pixel(x, y)));
    if (closed) pen.closePath();
    pen.stroke();
  }

  dot(pen, [x, y], colour, radius) {
    pen.fillStyle = colour;
    pen.beginPath();
    pen.arc(...this.pixel(x, y), radius * this.dense, 0, 2 * Math.PI);
    pen.fill();
  }

  write(pen, words, [x, y], colour, dx = 0, dy = 0) { // with a white border, readable on any map
    const [px, py] = this.pixel(x, y);
    pen.font = `600 ${13 * this.dense}px system-ui, sans-serif`;
    pen.lineWidth = 4 * this.dense;
    pen.strokeStyle = "#fff";
    pen.fillStyle = colour;
    pen.strokeText(words, px + dx * this.dense, py + dy * this.dense);
    pen.fillText(words, px + dx * this.dense, py + dy * this.dense);
  }
}
