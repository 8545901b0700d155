// -- files that this page saved, read again: zones out of keepout.yaml, judgements out of doors.geojson

const ZONES = "# zones: "; // a comment of keepout.yaml: the polygons, which the picture does not hold
const SAME = 0.4; // m between the middles of a door of a file and the same door of this map

async function readBack(files, edits) {
  const told = [];
  for (const file of files) {
    try {
      const text = await file.text();
      told.push(text.trimStart().startsWith("{") ? readDoors(JSON.parse(text), edits) : readZones(text, edits));
    } catch (error) {
      told.push(`${file.name}: not a file that this page saves (${error.message})`);
    }
  }
  edits.changed();
  tell(told.join("; "));
}

function readZones(text, edits) {
  const line = text.split("\n").find((one) => one.startsWith(ZONES));
  if (!line) throw new Error("no zones drawn in this page");
  const zones = JSON.parse(line.slice(ZONES.length));
  if (!Array.isArray(zones) || !zones.every((zone) => zone.length >= 3 && zone.every(isPlace))) {
    throw new Error("zones that are no polygons");
  }
  edits.zones = zones;
  return `${zones.length} zones read`;
}

function readDoors(stored, edits) {
  if (!Array.isArray(stored.features) || !Array.isArray(stored.not_doors)) throw new Error("no doors in it that this page saved");
  const judged = stored.features.filter(({ properties }) => properties.by_hand);
  const rejected = stored.not_doors, verdicts = {}, added = [];
  for (const feature of [...judged, ...rejected]) {
    const ends = endsOf(feature).map((end) => end.map((side) => Number(side.toFixed(3))));
    if (!ends.every(isPlace)) throw new Error("a door that is nowhere");
    const here = foundAt(middle(ends)), is = judged.includes(feature);
    if (here) verdicts[here.id] = is ? "confirmed" : "rejected";
    else if (is) added.push(ends);
  }
  Object.assign(edits, { verdicts, added });
  const none = Object.values(verdicts).filter((one) => one === "rejected").length;
  return `doors read: ${Object.keys(verdicts).length - none} confirmed, ${none} not doors, ${added.length} added`;
}

function foundAt([x, y]) { // the door of this map nearest to a place: its numbers may be others
  const near = DATA.doors.features.map((feature) => {
    const [u, v] = middle(endsOf(feature));
    return [Math.hypot(u - x, v - y), feature];
  }).sort(([a], [b]) => a - b)[0];
  return near && near[0] < SAME ? near[1] : null;
}

function isPlace(place) { return Array.isArray(place) && place.length === 2 && place.every(Number.isFinite); }
