// <float-view>: draws one or two pictures of half floats, and reports the user's actions as events: `viewed`
// (zoom and pan), `pointed` (the pixel under the pointer), `picked`, `framed` (a region), `split` (position
// of the wipe), `flipped` (the mean of a FLIP map), `command` (a key). Its property `model` determines what
// it draws: {a, b, layer, look, view, by, split, overlay, region, focus, tool, changed}.
import { overChecks, paint, paintCompared } from "./paint.js";
import { blockRect, bounded, imagePoint, levelOf, moved, seenBlocks, windowPoint, zoomed, zoomOf } from "./place.js";
import { flipCanvas } from "./flip_canvas.js";
import { drawValues, kValuesFrom } from "./values.js";

const kCoarser = 4; // up to this many levels coarser than wanted are drawn until the wanted level arrives
const kOverChecks = ["rgb", "denoised", "mix"]; // layers that are shown over a checkerboard if the image has alpha
const kMostPainted = 384; // most painted blocks that are kept
const kOverlayOpacity = 0.6;
const kWheelStep = 1.0015; // zoom factor per unit of a wheel's movement
const kKeyStep = 1 / 8; // a key moves by this share of the window
const kClickSlop = 4; // pixels that the pointer may move during a click
const kGrabSplit = 12; // distance in pixels at which the pointer grabs the wipe
const kPan = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const kZoomKeys = { "+": 2, "=": 2, "-": 0.5, _: 0.5 };

class FloatView extends HTMLElement {
  #canvas = document.createElement("canvas");
  #model = null;
  #ahead = null; // the view that was reported last, until the page draws it: keys may be faster than frames
  #painted = new Map(); // key -> {canvas, look, used}
  #frame = 0; // number of the latest drawing
  #drawing = 0;
  #pointers = new Map(); // id -> [x, y] of the pressed pointers
  #drag = null; // {kind, from, view, moved} of the present drag
  #flip = flipCanvas((mean) => {
    this.#tell("flipped", mean);
    this.#schedule();
  });
  #watcher = new ResizeObserver(() => this.#schedule());

  connectedCallback() {
    this.append(this.#canvas);
    // keys work from the first moment, unless somebody is typing elsewhere already
    if (!document.activeElement || document.activeElement === document.body) this.focus({ preventScroll: true });
    this.#watcher.observe(this);
    this.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    this.addEventListener("pointerdown", (event) => this.#down(event));
    this.addEventListener("pointermove", (event) => this.#move(event));
    for (const name of ["pointerup", "pointercancel"]) this.addEventListener(name, (event) => this.#up(event));
    this.addEventListener("pointerleave", () => this.#tell("pointed", null));
    this.addEventListener("dblclick", () => this.#viewed({ zoom: null }));
    this.addEventListener("keydown", (event) => this.#key(event));
  }

  disconnectedCallback() {
    this.#watcher.disconnect();
    this.#flip.end();
    cancelAnimationFrame(this.#drawing);
    this.#drawing = 0;
  }

  set model(model) {
    this.#model = model;
    this.#ahead = null;
    this.#schedule();
  }

  #schedule() {
    if (this.#drawing === 0 && this.isConnected) this.#drawing = requestAnimationFrame(() => this.#draw());
  }

  #tell(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  get #size() { return this.#model?.a?.size ?? null; }
  get #window() { return { width: this.clientWidth || 1, height: this.clientHeight || 1 }; }
  get #view() { return bounded(this.#ahead ?? this.#model.view, this.#size, this.#window); }

  /** Between points of the element and of the image. */
  imagePoint(point) { return imagePoint(this.#view, this.#size, this.#window, point); }
  windowPoint(point) { return windowPoint(this.#view, this.#size, this.#window, point); }

  // ---- drawing ----

  #draw() {
    this.#drawing = 0;
    if (!this.#size) return;
    const ratio = window.devicePixelRatio || 1;
    const { width, height } = this.#window;
    if (this.#canvas.width !== Math.round(width * ratio)) this.#canvas.width = Math.round(width * ratio);
    if (this.#canvas.height !== Math.round(height * ratio)) this.#canvas.height = Math.round(height * ratio);
    const context = this.#canvas.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.#canvas.width, this.#canvas.height);
    this.#frame += 1;
    const { a, b, by, layer } = this.#model;
    const level = levelOf(zoomOf(this.#view, this.#size, this.#window), ratio, a.maxLevel);
    const names = [layer, ...(this.#model.overlay ? [this.#model.overlay] : []), ...(kOverChecks.includes(layer) ? ["alpha"] : [])];
    const blocks = seenBlocks(this.#view, this.#size, this.#window, level);
    const wanted = (source) => blocks.flatMap(([bx, by_]) => names.filter((name) => source.layer(name).name === name).map((name) => [name, level, bx, by_]));
    a.want(b && by === "b" ? [] : wanted(a));
    b?.want(by === "a" ? [] : wanted(b));
    const complete = this.#drawPictures(context, level, ratio);
    this.#drawMarks(context, ratio);
    if (this.#painted.size > kMostPainted) for (const [key, one] of this.#painted) if (one.used !== this.#frame) this.#painted.delete(key);
    this.dataset.busy = complete ? "" : this.#model.b && this.#model.by === "flip" ? "Computing FLIP …" : "Loading …";
    this.dataset.level = String(level);
    this.dataset.painted = complete ? `${layer} ${b ? by : "a"}` : "";
    if (complete) this.dataset.pictures = String(Number(this.dataset.pictures ?? 0) + 1);
  }

  #drawPictures(context, level, ratio) {
    const { a, b, by, split } = this.#model;
    if (!b || by === "a") return this.#drawPicture(context, level, ratio, "a", a);
    if (by === "b") return this.#drawPicture(context, level, ratio, "b", b);
    if (by === "wipe") {
      const at = Math.round(split * this.#canvas.width);
      const halves = [["a", a, 0, at], ["b", b, at, this.#canvas.width - at]].map(([which, source, x, width]) =>
        this.#clipped(context, x, width, () => this.#drawPicture(context, level, ratio, which, source)));
      return halves.every(Boolean);
    }
    if (by === "flip") return this.#flip.draw(context, (into, which) => this.#drawPicture(into, level, ratio, which, which === "a" ? a : b), `${JSON.stringify(this.#view)} ${this.#look} ${this.#model.layer} ${this.#model.changed}`);
    return this.#drawBlocks(context, level, ratio, (x, y) => this.#compared(level, x, y));
  }

  #clipped(context, x, width, draw) {
    context.save();
    context.beginPath();
    context.rect(x, 0, width, this.#canvas.height);
    context.clip();
    const result = draw();
    context.restore();
    return result;
  }

  /** True if every block at the wanted level was there. */
  #drawPicture(context, level, ratio, which, source) {
    const layer = source.layer(this.#model.layer);
    const seen = seenBlocks(this.#view, this.#size, this.#window, level).map(([bx, by]) => source.block(layer.name, level, bx, by));
    const there = seen.every(Boolean);
    for (let coarse = Math.min(source.maxLevel, level + kCoarser); !there && coarse > level; coarse -= 1) {
      this.#drawBlocks(context, coarse, ratio, (bx, by) => this.#block(which, source, layer, coarse, bx, by));
    }
    const drawn = this.#drawBlocks(context, level, ratio, (bx, by) => this.#block(which, source, layer, level, bx, by));
    const complete = drawn && !seen.some((block) => block.late); // of an earlier mix, see mixed_source.js
    if (!this.#model.overlay) return complete;
    context.globalAlpha = kOverlayOpacity;
    const over = this.#drawBlocks(context, level, ratio, (bx, by) => this.#block(which, source, source.layer(this.#model.overlay), level, bx, by));
    context.globalAlpha = 1;
    return complete && over;
  }

  #drawBlocks(context, level, ratio, canvasOf) {
    const size = this.#size;
    const zoom = zoomOf(this.#view, size, this.#window);
    const [left, top] = windowPoint(this.#view, size, this.#window, [0, 0]).map((v) => v * ratio);
    const pixel = zoom * ratio * 2 ** level; // size of an image pixel on the screen
    context.save();
    context.beginPath();
    context.rect(Math.round(left), Math.round(top), Math.round(size[0] * zoom * ratio), Math.round(size[1] * zoom * ratio));
    // At the right and lower edge a pixel of a level represents an area that extends beyond the image
    context.clip();
    context.imageSmoothingEnabled = pixel < 2;
    let all = true;
    for (const [bx, by] of seenBlocks(this.#view, size, this.#window, level)) {
      const canvas = canvasOf(bx, by);
      all &&= Boolean(canvas);
      if (!canvas) continue;
      const [x0, y0, x1, y1] = blockRect(size, level, bx, by).map((v, i) => Math.round((i % 2 ? top : left) + v * pixel));
      context.drawImage(canvas, x0, y0, x1 - x0, y1 - y0);
    }
    context.restore();
    return all;
  }

  get #look() {
    const { exposure, curve, cube, falseColour, channel, range, matte } = this.#model.look;
    return `${exposure} ${curve} ${Boolean(cube)} ${falseColour} ${channel} ${range} ${[...matte].join()}`;
  }

  #block(which, source, layer, level, bx, by) {
    const block = source.block(layer.name, level, bx, by);
    const hasAlpha = kOverChecks.includes(layer.name) && source.layer("alpha").name === "alpha";
    const alpha = hasAlpha ? source.block("alpha", level, bx, by) : null;
    if (!block || (hasAlpha && !alpha)) return undefined;
    const { look } = this.#model;
    const buffer = () => (alpha ? overChecks(block.buffer, alpha.buffer, block.rect, look.exposure) : block.buffer);
    return this.#kept(`${which} ${layer.name} ${level} ${bx} ${by}`, `${this.#look} ${block.version} ${alpha?.version}`, block.rect, () => paint(buffer(), layer, look));
  }

  #compared(level, bx, by) {
    const { a, b, by: how, look } = this.#model;
    const layer = a.layer(this.#model.layer);
    const [x, y] = [a.block(layer.name, level, bx, by), b.block(layer.name, level, bx, by)];
    return x && y && this.#kept(`${how} ${layer.name} ${level} ${bx} ${by}`, `${this.#look} ${x.version} ${y.version}`, x.rect, () => paintCompared(x.buffer, y.buffer, layer, look, how));
  }

  /** The canvas of `key` as it looks now, painted only if that has changed. */
  #kept(key, look, [x0, y0, x1, y1], pixels) {
    const kept = this.#painted.get(key);
    if (kept?.look === look) {
      kept.used = this.#frame;
      return kept.canvas;
    }
    const canvas = kept?.canvas ?? document.createElement("canvas");
    [canvas.width, canvas.height] = [x1 - x0, y1 - y0];
    canvas.getContext("2d").putImageData(new ImageData(pixels(), x1 - x0, y1 - y0), 0, 0);
    this.#painted.set(key, { canvas, look, used: this.#frame });
    return canvas;
  }

  #drawMarks(context, ratio) {
    const { region, focus, by, split, b, a, layer } = this.#model;
    context.lineWidth = ratio;
    const corner = (point) => windowPoint(this.#view, this.#size, this.#window, point).map((v) => Math.round(v * ratio) + 0.5);
    if (zoomOf(this.#view, this.#size, this.#window) >= kValuesFrom) drawValues(context, ratio, b && by === "b" ? b : a, layer, this.#view, this.#window, corner);
    const frame = ([left, top, right, bottom], strokes) => {
      const [[x0, y0], [x1, y1]] = [corner([left, top]), corner([right, bottom])];
      for (const [colour, dash] of strokes) {
        context.strokeStyle = colour;
        context.setLineDash(dash);
        context.strokeRect(x0, y0, x1 - x0, y1 - y0);
      }
      context.setLineDash([]);
    };
    if (focus) frame(focus, [["#000", []], ["#6fd3ff", [12 * ratio, 3 * ratio]]]);
    if (region) frame(region, [["#000", []], ["#ffe3b3", [6 * ratio, 4 * ratio]]]);
    if (b && by === "wipe") {
      context.fillStyle = "#ffe3b3";
      const at = Math.round(split * this.#canvas.width);
      context.fillRect(at - ratio, 0, 2 * ratio, this.#canvas.height);
      this.#drawSides(context, ratio, at);
    }
  }

  /** Which picture lies on which side of the wipe. */
  #drawSides(context, ratio, at) {
    context.font = `${12 * ratio}px system-ui, sans-serif`;
    for (const [text, x, align] of [[this.#model.sides?.[0] ?? "First", at - 10 * ratio, "right"], [this.#model.sides?.[1] ?? "Second", at + 10 * ratio, "left"]]) {
      context.textAlign = align;
      context.lineWidth = 3 * ratio;
      context.strokeStyle = "rgb(0 0 0 / 75%)";
      context.fillStyle = "#fff";
      context.strokeText(text, x, 18 * ratio);
      context.fillText(text, x, 18 * ratio);
    }
  }

  /** What is seen, as a canvas. */
  get picture() { return this.#canvas; }

  // ---- pointers and keys ----

  /** Does what a key does. */
  press(key) {
    this.#press({ key });
  }

  #point(event) {
    const box = this.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  #pixel(point) {
    const [x, y] = imagePoint(this.#view, this.#size, this.#window, point).map(Math.floor);
    return x >= 0 && y >= 0 && x < this.#size[0] && y < this.#size[1] ? [x, y] : null;
  }

  #viewed(view) {
    if (!this.#size) return;
    this.#ahead = bounded({ ...this.#view, ...view }, this.#size, this.#window);
    this.#tell("viewed", this.#ahead);
  }

  #wheel(event) {
    if (!this.#size) return;
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 30 : 1;
    this.#viewed(zoomed(this.#view, this.#size, this.#window, kWheelStep ** (-event.deltaY * lines), this.#point(event)));
  }

  #down(event) {
    if (!this.#size || event.button > 0) return;
    const point = this.#point(event);
    this.#pointers.set(event.pointerId, point);
    this.setPointerCapture(event.pointerId);
    if (this.#pointers.size === 2) {
      this.#drag = { kind: "pinch", from: [...this.#pointers.values()], view: this.#view };
      return;
    }
    const { by, b, split, tool } = this.#model;
    const onSplit = b && by === "wipe" && Math.abs(point[0] - split * this.#window.width) < kGrabSplit;
    const kind = onSplit ? "split" : event.shiftKey || tool === "region" ? "region" : "pan";
    this.#drag = { kind, from: point, view: this.#view, moved: false };
  }

  #move(event) {
    if (!this.#size) return;
    const point = this.#point(event);
    if (this.#pointers.has(event.pointerId)) this.#pointers.set(event.pointerId, point);
    if (!this.#drag) {
      this.#tell("pointed", this.#pixel(point));
      return;
    }
    const { kind, from, view } = this.#drag;
    if (kind === "pinch") {
      this.#pinch();
      return;
    }
    this.#drag.moved ||= Math.hypot(point[0] - from[0], point[1] - from[1]) > kClickSlop;
    if (!this.#drag.moved) return;
    if (kind === "split") this.#tell("split", Math.min(1, Math.max(0, point[0] / this.#window.width)));
    else if (kind === "region") this.#tell("framed", this.#regionOf(from, point));
    else this.#viewed(moved(view, this.#size, this.#window, from[0] - point[0], from[1] - point[1]));
  }

  #pinch() {
    const { from, view } = this.#drag;
    const now = [...this.#pointers.values()];
    const length = ([p, q]) => Math.max(1, Math.hypot(p[0] - q[0], p[1] - q[1]));
    const middle = ([p, q]) => [(p[0] + q[0]) / 2, (p[1] + q[1]) / 2];
    const [before, after] = [middle(from), middle(now)];
    const larger = zoomed(view, this.#size, this.#window, length(now) / length(from), before);
    this.#viewed(moved(larger, this.#size, this.#window, before[0] - after[0], before[1] - after[1]));
  }

  #up(event) {
    this.#pointers.delete(event.pointerId);
    const drag = this.#drag;
    this.#drag = null;
    if (event.type === "pointerup" && drag && drag.kind !== "pinch" && !drag.moved) {
      const pixel = this.#pixel(drag.from);
      this.#tell("pointed", pixel);
      if (pixel) this.#tell("picked", pixel);
    }
  }

  #regionOf(from, to) {
    const [p, q] = [from, to].map((point) => imagePoint(this.#view, this.#size, this.#window, point));
    const inside = (v, i) => Math.min(this.#size[i], Math.max(0, v));
    const low = [0, 1].map((i) => Math.floor(inside(Math.min(p[i], q[i]), i)));
    const high = [0, 1].map((i) => Math.ceil(inside(Math.max(p[i], q[i]), i)));
    return high[0] > low[0] && high[1] > low[1] ? [...low, ...high] : null;
  }

  #key(event) {
    if (!this.#size || event.ctrlKey || event.metaKey || event.altKey) return;
    if (this.#press(event)) event.preventDefault();
  }

  /** True if the key does something here. */
  #press(event) {
    if (!this.#size) return false;
    const [view, size, frame] = [this.#view, this.#size, this.#window];
    const middle = [frame.width / 2, frame.height / 2];
    if (kPan[event.key]) {
      const step = event.shiftKey ? zoomOf(view, size, frame) : kKeyStep * Math.min(frame.width, frame.height);
      const next = moved(view, size, frame, ...kPan[event.key].map((v) => v * step));
      this.#viewed(next);
      this.#tell("pointed", [0, 1].map((i) => Math.min(size[i] - 1, Math.floor(next.zoom === null ? size[i] / 2 : i ? next.y : next.x))));
    } else if (kZoomKeys[event.key]) this.#viewed(zoomed(view, size, frame, kZoomKeys[event.key]));
    else if (event.key === "0") this.#viewed({ zoom: null });
    else if (event.key === "z") this.#viewed(zoomed(view, size, frame, 1 / zoomOf(view, size, frame)));
    else if (event.key === "Enter" && this.#pixel(middle)) this.#tell("picked", this.#pixel(middle));
    else if (event.key === "r") {
      const region = this.#model.region ? null : this.#regionOf([0, 0], [frame.width, frame.height]);
      this.#model = { ...this.#model, region }; // a second press may come before the page is drawn
      this.#tell("framed", region);
    }
    else if (event.key.length === 1) this.#tell("command", event.key);
    else return false;
    return true;
  }
}

customElements.define("float-view", FloatView);
