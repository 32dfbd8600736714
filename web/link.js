// What a page's address says after its #: a body's name, a ground's, and `walk` for a page that shows itself.
const read = () => new URLSearchParams(window.location.hash.slice(1));

export const walks = () => read().has("walk");

// Selects the option of a list that the address names, if there is one.
export function follow(list) {
  const name = read().get(list.id);
  const index = [...list.options].findIndex(({ text }) => text === name);
  if (index >= 0) list.selectedIndex = index;
}

// Writes what lists have selected into the address.
export function keep(lists) {
  const chosen = read();
  for (const { id, selectedOptions } of lists) chosen.set(id, selectedOptions[0].text);
  window.history.replaceState(null, "", `#${chosen}`);
}
