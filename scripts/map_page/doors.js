// -- doors: found, judged, added --------------------------------------------------------------------

const NARROWEST = 0.3; // m, of a door that dynslam reads
const REACH = 14; // px from a door at which a click chooses it
const DOOR = { sure: "#0050d0", perhaps: "#2f6fca", rejected: "#77797f", hand: "#00713f" };

class Doors {
  constructor(view, edits, drive) {
    Object.assign(this, { view, edits, drive, chosen: null, draft: [] });
    edits.listeners.push(() => this.list());
    byId("confirm").addEventListener("click", () => this.judge("confirmed"));
    byId("reject").addEventListener("click", () => this.judge("rejected"));
    byId("undo").addEventListener("click", () => this.judge(null));
    this.list();
  }

  get all() { // found and added, as { key, name, ends, feature, verdict }
    const found = DATA.doors.features.map((feature, k) => ({
      key: `f${k}`, name: String(feature.id), ends: endsOf(feature), feature,
      history: DATA.histories[k], verdict: this.edits.verdicts[feature.id] ?? null,
    }));
    const added = this.edits.added.map((ends, k) => ({
      key: `a${k}`, name: `A${k + 1}`, ends, feature: null, history: [], verdict: "added", number: k,
    }));
    return [...found, ...added];
  }

  get door() { return this.all.find(({ key }) => key === this.chosen); }

  list() {
    byId("doors").replaceChildren(...this.all.map((door) => {
      const item = made("li"), chosen = door.key === this.chosen;
      const element = button(inWords(door), () => this.choose(door.key, true), { "aria-pressed": chosen });
      element.className = door.verdict ?? "";
      item.append(element);
      return item;
    }));
    if (!this.all.length) byId("doors").append(made("li", "none found"));
    this.describe();
    this.view.draw();
  }

  choose(key, moves = false) {
    this.chosen = key;
    this.list();
    byId("doors").querySelector("[aria-pressed=true]")?.focus({ preventScroll: !moves });
    if (moves && this.door) this.view.centre(...middle(this.door.ends));
    if (!this.door) return;
    document.querySelector("aside").scrollTop = byId("door").offsetTop - 60;
    tell(`Door ${inWords(this.door)}`);
  }

  at(place) { // the door at a click, if there is one
    const near = this.all.map((door) => [away(place, door.ends) * this.view.scale / this.view.dense, door.key]);
    const [best] = near.sort(([a], [b]) => a - b);
    return best && best[0] < REACH ? best[1] : null;
  }

  judge(verdict) {
    const { door } = this;
    if (door.number !== undefined) {
      if (verdict === "confirmed") return;
      this.edits.added.splice(door.number, 1);
      this.chosen = null;
    } else if (verdict) this.edits.verdicts[door.feature.id] = verdict;
    else delete this.edits.verdicts[door.feature.id];
    this.edits.changed();
    tell(`Door ${door.name}: ${verdict ?? "as found"}`);
  }

  end(place) { // of a door that is added
    this.draft.push(place);
    if (this.draft.length < 2) return tell(`One end of the door at ${point(place)}; set the other`);
    const ends = this.draft;
    this.draft = [];
    const width = Math.hypot(ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]);
    if (width < NARROWEST) return tell(`A door of ${metres(width)} is too narrow: ${metres(NARROWEST)} at least`);
    this.edits.added.push(ends.map((one) => one.map((side) => Number(side.toFixed(3)))));
    this.chosen = `a${this.edits.added.length - 1}`;
    this.edits.changed();
    tell(`Door ${this.door.name} of ${metres(width)} added`);
  }

  describe() {
    const { door } = this;
    byId("door").hidden = !door;
    if (!door) return;
    byId("door-name").textContent = `Door ${door.name}`;
    byId("confirm").hidden = !door.feature;
    byId("undo").hidden = !door.feature;
    byId("confirm").setAttribute("aria-pressed", door.verdict === "confirmed");
    byId("reject").setAttribute("aria-pressed", door.verdict === "rejected");
    byId("facts").replaceChildren(...facts(door).flatMap(([name, value]) => [made("dt", name), made("dd", value)]));
    byId("history").replaceChildren(...this.history(door));
  }

  history(door) {
    if (!door.history.length) return [];
    const bar = made("div", "", { id: "bar" }), end = DRIVE.times.at(-1) || 1;
    for (const [begin, last, open] of door.history) {
      const words = `seen ${open ? "open" : "closed"} ${span(begin)} to ${span(last)}`;
      const sight = button("", () => this.drive.go(begin), { "aria-label": words, title: words });
      sight.className = open ? "open" : "closed";
      sight.style.left = `${(98 * begin) / end}%`;
      sight.style.width = `${Math.max((98 * (last - begin)) / end, 0.8)}%`;
      bar.append(sight);
    }
    const legend = "blue: seen open, brown: seen closed, over the drive; a click goes to that time";
    return [bar, made("p", legend, { class: "small" })];
  }

  draw(pen) {
    if (byId("show-doors").checked) {
      for (const door of this.all) {
        const colour = colourOf(door), chosen = door.key === this.chosen;
        if (chosen) this.view.line(pen, door.ends, "#ffd400", 9);
        this.view.line(pen, door.ends, "#fff", chosen ? 5 : 6);
        this.view.line(pen, door.ends, colour, door.verdict === "rejected" ? 1 : 3.5);
        this.view.write(pen, door.name, middle(door.ends), colour, 6, -6);
      }
    }
    for (const place of this.draft) this.view.dot(pen, place, DOOR.hand, 5);
  }
}

function endsOf(feature) { // middles of the short sides of the rectangle a, b, c, d, a
  const [a, b, c, d] = feature.geometry.coordinates[0];
  return [middle([a, d]), middle([b, c])];
}

function middle([a, b]) { return [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2]; }

function away([x, y], [[ax, ay], [bx, by]]) { // of a point from a segment
  const [u, v] = [bx - ax, by - ay];
  const share = Math.min(Math.max(((x - ax) * u + (y - ay) * v) / (u * u + v * v || 1), 0), 1);
  return Math.hypot(x - ax - share * u, y - ay - share * v);
}

function colourOf({ verdict, feature }) {
  if (verdict === "rejected") return DOOR.rejected;
  if (verdict) return DOOR.hand;
  return feature.properties.probability >= DATA.sure ? DOOR.sure : DOOR.perhaps;
}

function percent(probability) { return `${Math.min(Math.round(100 * probability), 99)} %`; }

function inWords({ name, ends, feature, verdict }) {
  if (!feature) return `${name}: added, at ${point(middle(ends))}`;
  const told = { confirmed: "confirmed", rejected: "not a door" }[verdict];
  return `${name}: ${told ?? percent(feature.properties.probability)}, at ${point(middle(ends))}`;
}

function facts({ ends, feature }) {
  const width = Math.hypot(ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]);
  if (!feature) return [["width", metres(width)], ["found", "no: added by hand"]];
  const told = feature.properties;
  const sides = { left: "left of its first edge", right: "right of its first edge" };
  return [
    ["probability", `${percent(told.probability)}: ${told.kind}`],
    ["width", metres(told.width_m)],
    ["hinge", told.hinge ? `at ${point(told.hinge)}, opens to the ${sides[told.opens_to] ?? "?"}` : "not seen, or it slides"],
    ["open", `${Math.round(100 * told.open_share)} % of the ${told.watched_s.toFixed(0)} s it was watched`],
    ["changes seen", `${told.flips}, ${told.flips_per_hour} an hour`],
    ["scans", `${told.seen_open_scans} saw it open, ${told.seen_closed_scans} closed`],
    ["seen", `${span(told.first_seen_s)} to ${span(told.last_seen_s)}`],
  ];
}
