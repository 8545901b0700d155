// -- keep-out zones: polygons that a person draws ---------------------------------------------------

const ZONE = "#c1143c";

class Zones {
  constructor(view, edits) {
    Object.assign(this, { view, edits, draft: [] });
    edits.listeners.push(() => this.list());
    this.list();
  }

  list() {
    byId("zones").replaceChildren(...this.edits.zones.map((zone, k) => {
      const item = made("li");
      item.append(
        made("span", `${k + 1}: ${zone.length} corners, ${area(zone).toFixed(1)} m², at ${point(zone[0])}`),
        button("Remove", () => this.remove(k), { "aria-label": `Remove zone ${k + 1}` }),
      );
      return item;
    }));
    if (!this.edits.zones.length) byId("zones").append(made("li", "none drawn"));
    this.view.draw();
  }

  corner(place) {
    this.draft.push(place);
    byId("drafting").hidden = false;
    tell(`Corner ${this.draft.length} at ${point(place)}`);
    this.view.draw();
  }

  close() {
    if (this.draft.length < 3) return tell("A zone has three corners at least");
    this.edits.zones.push(this.draft.map((one) => one.map((side) => Number(side.toFixed(3)))));
    this.cancel();
    this.edits.changed();
    tell(`Zone ${this.edits.zones.length} of ${area(this.edits.zones.at(-1)).toFixed(1)} m² drawn`);
  }

  cancel() {
    this.draft = [];
    byId("drafting").hidden = true;
    this.view.draw();
  }

  remove(k) {
    this.edits.zones.splice(k, 1);
    this.edits.changed();
    tell(`Zone ${k + 1} removed`);
  }

  draw(pen) {
    if (byId("show-zones").checked) {
      for (const zone of this.edits.zones) {
        pen.fillStyle = "#c1143c40";
        pen.beginPath();
        zone.forEach(([x, y]) => pen.lineTo(...this.view.pixel(x, y)));
        pen.fill("evenodd");
        this.view.line(pen, zone, ZONE, 2, true);
      }
    }
    if (this.draft.length) this.view.line(pen, this.draft, ZONE, 2);
    for (const place of this.draft) this.view.dot(pen, place, ZONE, 4);
  }
}

function area(corners) {
  const twice = corners.reduce((sum, [x, y], k) => {
    const [u, v] = corners[(k + 1) % corners.length];
    return sum + x * v - y * u;
  }, 0);
  return Math.abs(twice) / 2;
}
