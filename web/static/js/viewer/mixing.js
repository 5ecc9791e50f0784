// Light groups in the viewer: the panel, what can be done there, and the error of the mix. This module and what it
// imports are loaded for the first picture that has light groups.
import { groupsOf, kMix, mixOf, rowOf, rowsOf, rowsOfMix, textsOf, withRow } from "./mix.js";
import { mixPanel } from "./mix_panel.js";

export { MixedSource } from "./mixed_source.js";

const kPauseMs = 300; // after the last change of a mix, before its error is asked for
const kFreshPauseMs = 2000; // between two questions for the error of a mix of a job that renders

/**
 * What the panel of a job's picture shows and does. show(more): `more` is in the viewer's state now; look(more): in
 * its view; settled(): the mix has been as it is for a while; job: {error(json), exr(json), again(json)}, the figures of a mix, as
 * a promise, and the address of its image; again(json) renders the scene with the mix as a new job, and shows it; null:
 * the caller may not.
 */
export function makeMixing({ h, layers, get, show, look, settled, job }) {
  const groups = groupsOf(layers);
  let [timer, asked] = [0, 0];
  let rendering = false;
  const rows = () => rowsOf(get().view.mix, groups);
  const json = () => JSON.stringify(mixOf(rows(), groups));

  async function ask() {
    timer = 0;
    asked += 1;
    const mine = asked;
    const of = json();
    let figures;
    try {
      figures = of === "{}" ? null : await job.error(of);
    } catch (error) {
      figures = { problem: error.message };
    }
    if (mine !== asked || timer !== 0) return; // another question has been asked, or will be
    show({ mixError: figures, mixWaits: false });
    settled();
  }

  function askAfter(ms) {
    clearTimeout(timer);
    timer = setTimeout(ask, ms);
  }

  function change(texts, more = {}) {
    look({ mix: texts, ...more });
  }

  const actions = {
    /** rows: of mix.js. Shows the mix, if a picture without it is shown. */
    set: (next) => change(textsOf(next), get().view.layer.startsWith(kMix) ? {} : { layer: kMix }),
    /** more(row): what changes in a group's row as it is now, which the panel may not show yet. */
    alter: (name, more) => actions.set(withRow(rows(), name, more(rowOf(rows(), name)))),
    reset: () => change([], { layer: get().plain }),
    async render() {
      if (rendering) return; // pressed twice: one job is enough
      rendering = true;
      show({ mixRefused: null });
      try {
        await job.again(json());
      } catch (error) {
        show({ mixRefused: error.message });
      }
      rendering = false;
    },
    async load(file) {
      try {
        const next = rowsOfMix(JSON.parse(await file.text()), groups);
        show({ mixRefused: null });
        actions.set(next);
      } catch (error) {
        show({ mixRefused: `${file.name}: ${error instanceof SyntaxError ? "It is no JSON." : error.message}` });
      }
    },
  };

  return {
    /** Rows are others now: the error of before is no more that of the mix. */
    changed() {
      show({ mixWaits: json() !== "{}", mixRefused: null });
      askAfter(kPauseMs);
    },
    /** The job has further samples. */
    touched() {
      if (timer === 0 && json() !== "{}") askAfter(kFreshPauseMs);
    },
    close() {
      clearTimeout(timer);
      asked += 1;
    },
    panel: (viewer) => mixPanel(h, { groups, rows: rows(), json: json(), error: viewer.mixError, waits: viewer.mixWaits, refused: viewer.mixRefused, exr: job.exr(json()), renders: job.again !== null }, actions),
  };
}
