// Marks over the bodies: axes of the gearbox, a scale bar, and names, on a canvas of their own.
import { pageColour } from "./colours.js";

/** @typedef {{name: string, x: number, y: number, width: number}} Tag */
const FONT = "12px system-ui, sans-serif";
const HEIGHT = 18;
const SHIFT = 6;
const EDGE = 6;
const AXIS = 34;
const MOST_LETTERS = 40;
/** Largest share of the picture's width that the scale bar takes. */
const LONGEST = 0.22;

/** @param {import("./stage.js").Stage} stage */
export function drawMarks(stage) {
  const { marks, data } = stage;
  const drawing = marks.getContext("2d");
  const { clientWidth: width, clientHeight: height } = stage.canvas;
  // A picture that is not shown, as on paper, keeps the marks of its pixels.
  if (!drawing || !data || !width || !height) return;
  const ratio = window.devicePixelRatio || 1;
  [marks.width, marks.height] = [Math.round(ratio * width), Math.round(ratio * height)];
  drawing.scale(ratio, ratio);
  drawing.font = FONT;
  drawing.textBaseline = "middle";
  drawAxes(drawing, stage, height);
  drawScale(drawing, stage, width, height);
  if (stage.labelled) drawNames(drawing, stage, width, height);
  drawFlags(drawing, stage, width, height);
}

/** Rings around the points that are pointed out. @param {CanvasRenderingContext2D} drawing @param {import("./stage.js").Stage} stage @param {number} width @param {number} height */
function drawFlags(drawing, stage, width, height) {
  drawing.strokeStyle = drawing.fillStyle = pageColour("--bad");
  drawing.lineWidth = 2.5;
  drawing.textAlign = "center";
  stage.flags.forEach(({ text, at }, number) => {
    const seen = new THREE.Vector3(...at).project(stage.camera);
    const [x, y] = [((seen.x + 1) / 2) * width, ((1 - seen.y) / 2) * height];
    drawing.beginPath();
    drawing.arc(x, y, 9, 0, 2 * Math.PI);
    drawing.stroke();
    if (number) return;
    // The name of a body may be there.
    const wide = drawing.measureText(text).width + 6;
    drawing.fillStyle = pageColour("--panel");
    drawing.fillRect(x - wide / 2, y - 18 - HEIGHT / 2, wide, HEIGHT);
    drawing.fillStyle = pageColour("--bad");
    drawing.fillText(text, x, y - 18);
  });
}

/** @param {CanvasRenderingContext2D} drawing @param {number[]} points x and y in turn */
function drawLine(drawing, points) {
  drawing.beginPath();
  for (let i = 0; i < points.length; i += 2) drawing.lineTo(points[i], points[i + 1]);
  drawing.stroke();
}

/** @param {CanvasRenderingContext2D} drawing @param {import("./stage.js").Stage} stage @param {number} height */
function drawAxes(drawing, stage, height) {
  const [x, y] = [AXIS + 18, height - AXIS - 18];
  drawing.textAlign = "center";
  drawing.lineWidth = 2;
  const colours = ["--bad", "--good", "--accent"];
  ["x", "y", "z"].forEach((name, axis) => {
    const own = new THREE.Vector3().setComponent(axis, 1).transformDirection(stage.camera.matrixWorldInverse);
    drawing.strokeStyle = drawing.fillStyle = pageColour(colours[axis]);
    drawLine(drawing, [x, y, x + AXIS * own.x, y - AXIS * own.y]);
    drawing.fillText(name, x + (AXIS + 9) * own.x, y - (AXIS + 9) * own.y);
  });
}

/**
 * A bar of round length: true in the plane through the point that the camera looks at.
 * @param {CanvasRenderingContext2D} drawing
 * @param {import("./stage.js").Stage} stage
 * @param {number} width
 * @param {number} height
 */
function drawScale(drawing, stage, width, height) {
  const distance = stage.camera.position.distanceTo(stage.controls.target);
  const millimetre = height / (2000 * distance * Math.tan((Math.PI * stage.camera.fov) / 360));
  const longest = (LONGEST * width) / millimetre;
  const power = 10 ** Math.floor(Math.log10(longest));
  const length = power * ([5, 2].find((step) => step * power <= longest) ?? 1);
  const [right, y] = [width - 14, height - 14];
  const left = right - length * millimetre;
  drawing.strokeStyle = drawing.fillStyle = pageColour("--ink");
  drawLine(drawing, [left, y - 4, left, y, right, y, right, y - 4]);
  drawing.fillText(`${Number(length.toPrecision(1))} mm`, (left + right) / 2, y - 11);
}

/** @param {CanvasRenderingContext2D} drawing @param {import("./stage.js").Stage} stage @param {number} width @param {number} height */
function drawNames(drawing, stage, width, height) {
  const shown = stage.actors.filter(({ data }) => data.owner === data.name && !stage.hidden.has(data.name));
  const anchors = shown.map(({ data }) => {
    const at = new THREE.Vector3(...data.reference).project(stage.camera);
    return { text: data.label, x: ((at.x + 1) / 2) * width, y: ((1 - at.y) / 2) * height };
  });
  /** @type {Tag[]} */
  const placed = [];
  drawing.textAlign = "left";
  drawing.lineWidth = 1;
  drawing.strokeStyle = pageColour("--soft");
  for (const { text, x, y } of anchors.sort((a, b) => a.y - b.y)) {
    if (!(x > 0 && x < width && y > 0 && y < height)) continue;
    const name = shortened(drawing, text, 0.45 * width);
    const wanted = { name, x: x + 18, y: y - HEIGHT / 2, width: drawing.measureText(name).width + 10 };
    const tag = freePlace(wanted, placed, width, height);
    placed.push(tag);
    drawLine(drawing, [x, y, Math.max(tag.x, Math.min(x, tag.x + tag.width)), tag.y + HEIGHT / 2]);
  }
  // Tags are drawn last, so that no line crosses a name.
  for (const tag of placed) {
    drawing.fillStyle = pageColour("--panel");
    drawing.fillRect(tag.x, tag.y, tag.width, HEIGHT);
    drawing.strokeRect(tag.x, tag.y, tag.width, HEIGHT);
    drawing.fillStyle = pageColour("--ink");
    drawing.fillText(tag.name, tag.x + 5, tag.y + HEIGHT / 2 + 1);
  }
}

/** @param {CanvasRenderingContext2D} drawing @param {string} text @param {number} most */
function shortened(drawing, text, most) {
  const letters = [...text].slice(0, MOST_LETTERS);
  let count = letters.length;
  const cut = () => (letters.slice(0, count).join("") === text ? text : `${letters.slice(0, count).join("")}…`);
  while (count > 4 && drawing.measureText(cut()).width > most) count--;
  return cut();
}

/**
 * The free place next to the wanted one: other tags, axes and scale stay readable.
 * @param {Tag} wanted
 * @param {Tag[]} placed
 * @param {number} width
 * @param {number} height
 * @returns {Tag}
 */
function freePlace(wanted, placed, width, height) {
  const x = Math.max(EDGE, Math.min(wanted.x, width - wanted.width - EDGE));
  for (let step = 0; step < 2 * Math.ceil(height / SHIFT); step++) {
    const away = Math.ceil(step / 2) * SHIFT * (step % 2 ? 1 : -1);
    const tag = { ...wanted, x, y: wanted.y + away };
    const inside = tag.y >= EDGE && tag.y + HEIGHT < height - 40;
    const apart = placed.every(
      (other) => Math.abs(other.y - tag.y) >= HEIGHT + 2 || other.x > tag.x + tag.width || tag.x > other.x + other.width,
    );
    if (inside && apart) return tag;
  }
  return { ...wanted, x };
}
