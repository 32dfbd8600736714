// Diagrams of a walk in canvases: foot contacts and rewards, with a cursor.

const WINDOW = 4; // s of foot contacts
const INK = "#d7dde5", PALE = "#39424f", BLUE = "#3b9be0", VERMILION = "#f0713a";

function sized(canvas) {
  const scale = window.devicePixelRatio;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = "11px system-ui, sans-serif";
  pen.textBaseline = "middle";
  return { pen, width, height };
}

const LEFT = 58, RIGHT = 150; // px, for names of legs and for terms
const NARROW = 420; // px, below which terms stand under their diagram, in columns
const DIAGRAM = 146, LINE = 16, COLUMNS = 2;

const right = (width) => (width < NARROW ? 8 : RIGHT);

// The height of a diagram of rewards of a width, px.
export function rewardHeight(width, walk) {
  return DIAGRAM + (width < NARROW ? LINE * Math.ceil(Object.keys(walk.terms).length / COLUMNS) : 0);
}

// Bars of stance by leg on the prescribed schedule, some seconds about the cursor.
export function drawGait(canvas, walk, time) {
  const { pen, width, height } = sized(canvas);
  const rows = walk.legs.length, pitch = (height - 4) / rows, scale = (width - LEFT - 8) / WINDOW;
  const start = time - WINDOW / 2;
  const bar = (first, last, row, share, color) => {
    const from = Math.max(LEFT, LEFT + (first * walk.step - start) * scale);
    const to = Math.min(width - 8, LEFT + (last * walk.step - start) * scale);
    if (to <= from) return;
    pen.fillStyle = color;
    pen.fillRect(from, 2 + (row + (1 - share) / 2) * pitch, to - from + 0.5, share * pitch); // without seams
  };
  walk.legs.forEach((leg, row) => {
    pen.fillStyle = INK;
    pen.fillText(leg, 4, 2 + (row + 0.5) * pitch);
    const first = Math.max(0, Math.floor(start / walk.step) - 1);
    const last = Math.min(walk.positions.length, Math.ceil((start + WINDOW) / walk.step) + 1);
    const steps = Array.from({ length: Math.max(0, last - first) }, (_, index) => first + index);
    for (const k of steps) if (walk.schedule[k][row]) bar(k, k + 1, row, 0.84, PALE);
    for (const k of steps) if (walk.stance[k][row]) bar(k, k + 1, row, 0.4, walk.schedule[k][row] ? BLUE : VERMILION);
  });
  pen.fillStyle = "#ffffff";
  pen.fillRect(LEFT + (WINDOW / 2) * scale - 0.5, 0, 1, height);
}

// Where the name and value of a term stand: right of the diagram, or below a narrow one.
function place(index, count, width) {
  if (width >= NARROW) return { left: width - RIGHT + 8, end: width - 4, line: 8 + (index * (DIAGRAM - 16)) / Math.max(count - 1, 1) };
  const column = index % COLUMNS, part = width / COLUMNS;
  return { left: column * part + 8, end: (column + 1) * part - 4, line: DIAGRAM + LINE * (Math.floor(index / COLUMNS) + 0.5) };
}

// Weighted terms of the reward, gains stacked upwards and costs downwards, with their values at the cursor.
export function drawReward(canvas, walk, time, row, [bottom, top]) {
  canvas.style.height = `${rewardHeight(canvas.clientWidth, walk)}px`;
  const { pen, width } = sized(canvas), height = DIAGRAM;
  const names = Object.keys(walk.terms), count = walk.positions.length;
  const scale = (width - LEFT - right(width)) / count;
  const y = (value) => 6 + ((top - value) / (top - bottom)) * (height - 12);
  for (let k = 0; k < count; k += 1) {
    let up = 0, down = 0;
    for (const name of names) {
      const value = walk.terms[name][k], from = value > 0 ? up : down;
      pen.fillStyle = walk.colors[name];
      pen.fillRect(LEFT + k * scale, Math.min(y(from), y(from + value)), scale + 0.6, Math.abs(y(from) - y(from + value)));
      if (value > 0) up += value;
      else down += value;
    }
  }
  pen.fillStyle = INK;
  pen.textAlign = "right";
  for (const value of [0, Math.floor(top)]) pen.fillText(value.toFixed(0), LEFT - 6, y(value));
  pen.textAlign = "left";
  pen.fillText("reward", 4, height / 2);
  pen.fillStyle = "#ffffff";
  pen.fillRect(LEFT + Math.min(time / walk.step, count) * scale - 0.5, 0, 1, height);
  names.forEach((name, index) => {
    const { left, end, line } = place(index, names.length, width);
    pen.fillStyle = walk.colors[name];
    pen.fillRect(left, line - 4, 8, 8);
    pen.fillStyle = INK;
    pen.fillText(name.replaceAll("_", " "), left + 12, line);
    pen.textAlign = "right";
    pen.fillText(walk.terms[name][row].toFixed(2).replace(/^-(?=0.00$)/, ""), end, line);
    pen.textAlign = "left";
  });
}

// The least and the greatest of what costs and gains add up to in any step.
export function extent(walk) {
  const sums = (part) => walk.totals.map((_, k) => Object.values(walk.terms).reduce((sum, term) => sum + part(0, term[k]), 0));
  return [Math.min(...sums(Math.min), 0), Math.max(...sums(Math.max), 1e-9)];
}

// The time at a place in a diagram of foot contacts about a time, and in one of rewards, px from the left.
export function gaitTime(canvas, x, time) {
  return time + ((x - LEFT) / (canvas.clientWidth - LEFT - 8) - 0.5) * WINDOW;
}

export function rewardTime(canvas, x, walk) {
  return ((x - LEFT) / (canvas.clientWidth - LEFT - right(canvas.clientWidth))) * walk.step * walk.positions.length;
}
