// <live-image>: shows the ImageBitmap or canvas that `source(exposure, signal)` returns. It requests it again
// when `version` or `exposure` changes, with at most one request in progress and a pause that grows with the
// request's duration. A new exposure is shown immediately, approximated by brightness, until the
// coordinator's own picture arrives.

const kShortestPauseMs = 400;
const kPausePerCost = 3; // pause per duration of a request: after one of 1 s the next begins 3 s later
const kFirstRetryMs = 500; // pause after the first failure; doubled by each further one
const kLongestRetryMs = 15_000;

class LiveImage extends HTMLElement {
  #canvas = document.createElement("canvas");
  #values = { source: null, version: null, exposure: 0, size: 0 };
  #shown = null; // {version, exposure} of the picture on the canvas
  #request = null; // AbortController of the request in progress
  #timer = 0;
  #notBefore = 0; // time by performance.now() before which no request is made
  #failures = 0; // number of consecutive failures for the wanted picture
  #retryAt = 0; // time of the next attempt, by performance.now()

  connectedCallback() {
    this.append(this.#canvas);
    this.#schedule();
  }

  disconnectedCallback() {
    clearTimeout(this.#timer);
    this.#request?.abort();
  }

  set source(source) { this.#values.source = source; this.#schedule(); }
  set version(version) {
    if (version !== this.#values.version) this.#retryAt = this.#failures = 0;
    this.#values.version = version;
    this.#schedule();
  }
  set size(size) { // width * 65536 + height: as one number, equal sizes compare equal
    this.#canvas.width = Math.floor(size / 65536);
    this.#canvas.height = size % 65536;
  }
  set exposure(exposure) {
    if (exposure !== this.#values.exposure) this.#retryAt = this.#failures = 0;
    this.#values.exposure = exposure;
    this.#preview();
    this.#notBefore = Math.min(this.#notBefore, performance.now() + 120);
    this.#schedule();
  }

  /** Stops change the linear value by 2; the eye's curve (2.2) makes that 2^(1/2.2) in what brightness() multiplies. */
  #preview() {
    const difference = this.#values.exposure - (this.#shown?.exposure ?? this.#values.exposure);
    this.#canvas.style.filter = difference ? `brightness(${2 ** (difference / 2.2)})` : "";
  }

  #schedule() {
    clearTimeout(this.#timer);
    if (!this.isConnected || !this.#values.source || this.#request) return;
    const { version, exposure } = this.#values;
    if (this.#shown?.version === version && this.#shown.exposure === exposure) return;
    this.#timer = setTimeout(() => this.#fetch(), Math.max(0, this.#notBefore - performance.now(), this.#retryAt - performance.now()));
  }

  async #fetch() {
    const { source, version, exposure } = this.#values;
    const began = performance.now();
    this.#request = new AbortController();
    try {
      this.#paint(await source(exposure, this.#request.signal));
      this.dataset.painted = String(Number(this.dataset.painted ?? 0) + 1);
      this.#shown = { version, exposure };
      this.#failures = 0;
    } catch {
      // There may be no samples yet, or a temporary failure. The last picture stays, and a new one is
      // requested at growing intervals, or at the next change. The page's own status shows when the
      // coordinator is unreachable.
      this.#retryAt = performance.now() + Math.min(kFirstRetryMs * 2 ** this.#failures, kLongestRetryMs);
      this.#failures += 1;
    }
    this.#request = null;
    this.#preview();
    this.#notBefore = performance.now() + Math.max(kShortestPauseMs, kPausePerCost * (performance.now() - began));
    this.#schedule();
  }

  #paint(picture) {
    this.#canvas.width = picture.width;
    this.#canvas.height = picture.height;
    this.#canvas.getContext("2d").drawImage(picture, 0, 0);
    picture.close?.();
    this.classList.toggle("small", picture.width * 2 <= this.clientWidth);
  }
}

customElements.define("live-image", LiveImage);
