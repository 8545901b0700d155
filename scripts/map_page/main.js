// -- the page ---------------------------------------------------------------------------------------

const STEPS = [1, 2, 5]; // lengths of a scale bar, times powers of ten m
const BAR = 140; // px, longest

const view = new View(byId("stage")), edits = new Edits();
const drive = new Drive(view), doors = new Doors(view, edits, drive), zones = new Zones(view, edits);
const pictures = DATA.pictures.map((meta) => new Picture(meta));
const bases = pictures.filter(({ name }) => name !== "reasons");
const overlay = pictures.find(({ name }) => name === "reasons");
let base = bases[0];

function draw() {
  const pen = view.canvas.getContext("2d");
  pen.fillStyle = `rgb(${bases[0].colours[0]})`;
  pen.fillRect(0, 0, view.width, view.height);
  if (base.levels.length) base.draw(pen, view);
  if (overlay?.levels.length && byId("show-reasons").checked) overlay.draw(pen, view);
  zones.draw(pen);
  drive.draw(pen);
  doors.draw(pen);
  scaleBar(pen);
  if (view.canvas.matches(":focus-visible")) cross(pen);
}

function scaleBar(pen) { // and the directions of x and y
  const most = (BAR * view.dense) / view.scale, power = 10 ** Math.floor(Math.log10(most));
  const length = Math.max(...STEPS.map((step) => step * power).filter((one) => one <= most));
  const [x, y] = view.world(16 * view.dense, view.height - 16 * view.dense);
  const tip = (34 * view.dense) / view.scale;
  for (const [colour, width] of [["#fff", 7], ["#000", 3]]) {
    view.line(pen, [[x + length, y], [x, y], [x, y + tip]], colour, width);
  }
  view.write(pen, `${Number(length.toPrecision(1))} m`, [x + length / 2, y], "#000", -12, -6);
  view.write(pen, "x", [x + length, y], "#000", 6, 4);
  view.write(pen, "y", [x, y + tip], "#000", -4, -6);
}

function cross(pen) { // where Enter clicks
  const arm = (9 * view.dense) / view.scale;
  for (const [colour, width] of [["#fff", 4], ["#000", 1.5]]) {
    view.line(pen, [[view.x - arm, view.y], [view.x + arm, view.y]], colour, width);
    view.line(pen, [[view.x, view.y - arm], [view.x, view.y + arm]], colour, width);
  }
}

function legend() {
  const shown = [...base.legend, ...(overlay && byId("show-reasons").checked ? overlay.legend : [])];
  byId("legend").replaceChildren(...shown.map(([colour, words]) => {
    const item = made("li"), patch = made("i");
    patch.style.background = `rgb(${colour.slice(0, 3)})`;
    item.append(patch, words);
    return item;
  }));
}

async function show(picture) {
  await picture.load();
  if (picture !== overlay) base = picture;
  document.body.dataset.shown = picture.name;
  legend();
  view.draw();
}

function chooser(picture, k) {
  const label = made("label"), input = made("input", "", { type: "radio", name: "base", value: picture.name });
  input.checked = k === 0;
  input.addEventListener("change", () => show(picture));
  label.append(input, ` ${picture.label}`);
  return label;
}

const tool = () => document.querySelector("input[name=tool]:checked").value;

function clicked(place) {
  if (tool() === "zone") return zones.corner(place);
  if (tool() === "door") doors.end(place);
  else doors.choose(doors.at(place));
  view.draw();
}

function cancel() {
  zones.cancel();
  doors.draft = [];
  view.draw();
}

byId("bases").append(...bases.map(chooser));
if (overlay) {
  const label = made("label"), input = made("input", "", { type: "checkbox", id: "show-reasons" });
  input.addEventListener("change", () => show(overlay));
  label.append(input, ` ${overlay.label}`);
  byId("overlays").prepend(label);
}
for (const input of byId("overlays").querySelectorAll("input")) {
  input.addEventListener("change", () => { legend(); view.draw(); });
}
for (const input of document.querySelectorAll("input[name=tool]")) input.addEventListener("change", cancel);
byId("closer").addEventListener("click", () => view.zoom(1.5));
byId("further").addEventListener("click", () => view.zoom(1 / 1.5));
byId("all").addEventListener("click", () => view.fit());
byId("close-zone").addEventListener("click", () => zones.close());
byId("cancel").addEventListener("click", cancel);
byId("save-zones").addEventListener("click", () => saveZones(edits.zones));
byId("save-doors").addEventListener("click", () => saveDoors(edits));
byId("read").addEventListener("change", async ({ target }) => {
  await readBack([...target.files], edits);
  target.value = ""; // so that the same file can be read once more
});
document.addEventListener("keydown", (event) => { if (event.key === "Escape") cancel(); });
view.drawing = draw;
view.clicked = clicked;
view.moved = (place) => { byId("where").textContent = place ? point(place) : ""; };
view.resize();
show(base);
