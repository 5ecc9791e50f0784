// The FLIP map of two pictures as they appear on the screen: at the present zoom, exposure and tone curve, in
// window pixels.

/** onCome(mean): a map is there. draw() paints the last one, and asks for another when `key` has changed; true: it is of `key`. */
export function flipCanvas(onCome) {
  let worker = null;
  let asked = { key: "", number: 0 };
  let shown = { number: -1, canvas: null };

  function come({ data }) {
    if (data.number !== asked.number) return;
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [data.width, data.height];
    canvas.getContext("2d").putImageData(new ImageData(data.rgba, data.width, data.height), 0, 0);
    shown = { number: data.number, canvas };
    onCome(data.mean);
  }

  function ask(width, height, drawPicture, key) {
    const pixels = ["b", "a"].map((which) => { // b is the reference
      const canvas = document.createElement("canvas");
      [canvas.width, canvas.height] = [width, height];
      const context = canvas.getContext("2d", { willReadFrequently: true });
      return drawPicture(context, which) ? context.getImageData(0, 0, width, height).data : null;
    });
    if (!pixels[0] || !pixels[1]) return;
    asked = { key, number: asked.number + 1 };
    if (!worker) {
      worker = new Worker(new URL("./flip_worker.js", import.meta.url), { type: "module" });
      worker.onmessage = come;
    }
    worker.postMessage({ number: asked.number, reference: pixels[0], image: pixels[1], width, height });
  }

  return {
    draw(context, drawPicture, key) {
      const { width, height } = context.canvas;
      const sized = `${key} ${width} ${height}`;
      if (sized !== asked.key) ask(width, height, drawPicture, sized);
      if (shown.canvas) context.drawImage(shown.canvas, 0, 0, width, height);
      return shown.number === asked.number && sized === asked.key;
    },
    end() {
      worker?.terminate();
      worker = null;
    },
  };
}
