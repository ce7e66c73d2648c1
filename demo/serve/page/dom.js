// Small helpers over the document.

const SVG = "http://www.w3.org/2000/svg";

export const find = (id) => document.getElementById(id);

// A new element; a tag as `svg:circle` is one of a drawing. Properties that begin with `on` are listeners.
export function element(tag, properties = {}, ...children) {
  const made = tag.startsWith("svg:") ? document.createElementNS(SVG, tag.slice(4)) : document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name in made && !tag.startsWith("svg:")) made[name] = value;
    else made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}
