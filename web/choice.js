// A choice among bodies: a list of names, and sliders for bodies that differ by their numbers of legs and links.
const COUNTED = "legs and links"; // in the list, where the sliders choose

export class Choice {
  // Takes an element of a list, those of the sliders, and the bodies of a page's data.
  constructor(list, sliders, bodies) {
    Object.assign(this, { list, sliders, bodies });
    const counted = bodies.filter(({ counts }) => counts);
    this.counted = counted.length > 1 ? counted : [];
    bodies.forEach((body, index) => this.counted.includes(body) || list.append(new Option(body.name, index)));
    if (this.counted.length) list.append(new Option(COUNTED));
    list.parentElement.hidden = list.length === 1;
    for (const slider of sliders) {
      const numbers = this.counted.map(({ counts }) => counts[slider.id]);
      if (numbers.length) Object.assign(slider, { min: Math.min(...numbers), max: Math.max(...numbers) });
      slider.addEventListener("input", () => this.tell());
      slider.addEventListener("pointerup", () => slider.blur()); // the keys are the body's
    }
  }

  // The body that is chosen; by sliders the one with the nearest numbers.
  get body() {
    if (this.list.value !== COUNTED) return this.bodies[this.list.value];
    const away = ({ counts }) => this.sliders.reduce((sum, { id, value }) => sum + Math.abs(counts[id] - value), 0);
    return this.counted.reduce((nearest, body) => (away(body) < away(nearest) ? body : nearest));
  }

  // Has the sliders choose, if they can.
  count() {
    if (this.counted.length) this.list.value = COUNTED;
  }

  // Shows the numbers of the sliders where they choose.
  tell() {
    for (const slider of this.sliders) {
      slider.parentElement.hidden = this.list.value !== COUNTED;
      slider.nextElementSibling.value = `${slider.value} ${slider.id}`;
    }
  }
}
