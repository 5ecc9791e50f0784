// The viewer's state in the address bar, so that a link opens the same view:
// #/view/ID?layer=depth&ev=1.5&zoom=2&x=10&y=20 &with=ID&by=wipe&split=0.4&region=0,0,10,10&matte=name
// &mix=sun*g1.5 (viewer/mix.js). Values that equal their defaults are left out.

export const kCompared = [["wipe", "Wipe"], ["a", "First"], ["b", "Second"], ["difference", "Difference"], ["relmse", "relMSE"], ["flip", "FLIP"]];
export const kOverlays = [["", "None"], ["error", "Error"], ["spp", "Samples"]];
export const kMostExposure = 16;

export const kPlain = {
  layer: "rgb", channel: null, exposure: 0, curve: null, falseColour: false, overlay: "", zoom: null, x: 0, y: 0, other: null, by: "wipe", split: 0.5, region: null, matte: [], mix: [],
};

const one = (options, value, otherwise) => (options.some(([name]) => name === value) ? value : otherwise);
const number = (text, least, most, otherwise) => (text !== null && text !== "" && Number.isFinite(Number(text)) ? Math.min(most, Math.max(least, Number(text))) : otherwise);

/** What a link says, as far as it makes sense. */
export function viewOf(query) {
  const of = new URLSearchParams(query);
  const region = (of.get("region") ?? "").split(",").map(Number);
  const channel = of.get("channel");
  const inOrder = region.length === 4 && region.every((v) => Number.isInteger(v) && v >= 0) && region[0] < region[2] && region[1] < region[3];
  return {
    layer: of.get("layer"), // null: the best picture there is
    channel: channel === null ? null : number(channel, 0, 2, null),
    exposure: number(of.get("ev"), -kMostExposure, kMostExposure, 0),
    curve: of.get("curve"), // null: the coordinator's default
    falseColour: of.get("false") === "1",
    overlay: one(kOverlays, of.get("over"), ""),
    zoom: number(of.get("zoom"), 1e-3, 128, null),
    x: number(of.get("x"), 0, 1e6, 0),
    y: number(of.get("y"), 0, 1e6, 0),
    other: of.get("with"),
    by: one(kCompared, of.get("by"), kPlain.by),
    split: number(of.get("split"), 0, 1, kPlain.split),
    region: inOrder ? region : null,
    matte: of.getAll("matte").slice(0, 64),
    mix: of.getAll("mix").slice(0, 32), // the most light groups of an image
  };
}

const short = (v) => String(Number(v.toFixed(3)));

/** plain: the layer that is shown if the address names none. */
export function queryOf(view, plain = kPlain.layer) {
  const of = new URLSearchParams();
  const put = (name, value, plain) => (value === plain || value === null ? null : of.set(name, value));
  put("layer", view.layer, plain);
  put("channel", view.channel, null);
  put("ev", view.exposure ? short(view.exposure) : 0, 0);
  put("curve", view.curve, kPlain.curve);
  put("false", view.falseColour ? "1" : null, null);
  put("over", view.overlay, "");
  if (view.zoom !== null) for (const name of ["zoom", "x", "y"]) of.set(name, short(view[name]));
  put("with", view.other, null);
  if (view.other) {
    put("by", view.by, kPlain.by);
    put("split", short(view.split), short(kPlain.split));
  }
  put("region", view.region?.join(",") ?? null, null);
  for (const name of view.matte) of.append("matte", name);
  for (const text of view.mix) of.append("mix", text);
  return of.toString();
}
