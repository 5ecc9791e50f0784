// Computes FLIP in a web worker, so that the page keeps responding: {number, reference, image, width, height}
// -> {number, mean, rgba}.
import { flip, linearOf } from "./flip.js";
import { falseColour } from "./tone.js";

self.onmessage = ({ data: { number, reference, image, width, height } }) => {
  const errors = flip(linearOf(reference), linearOf(image), width, height);
  const rgba = new Uint8ClampedArray(4 * errors.length);
  let sum = 0;
  errors.forEach((error, i) => {
    sum += error;
    falseColour(error, rgba, 4 * i);
    rgba[4 * i + 3] = 255;
  });
  self.postMessage({ number, mean: sum / errors.length, rgba, width, height }, [rgba.buffer]);
};
