// -- the drive: path, robot and echoes at a time, stretches of being lost ----------------------------

const ROBOT = 0.22; // m
const PERIOD = 60; // ms from a moment to the next
const PATH = "#d55e00", LOST = "#9900ff", ECHO = "#009e73";

class Drive {
  constructor(view) {
    this.view = view;
    this.slider = byId("moment");
    this.slider.max = DRIVE.moments.length - 1;
    this.starts = [0]; // of the echoes of each moment
    for (const count of DRIVE.counts) this.starts.push(this.starts.at(-1) + count);
    this.stretches = lostStretches();
    this.slider.addEventListener("input", () => { this.stop(); this.shown(); });
    byId("play").addEventListener("click", () => (this.timer ? this.stop() : this.play()));
    byId("stretches").append(...this.stretches.slice(0, 20).map(([begin, end]) => this.stretch(begin, end)));
    new ResizeObserver(() => this.mark()).observe(byId("lost"));
    this.shown();
  }

  get pose() { return DRIVE.moments[this.slider.value]; } // the number of it

  stretch(begin, end) {
    const words = `lost ${span(DRIVE.times[begin])} to ${span(DRIVE.times[end])}`;
    const item = made("li");
    item.append(button(words, () => this.go(DRIVE.times[begin])));
    return item;
  }

  play() {
    if (this.slider.value === this.slider.max) this.slider.value = 0;
    byId("play").textContent = "Pause";
    this.timer = setInterval(() => {
      this.slider.value = Number(this.slider.value) + 1;
      this.follow();
      this.shown();
      if (this.slider.value === this.slider.max) this.stop();
    }, PERIOD);
  }

  follow() { // move the map where the robot leaves it
    const place = PLACES[this.pose], { view } = this;
    const [px, py] = view.pixel(...place);
    if (px < 0 || py < 0 || px > view.width || py > view.height) view.centre(...place);
  }

  stop() {
    clearInterval(this.timer);
    this.timer = null;
    byId("play").textContent = "Play";
  }

  go(time) { // to the moment at a time, s
    this.stop();
    let moment = 0;
    while (moment + 1 < DRIVE.moments.length && DRIVE.times[DRIVE.moments[moment + 1]] <= time) moment += 1;
    this.slider.value = moment;
    this.shown();
  }

  shown() {
    const time = DRIVE.times[this.pose], lost = DRIVE.lost[this.pose];
    const judged = DRIVE.lost.some((percent) => percent > 0);
    const words = `${span(time)} of ${span(DRIVE.times.at(-1))}`;
    byId("time").textContent = judged ? `${words}, lost: ${lost} %` : words;
    this.slider.setAttribute("aria-valuetext", byId("time").textContent);
    this.view.draw();
  }

  mark() { // the stretches below the slider
    const canvas = byId("lost"), pen = canvas.getContext("2d"), end = DRIVE.lost.length;
    canvas.width = canvas.clientWidth * (window.devicePixelRatio || 1);
    pen.fillStyle = LOST;
    for (const [first, last] of this.stretches) {
      const x = (first / end) * canvas.width;
      pen.fillRect(x, 0, Math.max(((last + 1) / end) * canvas.width - x, 3), canvas.height);
    }
  }

  draw(pen) {
    const { view, pose } = this, moment = Number(this.slider.value);
    if (byId("show-path").checked) {
      view.line(pen, PLACES, "#d55e0070", 1.2);
      view.line(pen, PLACES.slice(0, pose + 1), PATH, 1.8);
      for (const [begin, end] of this.stretches) view.line(pen, PLACES.slice(begin, end + 1), LOST, 4);
    }
    const [x, y, theta] = DRIVE.poses.subarray(3 * pose, 3 * pose + 3);
    const [c, s] = [Math.cos(theta), Math.sin(theta)];
    pen.fillStyle = ECHO;
    for (let k = this.starts[moment]; k < this.starts[moment + 1]; k++) {
      const [u, v] = [DRIVE.echoes[2 * k] / 100, DRIVE.echoes[2 * k + 1] / 100];
      const [px, py] = view.pixel(x + c * u - s * v, y + s * u + c * v), side = 4 * view.dense;
      pen.fillRect(px - side / 2, py - side / 2, side, side);
    }
    const radius = Math.max((ROBOT * view.scale) / view.dense, 6), colour = DRIVE.lost[pose] > ALARM ? LOST : PATH;
    view.dot(pen, [x, y], "#fff", radius + 1.5);
    view.dot(pen, [x, y], colour, radius);
    const ahead = (radius * view.dense) / view.scale;
    view.line(pen, [[x, y], [x + c * ahead, y + s * ahead]], "#fff", 2);
  }
}

const PLACES = Array.from(DRIVE.times, (_, k) => [DRIVE.poses[3 * k], DRIVE.poses[3 * k + 1]]);

function lostStretches() { // first and last number of each
  const result = [];
  DRIVE.lost.forEach((percent, k) => {
    if (percent <= ALARM) return;
    if (result.length && result.at(-1)[1] === k - 1) result.at(-1)[1] = k;
    else result.push([k, k]);
  });
  return result;
}
