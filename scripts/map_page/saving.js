// -- files: a mask for Nav2's keep-out filter, and the doors as corrected ----------------------------

const FREE = 254, FORBIDDEN = 0; // bytes of a PGM, as in map.pgm
const CLOSED = numbers(DATA.closed, Uint32Array); // stretches of cells that dynslam closed: first, one after the last

function download(name, content, kind) {
  const link = made("a", "", { href: URL.createObjectURL(new Blob([content], { type: kind })), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

function mask(zones) { // one byte a cell of map.pgm, its first row the highest
  const { rows, cols } = DATA.grid, cells = new Uint8Array(rows * cols).fill(FREE);
  for (let k = 0; k < CLOSED.length; k += 2) cells.fill(FORBIDDEN, CLOSED[k], CLOSED[k + 1]);
  for (const zone of zones) fill(cells, zone);
  return cells;
}

function fill(cells, zone) { // the cells whose middle lies within, by the even-odd rule
  const { resolution, left, bottom, rows, cols } = DATA.grid;
  for (let row = 0; row < rows; row++) {
    const y = bottom + (row + 0.5) * resolution, at = (rows - 1 - row) * cols;
    const crossings = zone.flatMap(([ax, ay], k) => {
      const [bx, by] = zone[(k + 1) % zone.length];
      return ay > y !== by > y ? [ax + ((y - ay) / (by - ay)) * (bx - ax)] : [];
    }).sort((a, b) => a - b);
    for (let k = 0; k + 1 < crossings.length; k += 2) {
      const [from, to] = [crossings[k], crossings[k + 1]].map((x) => Math.ceil((x - left) / resolution - 0.5));
      if (to > 0 && from < cols) cells.fill(FORBIDDEN, at + Math.max(from, 0), at + Math.min(to, cols));
    }
  }
}

function saveZones(zones) {
  const { resolution, left, bottom, rows, cols } = DATA.grid;
  const decimal = (value) => (Number.isInteger(value) ? value.toFixed(1) : String(value));
  const yaml = [
    "image: keepout.pgm", "mode: trinary", `resolution: ${decimal(resolution)}`,
    `origin: [${decimal(left)}, ${decimal(bottom)}, 0.0]`, "negate: 0", "occupied_thresh: 0.65",
    "free_thresh: 0.196", ZONES + JSON.stringify(zones), "",
  ].join("\n");
  download("keepout.yaml", yaml, "text/yaml");
  download("keepout.pgm", new Blob([`P5\n${cols} ${rows}\n255\n`, mask(zones)]), "image/x-portable-graymap");
  tell(`keepout.yaml and keepout.pgm saved, with ${zones.length} zones${CLOSED.length ? " and the closed cells of dynslam map" : ""}`);
}

function corrected(edits) { // the GeoJSON of dynslam, with what a person knows
  const judged = DATA.doors.features.map((feature) => [feature, edits.verdicts[feature.id]]);
  const kept = judged.filter(([, verdict]) => verdict !== "rejected").map(([feature, verdict]) => (
    verdict ? withProperties(feature, {
      kind: "door", probability: 1, by_hand: "confirmed", found_probability: feature.properties.probability,
    }) : feature
  ));
  const first = 1 + Math.max(0, ...DATA.doors.features.map(({ id }) => id));
  const added = edits.added.map((ends, k) => addedFeature(first + k, ends));
  return {
    ...DATA.doors,
    features: [...kept, ...added].sort((a, b) => b.properties.probability - a.properties.probability),
    not_doors: judged.filter(([, verdict]) => verdict === "rejected").map(([feature]) => feature),
  };
}

function withProperties(feature, more) {
  return { ...feature, properties: { ...feature.properties, ...more } };
}

function addedFeature(id, [a, b]) {
  const width = Math.hypot(b[0] - a[0], b[1] - a[1]), depth = DATA.leaf_depth / 2;
  const [u, v] = [(-(b[1] - a[1]) / width) * depth, ((b[0] - a[0]) / width) * depth];
  const ring = [[a, -1], [b, -1], [b, 1], [a, 1], [a, -1]].map(
    ([[x, y], side]) => [x + side * u, y + side * v].map((value) => Number(value.toFixed(3))),
  );
  return {
    type: "Feature", id, geometry: { type: "Polygon", coordinates: [ring] },
    properties: { kind: "door", probability: 1, by_hand: "added", width_m: Number(width.toFixed(3)) },
  };
}

function saveDoors(edits) {
  const doors = corrected(edits);
  download("doors.geojson", `${JSON.stringify(doors, null, 1)}\n`, "application/geo+json");
  tell(`doors.geojson saved, with ${doors.features.length} doors`);
}
