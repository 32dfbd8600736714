// What a page's address says after its #: a body, by its name or by numbers of legs and links, a ground, a mode, and
// `walk` for a page that shows itself.
const read = () => new URLSearchParams(window.location.hash.slice(1));

export const names = (id) => read().has(id);
export const walks = () => names("walk");

// Sets a list or a slider to what the address says, if it offers that.
export function follow(control) {
  const text = read().get(control.id);
  if (text === null) return;
  if (control.type === "range") control.value = text;
  else {
    const index = [...control.options].findIndex((option) => option.text === text);
    if (index >= 0) control.selectedIndex = index;
  }
}

// Writes what lists and sliders have chosen into the address, without those that are hidden.
export function keep(controls) {
  const chosen = read();
  for (const control of controls) {
    const text = control.type === "range" ? control.value : control.selectedOptions[0].text;
    if (control.closest("[hidden]")) chosen.delete(control.id);
    else chosen.set(control.id, text);
  }
  window.history.replaceState(null, "", `#${chosen}`);
}
