// Small helpers around the document. Data of a robot is put in as text, never as markup.

const SVG = "http://www.w3.org/2000/svg";

/** The element with an id, which index.html has. */
export const byId = (id) => document.getElementById(id);

/** A new element: its attributes, then its children (elements, or text). */
export function make(name, attributes = {}, ...children) {
  return filled(document.createElement(name), attributes, children);
}

/** The same for a part of a drawing. */
export function draw(name, attributes = {}, ...children) {
  return filled(document.createElementNS(SVG, name), attributes, children);
}

function filled(element, attributes, children) {
  for (const [key, value] of Object.entries(attributes)) {
    if (value !== null && value !== undefined && value !== false) element.setAttribute(key, value === true ? "" : String(value));
  }
  element.append(...children);
  return element;
}

/** Sets a text; a document that says so already is left alone. */
export function say(element, text) {
  const wanted = String(text);
  if (element.textContent === wanted) return;
  const { firstChild } = element;
  // Changing the text node is cheaper than replacing it.
  if (firstChild?.nodeType === Node.TEXT_NODE && firstChild === element.lastChild) firstChild.data = wanted;
  else element.textContent = wanted;
}

/** Sets an attribute; a document that says so already is left alone. */
export function mark(element, name, value) {
  const wanted = String(value);
  if (element.getAttribute(name) !== wanted) element.setAttribute(name, wanted);
}

/** Shows or hides an element. */
export function show(element, isShown) {
  if (element.hidden === isShown) element.hidden = !isShown;
}

/** A text of the robot, apart from the direction of writing of what stands around it. */
export const quoted = (text, className) => make("bdi", className ? { class: className } : {}, String(text));
