"use strict";

// -- tables: sorted by a click on a heading, filtered by words ------------------------------------

function sortable(table) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    head.querySelector("button").addEventListener("click", () => {
      const down = head.getAttribute("aria-sort") === "ascending";
      heads.forEach((other) => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const rows = [...table.tBodies[0].rows];
      rows.sort((a, b) => compared(a.cells[column], b.cells[column], down ? -1 : 1));
      table.tBodies[0].append(...rows);
    });
  });
}

function compared(a, b, sign) {
  const [x, y] = [a.dataset.value, b.dataset.value];
  if (x === undefined || y === undefined) return (x === undefined) - (y === undefined);
  const [p, q] = [Number(x), Number(y)];
  return sign * (Number.isNaN(p) || Number.isNaN(q) ? x.localeCompare(y) : p - q);
}

function filtered(input) {
  const table = document.getElementById(input.dataset.table);
  const told = input.closest("p").querySelector("output");
  input.addEventListener("input", () => {
    const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
    const rows = [...table.tBodies[0].rows];
    rows.forEach((row) => {
      const text = row.textContent.toLowerCase();
      row.hidden = !words.every((word) => text.includes(word));
    });
    const shown = rows.filter((row) => !row.hidden).length;
    told.textContent = words.length ? `${shown} of ${rows.length} rows` : "";
  });
}

// -- the replay -----------------------------------------------------------------------------------

const ROBOT = 0.22, MARGIN = 0.4, MOST_PIXELS = 1400;

function player(replays) {
  const [section, episode, play, moment, scan, stage] =
    ["player", "episode", "play", "moment", "scan", "stage"].map((id) => document.getElementById(id));
  if (!replays.length) {
    document.getElementById("to-replay").remove();
    return;
  }
  section.hidden = false;
  replays.forEach((replay, k) => episode.add(new Option(replay.title, k)));
  let panels = [], timer = null;

  function draw() {
    const replay = replays[episode.value], k = Number(moment.value);
    scan.textContent = `${replay.scans[k]} of ${replay.scans.at(-1)}`;
    moment.setAttribute("aria-valuetext", `scan ${replay.scans[k]}`);
    panels.forEach((panel) => panel(k));
  }

  function stop() {
    clearInterval(timer);
    timer = null;
    play.textContent = "Play";
  }

  function load() {
    stop();
    const replay = replays[episode.value];
    moment.max = replay.scans.length - 1;
    moment.value = 0;
    stage.replaceChildren();
    panels = replay.variants.map((variant) => panelOf(replay, variant, stage));
    draw();
  }

  play.addEventListener("click", () => {
    if (timer) return stop();
    if (moment.value === moment.max) moment.value = 0;
    play.textContent = "Pause";
    timer = setInterval(() => {
      moment.value = Number(moment.value) + 1;
      draw();
      if (moment.value === moment.max) stop();
    }, 150);
  });
  episode.addEventListener("change", load);
  moment.addEventListener("input", () => { stop(); draw(); });
  load();
}

function panelOf(replay, variant, stage) {
  const figure = document.createElement("figure"), caption = document.createElement("figcaption");
  const canvas = document.createElement("canvas"), pen = canvas.getContext("2d");
  caption.textContent = variant.name;
  canvas.setAttribute("role", "img");
  figure.append(caption, canvas);
  stage.append(figure);
  const [left, right, bottom, top] = boxOf(replay, variant);
  const scale = Math.min(1000 / (right - left), MOST_PIXELS / (top - bottom));
  canvas.width = Math.round((right - left) * scale);
  canvas.height = Math.round((top - bottom) * scale);
  const images = variant.images.map(() => null);
  const x = (m) => (m - left) * scale, y = (m) => (top - m) * scale;
  let wanted = 0;

  function segments(list, colour, width) {
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.beginPath();
    for (const [a, b, c, d] of list) {
      pen.moveTo(x(a), y(b));
      pen.lineTo(x(c), y(d));
    }
    pen.stroke();
  }

  function robot([a, b, heading], colour, full) {
    pen.strokeStyle = pen.fillStyle = colour;
    pen.lineWidth = 3;
    pen.beginPath();
    pen.arc(x(a), y(b), ROBOT * scale, 0, 2 * Math.PI);
    if (full) pen.fill(); else pen.stroke();
    pen.strokeStyle = full ? "#fff" : colour;
    pen.beginPath();
    pen.moveTo(x(a), y(b));
    pen.lineTo(x(a + ROBOT * Math.cos(heading)), y(b + ROBOT * Math.sin(heading)));
    pen.stroke();
  }

  function paint(k, image) {
    const number = replay.scans[k], pose = variant.poses[number];
    pen.fillStyle = "#c8d1de";
    pen.fillRect(0, 0, canvas.width, canvas.height);
    const [l, r, b, t] = variant.extent;
    pen.imageSmoothingEnabled = false;
    pen.drawImage(image, x(l), y(t), (r - l) * scale, (t - b) * scale);
    segments(replay.walls, "#56b4e9", 2);
    segments(replay.doors[k], "#e69f00", 3);
    pen.strokeStyle = "#d55e00";
    pen.lineWidth = 2;
    pen.beginPath();
    variant.poses.slice(0, number + 1).forEach(([a, c]) => pen.lineTo(x(a), y(c)));
    pen.stroke();
    const [c, s] = [Math.cos(pose[2]), Math.sin(pose[2])];
    pen.fillStyle = "#cc79a7";
    for (const echo of replay.echoes[k]) {
      if (!echo) continue;
      const [u, v] = [pose[0] + c * echo[0] - s * echo[1], pose[1] + s * echo[0] + c * echo[1]];
      pen.fillRect(x(u) - 2, y(v) - 2, 4, 4);
    }
    robot(pose, "#d55e00", true);
    let told = `${variant.name} at scan ${number}`;
    if (replay.truth.length) {
      robot(replay.truth[number], "#0072b2", false);
      const away = Math.hypot(pose[0] - replay.truth[number][0], pose[1] - replay.truth[number][1]);
      told += `, ${(1000 * away).toFixed(0)} mm off`;
      caption.textContent = `${variant.name}: ${(1000 * away).toFixed(0)} mm off`;
    }
    canvas.setAttribute("aria-label", told);
  }

  return (k) => {
    wanted = k;
    if (images[k]) return paint(k, images[k]);
    const image = new Image();
    image.onload = () => {
      images[k] = image;
      if (wanted === k) paint(k, image);
    };
    image.src = variant.images[k];
  };
}

function boxOf(replay, variant) {
  if (!replay.walls.length) return variant.extent;
  const xs = replay.walls.flatMap(([a, , c]) => [a, c]), ys = replay.walls.flatMap(([, b, , d]) => [b, d]);
  const least = (list) => list.reduce((a, b) => Math.min(a, b)) - MARGIN;
  const most = (list) => list.reduce((a, b) => Math.max(a, b)) + MARGIN;
  return [least(xs), most(xs), least(ys), most(ys)];
}

document.querySelectorAll("table.sortable").forEach(sortable);
document.querySelectorAll("input[data-table]").forEach(filtered);
player(JSON.parse(document.getElementById("replays").textContent));
