// Writes the numbers of pixels into them where they are shown large enough.
import { blockSide, imagePoint } from "./place.js";
import { halfValues } from "./half.js";
import { kindOf } from "./paint.js";

export const kValuesFrom = 56; // window pixels per image pixel
const kLine = 13;

const short = (v) => (Number.isNaN(v) ? "–" : Math.abs(v) >= 1000 || (v !== 0 && Math.abs(v) < 1e-3) ? v.toExponential(1) : v.toPrecision(3));

/** corner: a point of the image -> of the canvas. */
export function drawValues(context, ratio, source, name, view, frame, corner) {
  const layer = source.layer(name);
  if (kindOf(layer) === "matte") return;
  const values = halfValues();
  const channels = layer.channels.length;
  const side = blockSide(0);
  const [x0, y0] = imagePoint(view, source.size, frame, [0, 0]).map((v) => Math.max(0, Math.floor(v)));
  const [x1, y1] = imagePoint(view, source.size, frame, [frame.width, frame.height]).map((v, i) => Math.min(source.size[i], Math.ceil(v)));
  context.font = `${11 * ratio}px ui-monospace, monospace`;
  context.textAlign = "center";
  context.lineWidth = 3 * ratio;
  context.strokeStyle = "rgb(0 0 0 / 75%)";
  context.fillStyle = "#fff";
  for (let y = y0; y < y1; y += 1) for (let x = x0; x < x1; x += 1) {
    const block = source.block(layer.name, 0, Math.floor(x / side), Math.floor(y / side));
    if (!block) continue;
    const halves = new Uint16Array(block.buffer);
    const from = ((y - block.rect[1]) * (block.rect[2] - block.rect[0]) + x - block.rect[0]) * channels;
    const [cx, cy] = corner([x + 0.5, y + 0.5]);
    for (let c = 0; c < channels; c += 1) {
      const at = cy + ((c - (channels - 1) / 2) * kLine + 4) * ratio;
      const text = short(values[halves[from + c]]);
      context.strokeText(text, cx, at);
      context.fillText(text, cx, at);
    }
  }
}
