// Elements of a page, and bytes that it holds.

function bytesOf(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

function choice(name, options, chosen) {
  const made = element("select", { "aria-label": name });
  for (const [value, text] of options) made.append(element("option", { value }, text));
  made.value = chosen;
  return made;
}

function switchOf(text) {
  const input = element("input", { type: "checkbox" });
  input.checked = true;
  return { input, label: element("label", {}, input, ` ${text}`) };
}
