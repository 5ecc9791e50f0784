// A view is a function of the state that returns a tree of h(...) nodes. patch() makes the page match the
// tree and changes only the differences, so focus, scroll position and running animations survive. Text
// always becomes a text node: nothing here parses markup.

const kSvg = "http://www.w3.org/2000/svg";
// Marks nodes made by h(): data from JSON cannot have this key, whatever its fields are called
const kNode = Symbol("node");

/**
 * h("a", {href, class, key, onclick, style: {"--x": 1}, ".prop": value}, ...children)
 * `onname` are listeners, `.name` are properties of the element, `style` goes through the CSSOM (the page's policy
 * forbids style attributes), true is an empty attribute, and null, undefined and false leave an attribute out.
 */
export function h(tag, attributes, ...children) {
  const { key = null, ...rest } = attributes ?? {};
  return { [kNode]: true, tag, key, attributes: rest, children: normalise(children) };
}

function normalise(children) {
  return children
    .flat(Infinity)
    .filter((child) => child !== null && child !== undefined && child !== false && child !== true)
    .map((child) => (child[kNode] ? child : { [kNode]: true, tag: null, key: null, text: String(child) }));
}

const nodeOf = new WeakMap(); // element -> the h() node it shows

/** Makes the children of `parent` look like `nodes`. */
export function patch(parent, ...nodes) {
  patchChildren(parent, normalise(nodes));
}

function patchChildren(parent, nodes) {
  const { keyed, loose } = reusable(parent);
  const takeLoose = (node) => {
    const at = loose.findIndex((element) => nodeOf.get(element)?.tag === node.tag);
    return at < 0 ? undefined : loose.splice(at, 1)[0];
  };
  const elements = nodes.map((node) => {
    const old = node.key === null ? takeLoose(node) : takeKeyed(keyed, node);
    const element = old ?? create(node, parent);
    if (old) update(element, nodeOf.get(element), node);
    nodeOf.set(element, node);
    return element;
  });
  // Elements that disappear are removed first. The remaining ones are then already in place: moving an
  // element would restart its animation.
  const staying = new Set(elements);
  for (const child of [...parent.childNodes]) if (!staying.has(child)) child.remove();
  elements.forEach((element, i) => {
    if (parent.childNodes[i] !== element) parent.insertBefore(element, parent.childNodes[i] ?? null);
  });
}

function reusable(parent) {
  const keyed = new Map();
  const loose = [];
  for (const child of parent.childNodes) {
    const node = nodeOf.get(child);
    if (node && node.key !== null) keyed.set(node.key, child);
    else if (node) loose.push(child);
  }
  return { keyed, loose };
}

function takeKeyed(keyed, node) {
  const element = keyed.get(node.key);
  if (!element || nodeOf.get(element).tag !== node.tag) return undefined;
  keyed.delete(node.key);
  return element;
}

function create(node, parent) {
  if (node.tag === null) return document.createTextNode(node.text);
  const inSvg = node.tag === "svg" || (parent.namespaceURI === kSvg && parent.localName !== "foreignObject");
  const element = inSvg ? document.createElementNS(kSvg, node.tag) : document.createElement(node.tag);
  update(element, null, node);
  return element;
}

function update(element, old, node) {
  if (node.tag === null) {
    if (old.text !== node.text) element.data = node.text;
    return;
  }
  const before = old?.attributes ?? {};
  for (const name of Object.keys(before)) if (!(name in node.attributes)) assign(element, name, null, before[name]);
  for (const [name, value] of Object.entries(node.attributes)) {
    if (before[name] !== value) assign(element, name, value, before[name]);
  }
  // An element without children in any tree (a custom element) manages its own children.
  if (node.children.length > 0 || old?.children.length > 0) patchChildren(element, node.children);
}

function assign(element, name, value, before) {
  if (name.startsWith("on")) {
    if (before) element.removeEventListener(name.slice(2), before);
    if (value) element.addEventListener(name.slice(2), value);
  } else if (name.startsWith(".")) {
    element[name.slice(1)] = value;
  } else if (name === "style") {
    for (const property of Object.keys(before ?? {})) if (!(property in (value ?? {}))) element.style.removeProperty(property);
    for (const [property, text] of Object.entries(value ?? {})) element.style.setProperty(property, String(text));
  } else if (value === null || value === undefined || value === false) {
    element.removeAttribute(name);
  } else {
    element.setAttribute(name, value === true ? "" : String(value));
  }
}
