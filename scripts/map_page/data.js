// -- the data of the page, and small helpers --------------------------------------------------------

const DATA = JSON.parse(document.getElementById("data").textContent);
const byId = (id) => document.getElementById(id);

function numbers(text, Kind) { // of base64, little endian
  return new Kind(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
}

const DRIVE = {
  times: numbers(DATA.drive.times, Float32Array), // s from the first scan
  poses: numbers(DATA.drive.poses, Float32Array), // x, y in m, theta in rad
  lost: numbers(DATA.drive.lost, Uint8Array), // percent
  moments: numbers(DATA.drive.moments, Uint32Array), // numbers of the poses with echoes
  counts: numbers(DATA.drive.counts, Uint16Array),
  echoes: numbers(DATA.drive.echoes, Int16Array), // cm, in the robot's frame
};
const ALARM = 50; // percent, above which the robot is lost

function tell(words) { byId("told").textContent = words; }

function made(kind, words = "", attributes = {}) {
  const element = document.createElement(kind);
  element.textContent = words;
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}

function button(words, act, attributes = {}) {
  const element = made("button", words, { type: "button", ...attributes });
  element.addEventListener("click", act);
  return element;
}

const metres = (value) => `${value.toFixed(2)} m`;
const point = ([x, y]) => `(${x.toFixed(2)}, ${y.toFixed(2)})`;

function span(seconds) { // 61.5 -> 1:01.5
  const minutes = Math.floor(seconds / 60);
  return `${minutes}:${(seconds - 60 * minutes).toFixed(1).padStart(4, "0")}`;
}
