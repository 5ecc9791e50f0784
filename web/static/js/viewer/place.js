// The position of the image in the window: pure functions of the zoom (window pixels per image pixel; null:
// fitted) and of the image point at the centre of the window.

export const kMostZoom = 128;
// A quarter of the largest size of a request, so that the first block of a large image on the coordinator's
// disk arrives sooner.
const kBlockSide = 256;
const kBlockPixels = 512; // side of the image area that a block represents, in levels above the first

export const fitZoom = (size, frame) => Math.min(frame.width / size[0], frame.height / size[1]);
export const zoomOf = (view, size, frame) => view.zoom ?? Math.min(fitZoom(size, frame), kMostZoom);

/** The view with its middle inside of the image, and not smaller than half of what fits. */
export function bounded(view, size, frame) {
  if (view.zoom === null) return { zoom: null, x: size[0] / 2, y: size[1] / 2 };
  const zoom = Math.min(kMostZoom, Math.max(view.zoom, Math.min(1, fitZoom(size, frame) / 2)));
  const inside = (v, most) => Math.min(most, Math.max(0, v));
  return { zoom, x: inside(view.x, size[0]), y: inside(view.y, size[1]) };
}

/** The point of the image under a point of the window. */
export function imagePoint(view, size, frame, point) {
  const zoom = zoomOf(view, size, frame);
  return [view.x + (point[0] - frame.width / 2) / zoom, view.y + (point[1] - frame.height / 2) / zoom];
}

export function windowPoint(view, size, frame, point) {
  const zoom = zoomOf(view, size, frame);
  return [(point[0] - view.x) * zoom + frame.width / 2, (point[1] - view.y) * zoom + frame.height / 2];
}

/** Zooms by a factor so that the image point under `point` stays there. */
export function zoomed(view, size, frame, factor, point = [frame.width / 2, frame.height / 2]) {
  const before = imagePoint(view, size, frame, point);
  const to = bounded({ ...view, zoom: zoomOf(view, size, frame) * factor }, size, frame);
  return bounded({ zoom: to.zoom, x: before[0] - (point[0] - frame.width / 2) / to.zoom, y: before[1] - (point[1] - frame.height / 2) / to.zoom }, size, frame);
}

/** Moves by window pixels. */
export function moved(view, size, frame, dx, dy) {
  const zoom = zoomOf(view, size, frame);
  return bounded({ zoom, x: view.x + dx / zoom, y: view.y + dy / zoom }, size, frame);
}

/** The mip level that has at least one pixel for each pixel of the screen. */
export const levelOf = (zoom, ratio, most) => Math.min(most, Math.max(0, Math.floor(Math.log2(1 / (zoom * ratio)) + 1e-9)));

export const blockSide = (level) => Math.min(kBlockSide, kBlockPixels >> level);
export const levelSize = (size, level) => size.map((side) => Math.ceil(side / 2 ** level));

/** [bx, by] of the blocks of a level that can be seen, from the middle outwards. */
export function seenBlocks(view, size, frame, level) {
  const side = blockSide(level) * 2 ** level;
  const [x0, y0] = imagePoint(view, size, frame, [0, 0]).map((v) => Math.max(0, Math.floor(v / side)));
  const corner = imagePoint(view, size, frame, [frame.width, frame.height]);
  const [x1, y1] = corner.map((v, i) => Math.floor(Math.min(v, size[i] - 1e-6) / side));
  const blocks = [];
  for (let by = y0; by <= y1; by += 1) for (let bx = x0; bx <= x1; bx += 1) blocks.push([bx, by]);
  const far = ([bx, by]) => ((bx + 0.5) * side - view.x) ** 2 + ((by + 0.5) * side - view.y) ** 2;
  return blocks.sort((a, b) => far(a) - far(b));
}

/** The rectangle of a block in pixels of its level. */
export function blockRect(size, level, bx, by) {
  const side = blockSide(level);
  const [width, height] = levelSize(size, level);
  return [bx * side, by * side, Math.min((bx + 1) * side, width), Math.min((by + 1) * side, height)];
}
