// <frame-film>: shows one frame of a sequence and plays through them. It keeps the pictures of frames that were
// shown and fetches those that come next, so that scrubbing and playing don't wait for each. Its property `model`
// determines what it shows: {ids, at, playing, fps, version, shown, load, small}. It reports the next frame as
// event `turned` (an id), as soon as it is due and its picture is there.
// <film-strip>: a row that scrolls its marked link into view when its property `current` changes.

const kAtOnce = 2; // most requests in progress
const kAhead = 24; // frames fetched ahead while playing
const kAround = 3; // frames fetched on both sides while it stands still
const kMostBytes = 256 * 2 ** 20; // of pictures that are kept

class FrameFilm extends HTMLElement {
  #canvas = document.createElement("canvas");
  #model = null;
  #pictures = new Map(); // `${id} ${version}` -> ImageBitmap; null: it could not be fetched
  #loading = new Map(); // key -> AbortController
  #bytes = 0;
  #drawn = null; // id of the frame on the canvas
  #whole = null; // key of the picture on the canvas, unless it is only the small one
  #due = 0; // time of the next frame, by performance.now()
  #tick = 0;

  connectedCallback() {
    this.append(this.#canvas);
    this.#update();
  }

  disconnectedCallback() {
    cancelAnimationFrame(this.#tick);
    this.#tick = 0;
    for (const request of this.#loading.values()) request.abort();
    for (const picture of this.#pictures.values()) picture?.close();
    this.#pictures.clear();
    this.#bytes = 0;
  }

  set model(model) {
    if (model.playing && !this.#model?.playing) this.#due = performance.now() + 1000 / model.fps;
    this.#model = model;
    this.#update();
  }

  #key(id) { return `${id} ${this.#model.version}`; }

  #update() {
    if (!this.isConnected || !this.#model) return;
    const { at, shown, playing } = this.#model;
    if (at !== null) {
      this.#fetch();
      this.#draw(at);
    }
    this.hidden = at === null && this.#drawn !== shown;
    if (playing && !this.#tick) this.#tick = requestAnimationFrame(() => this.#play());
  }

  #play() {
    this.#tick = 0;
    const { ids, at, playing, fps } = this.#model;
    if (!playing || !this.isConnected) return;
    const next = ids[(ids.indexOf(at) + 1) % ids.length];
    const now = performance.now();
    if (now >= this.#due && this.#pictures.has(this.#key(next))) {
      this.#due = Math.max(this.#due + 1000 / fps, now);
      this.dispatchEvent(new CustomEvent("turned", { detail: next }));
    }
    if (!this.#tick) this.#tick = requestAnimationFrame(() => this.#play());
  }

  /** The frames that are needed, the most urgent first. */
  #wanted() {
    const { ids, at, playing } = this.#model;
    const from = ids.indexOf(at);
    const order = [0];
    if (playing) for (let i = 1; i <= Math.min(kAhead, ids.length - 1); i += 1) order.push(i);
    else for (let i = 1; i <= kAround; i += 1) order.push(i, -i);
    return order.map((i) => (playing ? (from + i) % ids.length : from + i)).filter((i) => i >= 0 && i < ids.length).map((i) => ids[i]);
  }

  #fetch() {
    const wanted = this.#wanted();
    const keys = new Set(wanted.map((id) => this.#key(id)));
    for (const [key, request] of this.#loading) if (!keys.has(key)) request.abort();
    for (const id of wanted) {
      if (this.#loading.size >= kAtOnce) return;
      const key = this.#key(id);
      if (!this.#pictures.has(key) && !this.#loading.has(key)) this.#load(id, key, keys);
    }
  }

  async #load(id, key) {
    const request = new AbortController();
    this.#loading.set(key, request);
    let picture = null;
    try {
      picture = await this.#model.load(id, request.signal);
    } catch {
      // a frame that can't be fetched is passed over; the page's own status says why
    }
    this.#loading.delete(key);
    if (!this.isConnected || request.signal.aborted) picture?.close();
    else {
      this.#pictures.set(key, picture);
      this.#bytes += picture ? 4 * picture.width * picture.height : 0;
      this.#forget();
    }
    this.#update();
  }

  /** Drops the pictures that come last from here on. */
  #forget() {
    if (this.#bytes <= kMostBytes) return;
    const { ids, at } = this.#model;
    const from = Math.max(0, ids.indexOf(at));
    const order = [...ids.slice(from), ...ids.slice(0, from)].map((id) => this.#key(id));
    const place = (key) => (order.includes(key) ? order.indexOf(key) : Infinity);
    for (const key of [...this.#pictures.keys()].sort((p, q) => place(q) - place(p))) {
      if (this.#bytes <= kMostBytes || place(key) === 0) return;
      const picture = this.#pictures.get(key);
      this.#bytes -= picture ? 4 * picture.width * picture.height : 0;
      picture?.close();
      this.#pictures.delete(key);
    }
  }

  #draw(id) {
    const picture = this.#pictures.get(this.#key(id));
    if (this.#drawn === id && (!picture || this.#whole === this.#key(id))) return;
    const small = picture ?? this.#model.small(id); // better than the frame before, until the picture is there
    if (!small) return;
    this.#canvas.width = small.naturalWidth ?? small.width;
    this.#canvas.height = small.naturalHeight ?? small.height;
    this.#canvas.getContext("2d").drawImage(small, 0, 0);
    this.#drawn = id;
    this.#whole = picture ? this.#key(id) : null;
    this.dataset.shown = id;
    this.dataset.whole = picture ? "yes" : "no";
  }
}

class FilmStrip extends HTMLElement {
  #current = null;

  set current(current) {
    if (current === this.#current) return;
    this.#current = current;
    requestAnimationFrame(() => {
      const mark = this.querySelector("[aria-current]");
      if (mark) this.scrollLeft = mark.parentElement.offsetLeft + (mark.offsetWidth - this.clientWidth) / 2;
    });
  }
}

customElements.define("frame-film", FrameFilm);
customElements.define("film-strip", FilmStrip);
