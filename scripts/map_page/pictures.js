// -- pictures of cells: in smaller and smaller sizes, in which thin walls stay -----------------------

class Picture {
  constructor(meta) {
    Object.assign(this, meta);
    this.levels = []; // canvases, each with half the rows and columns of the one before
  }

  load() { // once, when it is shown for the first time
    this.loading ??= this.decode();
    return this.loading;
  }

  async decode() {
    const image = new Image();
    image.src = this.png;
    await image.decode();
    const canvas = made("canvas");
    [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
    const pen = canvas.getContext("2d", { willReadFrequently: true });
    pen.drawImage(image, 0, 0);
    const pixels = new Uint32Array(pen.getImageData(0, 0, canvas.width, canvas.height).data.buffer);
    const index = this.indexed(pixels);
    this.levels = [this.painted(index, canvas.width, canvas.height)];
    let [cells, width, height] = [index, canvas.width, canvas.height];
    while (Math.max(width, height) > 256) {
      cells = halved(cells, width, height);
      [width, height] = [Math.ceil(width / 2), Math.ceil(height / 2)];
      this.levels.push(this.painted(cells, width, height));
    }
  }

  get codes() { // the colours as the bytes of a pixel: red first, little endian
    return this.colours.map(([r, g, b, a = 255]) => (a ? ((a << 24) | (b << 16) | (g << 8) | r) >>> 0 : 0));
  }

  indexed(pixels) {
    const known = new Map(this.codes.map((code, index) => [code, index]));
    const index = new Uint8Array(pixels.length);
    let [last, found] = [this.codes[0], 0];
    for (let k = 0; k < pixels.length; k++) {
      if (pixels[k] !== last) {
        last = pixels[k];
        found = known.get(last) ?? 0;
      }
      index[k] = found;
    }
    return index;
  }

  painted(index, width, height) {
    const codes = Uint32Array.from(this.codes), pixels = new Uint32Array(index.length);
    for (let k = 0; k < index.length; k++) pixels[k] = codes[index[k]];
    const canvas = made("canvas");
    [canvas.width, canvas.height] = [width, height];
    const image = new ImageData(new Uint8ClampedArray(pixels.buffer), width, height);
    canvas.getContext("2d").putImageData(image, 0, 0);
    return canvas;
  }

  draw(pen, view) { // of the first level whose cells are a pixel or more, the part that is seen
    let level = 0, cell = this.cell;
    while (level + 1 < this.levels.length && cell * view.scale < 1) {
      level += 1;
      cell *= 2;
    }
    const canvas = this.levels[level], [left, , , top] = this.extent;
    const [x0, y0] = view.world(0, 0), [x1, y1] = view.world(view.width, view.height);
    const col0 = Math.max(Math.floor((x0 - left) / cell), 0);
    const col1 = Math.min(Math.ceil((x1 - left) / cell), canvas.width);
    const row0 = Math.max(Math.floor((top - y0) / cell), 0);
    const row1 = Math.min(Math.ceil((top - y1) / cell), canvas.height);
    if (col1 <= col0 || row1 <= row0) return;
    const [x, y] = view.pixel(left + col0 * cell, top - row0 * cell);
    const size = cell * view.scale;
    pen.imageSmoothingEnabled = false;
    pen.drawImage(canvas, col0, row0, col1 - col0, row1 - row0,
      x, y, (col1 - col0) * size, (row1 - row0) * size);
  }
}

function halved(index, width, height) { // the highest of each 2 x 2
  const [cols, rows] = [Math.ceil(width / 2), Math.ceil(height / 2)];
  const small = new Uint8Array(cols * rows);
  for (let row = 0; row < height; row++) {
    const from = row * width, to = (row >> 1) * cols;
    for (let col = 0; col < width; col++) {
      const value = index[from + col], at = to + (col >> 1);
      if (value > small[at]) small[at] = value;
    }
  }
  return small;
}
