// A stand-in for a render: shafts of light through a dusty room, computed from a formula. Tiles with few
// samples are noisy, so the storybook's image looks like one that is being rendered. Deterministic.

export function hash(x, y, k) {
  let n = Math.imul(x, 374761393) ^ Math.imul(y, 668265263) ^ Math.imul(k, 2147483629);
  n = Math.imul(n ^ (n >>> 13), 1274126177);
  return ((n ^ (n >>> 16)) >>> 0) / 2 ** 32;
}

const smooth = (a, b, x) => {
  const t = Math.min(1, Math.max(0, (x - a) / (b - a)));
  return t * t * (3 - 2 * t);
};

function shafts(u, v) {
  let light = 0;
  for (const [at, wide, power] of [[0.1, 0.05, 0.9], [0.235, 0.06, 1], [0.38, 0.055, 0.75], [0.51, 0.04, 0.4]]) {
    const across = u - at - 0.52 * v;
    const soft = wide * (0.35 + 0.5 * v);
    light += power * smooth(-wide - soft, -wide + soft, across) * smooth(wide + soft, wide - soft, across) * Math.exp(-1.1 * v);
  }
  return light;
}

export function radiance(u, v) {
  const floor = smooth(0.78, 0.8, v);
  const beam = shafts(u, v);
  const pool = floor * shafts(u, v) * 1.7;
  const haze = 0.012 + 0.05 * Math.exp(-3 * Math.hypot(u - 0.2, v * 0.6));
  const wall = (1 - floor) * (0.012 + 0.014 * v) + floor * (0.02 + 0.04 * (1 - v));
  const dust = 1 + 0.12 * Math.sin(17 * u + 5 * Math.sin(9 * v)) * Math.sin(13 * v + 3 * u);
  const warm = beam * 0.62 * dust + pool * 0.35;
  return [warm * 1.05 + haze + wall, warm * 0.78 + haze * 0.9 + wall * 0.95, warm * 0.46 + haze * 0.86 + wall];
}

/** A canvas of the frame; done: share of the frame, in tiles of 32, that has many samples. */
export function paint(width, height, done, exposure) {
  const canvas = document.createElement("canvas");
  canvas.width = width;
  canvas.height = height;
  const context = canvas.getContext("2d");
  const image = context.createImageData(width, height);
  const tilesAcross = Math.ceil(width / 32);
  const tiles = tilesAcross * Math.ceil(height / 32);
  for (let y = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1) {
      const tile = (y >> 5) * tilesAcross + (x >> 5);
      const share = done * tiles - tile;
      const noise = share >= 1 ? 0.05 : 0.75;
      const empty = done < 0.3 && share < -0.45 * tiles;
      radiance(x / width, y / height).forEach((value, channel) => {
        const noisy = Math.max(0, value * (1 + noise * (hash(x, y, channel) + hash(y, x, channel + 3) - 1)));
        image.data[4 * (y * width + x) + channel] = empty ? 0 : 255 * Math.min(1, (noisy * 2 ** exposure) ** (1 / 2.2));
      });
      image.data[4 * (y * width + x) + 3] = 255;
    }
  }
  context.putImageData(image, 0, 0);
  return canvas;
}

const kStops = [[13, 8, 70], [45, 60, 142], [33, 120, 140], [70, 180, 105], [250, 230, 50]];

function heat(part) {
  const at = Math.min(0.9999, Math.max(0, part)) * (kStops.length - 1);
  const [low, high] = [kStops[Math.floor(at)], kStops[Math.floor(at) + 1]];
  return low.map((value, i) => value + (at % 1) * (high[i] - value));
}

/** A stand-in for the maps of error and of samples over the frame. */
export function paintMap(width, height, done, kind) {
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  const context = canvas.getContext("2d");
  const tilesAcross = Math.ceil(width / 32);
  for (let y = 0; y < height; y += 2) {
    for (let x = 0; x < width; x += 2) {
      const [cx, cy] = kind === "samples" ? [(x >> 5) * 32 + 16, (y >> 5) * 32 + 16] : [x, y];
      const many = (cy >> 5) * tilesAcross + (cx >> 5) < done * tilesAcross * Math.ceil(height / 32);
      const light = shafts(cx / width, cy / height);
      const part = kind === "samples" ? 0.25 + 0.3 * light + (many ? 0.25 : 0) : 0.75 - 0.5 * light - (many ? 0.2 : 0) + 0.25 * (hash(x, y, 9) - 0.5);
      context.fillStyle = `rgb(${heat(part).map(Math.round).join(" ")})`;
      context.fillRect(x, y, 2, 2);
    }
  }
  return canvas;
}
