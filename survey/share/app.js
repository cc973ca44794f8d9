// The page: view, pointer, keyboard and touch, axes, link, and pictures. `model.js` and `engine.js` stand before it.

const $ = id => document.getElementById(id)
const TEXT = JSON.parse($("data").textContent)
const MARGIN = {left: 92, right: 30, top: 10, bottom: 62}, BLOCKS = 256, COARSE = 5, REST = 120, SHOWN = 60, PAUSE = 3, ANNOTATED = 25, EDGED = ["verdict", "discriminant", "exponent"]
const state = {view: null, show: TEXT.shown[0].name, pointer: null, lines: true}
// A picture of another view serves a moving one while it is not larger than this.
const MAGNIFIED = 3
// A picture of more pixels than this is scaled in motion by a copy with every `FEWER`th of them.
const LARGE = 4_000_000, FEWER = 3
let model = null, workers = [], generation = 0, coarse = null, front = null, frame = 0, resting = 0, annotated = 0
const queue = []

// ---- data

async function inflated(text) {
  const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0))
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"))).arrayBuffer()
}

async function arrayOf({type, data}) {
  const buffer = await inflated(data)
  return new {f8: Float64Array, f4: Float32Array, i1: Int8Array, i4: Int32Array}[type](buffer)
}

async function loadedModel() {
  if (TEXT.model) {
    const own = await readModel(Uint8Array.from(atob(TEXT.model), c => c.charCodeAt(0)))
    return Object.assign(own, {rule: own.about.rule, functions: own.about.functions.map(f => f.name)})
  }
  const axes = await Promise.all(TEXT.grid.axes.map(arrayOf)), places = axes.map((values, i) => TEXT.axes[i].log ? values.map(Math.log) : values)
  const grid = {...TEXT.grid, axes, places, status: await arrayOf(TEXT.grid.status), variables: {}}
  for (const [name, own] of Object.entries(TEXT.grid.variables)) {
    grid.variables[name] = {flags: own.flags, values: await arrayOf(own.values), bars: own.bars ? await arrayOf(own.bars) : null}
  }
  return {grid}
}

// ---- the view: the ends of both axes, in the parameters, or in their logarithms

const home = () => ({x: [...TEXT.axes[0].ends], y: [...TEXT.axes[1].ends]})
const figure = $("figure"), plot = {}
// Two pictures of the map, of which one is shown, and a coarse one below. While the view moves, the browser's compositor
// moves and scales them: no script touches their pixels. The axes are drawn in strips beside them.
const papers = [$("one"), $("two")].map(canvas => ({canvas, context: canvas.getContext("2d", {alpha: false})}))
const under = {canvas: $("under"), context: $("under").getContext("2d", {alpha: false})}
// And a smaller copy of a large picture, shown while it is scaled: the compositor has no time for all of its pixels.
const copy = {canvas: $("copied"), context: $("copied").getContext("2d", {alpha: false}), of: null}
const strips = [$("left"), $("below")].map(canvas => ({canvas, context: canvas.getContext("2d", {alpha: false})}))

function sized(canvas, left, top, width, height) {
  // In pixels of the screen.
  const {ratio} = plot
  canvas.width = width; canvas.height = height
  Object.assign(canvas.style, {left: left / ratio + "px", top: top / ratio + "px", width: width / ratio + "px", height: height / ratio + "px"})
}

function resize() {
  // `box`: the plot in pixels of the screen; left, top, width and height: in those of CSS.
  const ratio = window.devicePixelRatio || 1, area = figure.getBoundingClientRect()
  const all = [Math.max(150, Math.round(area.width * ratio)), Math.max(120, Math.round(area.height * ratio))]
  const left = Math.round(MARGIN.left * ratio), top = Math.round(MARGIN.top * ratio)
  const box = {left, top, width: all[0] - left - Math.round(MARGIN.right * ratio), height: all[1] - top - Math.round(MARGIN.bottom * ratio)}
  Object.assign(plot, {all, ratio, box, left: left / ratio, top: top / ratio, width: box.width / ratio, height: box.height / ratio})
  Object.assign($("plot").style, {left: plot.left + "px", top: plot.top + "px", width: plot.width + "px", height: plot.height + "px"})
  for (const {canvas} of papers) sized(canvas, 0, 0, box.width, box.height)
  sized(copy.canvas, 0, 0, Math.ceil(box.width / FEWER), Math.ceil(box.height / FEWER))
  sized(under.canvas, 0, 0, Math.ceil(box.width / COARSE), Math.ceil(box.height / COARSE))
  sized(strips[0].canvas, 0, 0, left, top + box.height)
  sized(strips[1].canvas, 0, top + box.height, all[0], all[1] - top - box.height)
  front = coarse = null
  changed()
}

function setView(x, y) {
  // Within the map's rectangle, and not smaller than float64 can resolve.
  const limit = ([a, b], ends) => {
    const all = ends[1] - ends[0], least = Math.max(all * 2 ** -46, 2 ** -44 * Math.max(Math.abs(a), Math.abs(b)))
    let size = Math.min(all, b - a), middle = 0.5 * (a + b)
    if (!(size > least)) size = least
    const low = Math.min(Math.max(middle - size / 2, ends[0]), ends[1] - size)
    return [low, size === all ? ends[1] : low + size]
  }
  state.view = {x: limit(x, TEXT.axes[0].ends), y: limit(y, TEXT.axes[1].ends)}
  changed()
}

function zoom(factor, px = plot.width / 2, py = plot.height / 2) {
  const {x, y} = state.view, ax = x[0] + (x[1] - x[0]) * px / plot.width, ay = y[1] - (y[1] - y[0]) * py / plot.height
  setView(x.map(end => ax + (end - ax) / factor), y.map(end => ay + (end - ay) / factor))
}

function pan(dx, dy) {
  const {x, y} = state.view, mx = -dx * (x[1] - x[0]) / plot.width, my = dy * (y[1] - y[0]) / plot.height
  setView(x.map(end => end + mx), y.map(end => end + my))
}

const toPlot = ([x, y]) => [(x - state.view.x[0]) / (state.view.x[1] - state.view.x[0]) * plot.width, (state.view.y[1] - y) / (state.view.y[1] - state.view.y[0]) * plot.height]
const toMap = (px, py) => [state.view.x[0] + (state.view.x[1] - state.view.x[0]) * px / plot.width, state.view.y[1] - (state.view.y[1] - state.view.y[0]) * py / plot.height]
const real = (value, axis) => TEXT.axes[axis].log ? Math.exp(value) : value

// ---- drawing: what is known of the view at once, then the whole view coarsely, then sharply, block by block

function changed() {
  if (!model || !state.view) return
  generation++
  for (const {dropped} of queue.splice(0)) dropped?.()
  if (!enough()) coarsely()
  clearTimeout(resting)
  resting = setTimeout(sharply, REST)
  frame ||= requestAnimationFrame(redraw)
}

function placed(own) {
  // Where a picture of another view lies in this one, in pixels of the plot.
  const {ratio} = plot, [left, top] = toPlot([own.view.x[0], own.view.y[1]]), [right, bottom] = toPlot([own.view.x[1], own.view.y[0]])
  return [left * ratio, top * ratio, (right - left) * ratio, (bottom - top) * ratio]
}

function covers([left, top, width, height]) {
  const {box} = plot
  return left <= 0.5 && top <= 0.5 && left + width >= box.width - 0.5 && top + height >= box.height - 0.5
}

const magnified = own => placed(own)[2] / plot.box.width
const enough = () => Boolean(front && covers(placed(front)) && magnified(front) < MAGNIFIED)

function jobFor(left, top, width, height, step) {
  // Pixels of the plot from (left, top) on, `step` apart.
  const shown = TEXT.shown.find(own => own.name === state.show), {x, y} = state.view
  const dx = (x[1] - x[0]) / plot.box.width, dy = (y[1] - y[0]) / plot.box.height
  return {x: [x[0] + (left + step / 2) * dx, step * dx], y: [y[1] - (top + step / 2) * dy, -step * dy], width, height,
    show: state.show, colours: shown.colours ?? {}, table: shown.table, range: shown.range,
    lines: state.lines && EDGED.includes(shown.name) && !TEXT.curves.length, thick: 1.3 * plot.ratio, phase: [left, top]}
}

function coarsely() {
  // One at a time, and again when it has come, after a pause that leaves the processor to the motion.
  if (coarse?.waiting) return
  const width = Math.ceil(plot.box.width / COARSE), height = Math.ceil(plot.box.height / COARSE), own = generation
  const {x, y} = state.view, dx = (x[1] - x[0]) / plot.box.width, dy = (y[1] - y[0]) / plot.box.height
  const view = {x: [x[0], x[0] + width * COARSE * dx], y: [y[1] - height * COARSE * dy, y[1]]}
  const asked = performance.now()
  coarse = {...coarse, waiting: true}
  ask({...jobFor(0, 0, width, height, COARSE), lines: false}, pixels => {
    under.context.putImageData(new ImageData(pixels, width, height), 0, 0)
    const shown = coarse = {view, canvas: under.canvas, waiting: own !== generation}
    if (shown.waiting) setTimeout(() => {
      shown.waiting = false
      if (coarse === shown && !enough()) coarsely()
    }, PAUSE * (performance.now() - asked))
    frame ||= requestAnimationFrame(redraw)
  }, () => { coarse.waiting = false })
}

function sharply() {
  // On the paper that is not shown, over what is known of the view; the blocks that have come are shown together.
  const own = generation, blocks = [], {box} = plot, paper = papers.find(one => one.canvas !== front?.canvas), arrived = []
  paint(paper.context)
  front = {view: state.view, canvas: paper.canvas, left: 0}
  for (let top = 0; top < box.height; top += BLOCKS) for (let left = 0; left < box.width; left += BLOCKS) {
    blocks.push([left, top, Math.min(BLOCKS, box.width - left), Math.min(BLOCKS, box.height - top)])
  }
  const far = ([left, top]) => Math.hypot(left + BLOCKS / 2 - box.width / 2, top + BLOCKS / 2 - box.height / 2)
  const show = () => {
    if (own !== generation || !arrived.length) return
    paper.context.save()
    paper.context.beginPath()
    for (const {pixels, block: [left, top, width, height]} of arrived) {
      paper.context.putImageData(new ImageData(pixels, width, height), left, top)
      paper.context.rect(left, top, width, height)
    }
    front.left -= arrived.length
    arrived.length = 0
    paper.context.clip()
    curves(brush(paper.context, [-box.left, -box.top]))
    paper.context.restore()
  }
  front.left = blocks.length
  for (const block of blocks.sort((a, b) => far(a) - far(b))) {
    ask(jobFor(...block, 1), pixels => {
      if (own !== generation) return
      if (!arrived.length) setTimeout(show, SHOWN)
      arrived.push({pixels, block})
      if (front.left === arrived.length) show()
    })
  }
  keepLink()
  frame ||= requestAnimationFrame(redraw)
}

const idle = () => Boolean(front && front.view === state.view && front.left === 0 && !coarse?.waiting && !frame && !queue.length)

function shownOf() {
  // Which pictures show the view: [the coarse one?, the other one?].
  const sharp = front && placed(front), rough = coarse?.canvas && placed(coarse), whole = sharp && covers(sharp)
  if (rough && whole && magnified(front) > COARSE && magnified(coarse) < magnified(front) / COARSE) return [true, false]
  return [Boolean(rough) && !whole, Boolean(sharp)]
}

function paint(context) {
  const {box} = plot, shown = shownOf()
  context.setTransform(1, 0, 0, 1, 0, 0)
  context.fillStyle = "#fff"
  context.fillRect(0, 0, box.width, box.height)
  context.imageSmoothingEnabled = false
  for (const [i, own] of [coarse, front].entries()) if (shown[i]) context.drawImage(own.canvas, ...placed(own))
}

function copied() {
  // Is the picture scaled, and too large for that? Then its copy stands for it.
  const [, , width, height] = placed(front), {canvas, context} = copy
  const still = Math.abs(width - front.canvas.width) < 0.01 && Math.abs(height - front.canvas.height) < 0.01
  if (still || front.canvas.width * front.canvas.height <= LARGE) copy.of = null
  else if (copy.of !== front) {
    context.imageSmoothingQuality = "medium"  // thin lines stay whole
    context.drawImage(front.canvas, 0, 0, canvas.width, canvas.height)
    copy.of = front
  }
}

function redraw() {
  frame = 0
  const begun = performance.now(), {ratio} = plot, shown = shownOf()
  if (shown[1]) copied()
  const sharp = shown[1] && copy.of === front ? copy.canvas : front?.canvas
  for (const {canvas} of [under, copy, ...papers]) {
    const own = shown[0] && coarse.canvas === canvas ? coarse : shown[1] && sharp === canvas ? front : null
    canvas.style.visibility = own ? "visible" : "hidden"
    if (!own) continue
    const [left, top, width, height] = placed(own), still = Math.abs(width - canvas.width) < 0.01 && Math.abs(height - canvas.height) < 0.01
    // by whole pixels, without scaling, where it is only moved: a third of the compositor's work
    canvas.style.transform = still ? `translate(${Math.round(left) / ratio}px,${Math.round(top) / ratio}px)` :
      `matrix(${width / canvas.width},0,0,${height / canvas.height},${left / ratio},${top / ratio})`
  }
  // The axes in every second frame: with them the browser draws the whole page again.
  if (begun - annotated < ANNOTATED) frame = requestAnimationFrame(redraw)
  else {
    annotated = begun
    for (const {canvas, context} of strips) {
      context.setTransform(1, 0, 0, 1, 0, 0)
      context.fillStyle = "#fff"
      context.fillRect(0, 0, canvas.width, canvas.height)
      annotate(brush(context, canvas.id === "below" ? [0, -plot.box.top - plot.box.height] : [0, 0]))
    }
  }
  $("cross").style.visibility = state.pointer?.keyboard ? "visible" : "hidden"
  tell()
  window.drawn = {milliseconds: performance.now() - begun, number: (window.drawn?.number ?? 0) + 1}
}

// ---- workers

function ask(job, done, dropped) {
  queue.push({job, done, generation, dropped})
  feed()
}

function feed() {
  for (const worker of workers) {
    if (worker.busy || !queue.length) continue
    const next = queue.shift()
    worker.busy = next
    if (worker.postMessage) worker.postMessage(next.job)
    else setTimeout(() => worker.done(draw(model, next.job)))
  }
}

function hire() {
  const source = $("engine").textContent + `
    let model
    onmessage = ({data}) => {
      if (data.model) model = Object.setPrototypeOf(data.model, Model.prototype)
      else { const pixels = draw(model, data); postMessage(pixels, [pixels.buffer]) }
    }`
  const number = Math.max(1, Math.min(8, (navigator.hardwareConcurrency || 2) - 1))
  const finished = worker => pixels => {
    const {done} = worker.busy
    worker.busy = null
    done(pixels)
    feed()
  }
  try {
    const address = URL.createObjectURL(new Blob([source], {type: "text/javascript"}))
    workers = Array.from({length: number}, () => {
      const worker = new Worker(address)
      worker.postMessage({model: {...model}})
      worker.onmessage = ({data}) => finished(worker)(data)
      return worker
    })
  } catch {  // a browser without them: in the page itself
    const worker = {}
    worker.done = finished(worker)
    workers = [worker]
  }
}

// ---- axes, on the screen and in SVG

function brush(context, [left, top]) {
  // Draws in pixels of CSS from the figure's corner on; (left, top): that corner in the context's own pixels.
  context.setTransform(plot.ratio, 0, 0, plot.ratio, left, top)
  return {
    line(points, colour, width, dash = []) {
      context.strokeStyle = colour; context.lineWidth = width; context.setLineDash(dash)
      context.beginPath()
      points.forEach(([x, y], i) => i ? context.lineTo(x, y) : context.moveTo(x, y))
      context.stroke()
    },
    text(x, y, text, anchor, baseline = "middle") {
      context.fillStyle = "#111"; context.font = "13px system-ui, sans-serif"; context.textAlign = anchor === "middle" ? "center" : anchor
      context.textBaseline = baseline
      context.fillText(text, x, y)
    },
    label({path, width}, x, y, turn) {
      context.save()
      context.translate(x, y); context.rotate(turn); context.scale(1, -1); context.translate(-width / 2, 0)
      context.fillStyle = "#111"
      context.fill(new Path2D(path))
      context.restore()
    },
  }
}

function svgBrush(parts) {
  const safe = text => text.replace(/[&<>"]/g, c => `&#${c.charCodeAt(0)};`), n = value => +value.toFixed(2)
  return {
    line: (points, colour, width, dash = []) => parts.push(`<polyline fill="none" stroke="${colour}" stroke-width="${width}" stroke-dasharray="${dash.join(" ")}" points="${points.map(([x, y]) => `${n(x)},${n(y)}`).join(" ")}"/>`),
    text: (x, y, text, anchor, baseline) => parts.push(`<text x="${n(x)}" y="${n(y)}" text-anchor="${anchor}" dominant-baseline="${baseline === "top" ? "hanging" : "central"}">${safe(text)}</text>`),
    label: ({path, width}, x, y, turn) => parts.push(`<path transform="translate(${n(x)} ${n(y)}) rotate(${turn * 180 / Math.PI}) scale(1 -1) translate(${-width / 2} 0)" d="${safe(path)}"/>`),
  }
}

function ticksOf([low, high], axis, pixels) {
  // {at, text} of round numbers; where the digits that they share are many, these stand apart in `offset`.
  if (TEXT.axes[axis].log && high - low > 1.5) {
    const out = []
    for (let power = Math.ceil(low / Math.LN10); power <= high / Math.LN10; power++) out.push({at: power * Math.LN10, text: `1e${power}`})
    return {ticks: out, offset: ""}
  }
  const [a, b] = [real(low, axis), real(high, axis)], rough = (b - a) / Math.max(2, pixels / 90), size = 10 ** Math.floor(Math.log10(rough))
  const step = size * ([1, 2, 5, 10].find(m => m * size >= rough) ?? 10), digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9))
  const first = Math.ceil(a / step - 1e-9), numbers = Array.from({length: Math.max(0, Math.floor(b / step + 1e-9) - first + 1)}, (_, i) => first + i)
  const at = value => TEXT.axes[axis].log ? Math.log(value) : value
  if (digits <= 7 && Math.max(Math.abs(a), Math.abs(b)) < 1e7) return {ticks: numbers.map(i => ({at: at(i * step), text: (i * step).toFixed(digits)})), offset: ""}
  const middle = numbers[Math.floor(numbers.length / 2)] ?? first
  return {ticks: numbers.map(i => ({at: at(i * step), text: i === middle ? "0" : ((i - middle) * step).toPrecision(2).replace(/\.?0+e/, "e")})), offset: (middle * step).toPrecision(16).replace(/0+$/, "")}
}

function annotate(b) {
  const {left, top, width, height} = plot, {x, y} = state.view
  b.line([[left, top], [left + width, top], [left + width, top + height], [left, top + height], [left, top]], "#111", 1)
  const across = ticksOf(x, 0, width), along = ticksOf(y, 1, height * 1.6)
  for (const {at, text} of across.ticks) {
    const px = left + (at - x[0]) / (x[1] - x[0]) * width
    b.line([[px, top + height], [px, top + height + 5]], "#111", 1)
    b.text(px, top + height + 8, text, "middle", "top")
  }
  for (const {at, text} of along.ticks) {
    const py = top + (y[1] - at) / (y[1] - y[0]) * height
    b.line([[left - 5, py], [left, py]], "#111", 1)
    b.text(left - 8, py, text, "end")
  }
  if (across.offset) b.text(left + width, top + height + 36, `+ ${across.offset}`, "end")
  if (along.offset) b.text(4, top + height + 36, `+ ${along.offset}`, "start")
  b.label(TEXT.axes[0].label, left + width / 2, top + height + 46, 0)
  b.label(TEXT.axes[1].label, 20, top + height / 2, -Math.PI / 2)
}

function curves(b) {
  if (!state.lines) return
  const {x, y} = state.view, {left, top} = plot
  for (const curve of TEXT.curves) {
    let run = []
    const flush = () => { if (run.length > 1) b.line(run, curve.colour, curve.width, curve.dash); run = [] }
    for (let i = 0; i < curve.x.length; i++) {
      const near = (j) => j >= 0 && j < curve.x.length && curve.x[j] >= x[0] && curve.x[j] <= x[1] && curve.y[j] >= y[0] && curve.y[j] <= y[1]
      if (!near(i) && !near(i - 1) && !near(i + 1) && !crosses(curve, i, x, y)) { flush(); continue }
      const [px, py] = toPlot([curve.x[i], curve.y[i]])
      run.push([left + px, top + py])
    }
    flush()
  }
}

function crosses({x: xs, y: ys}, i, x, y) {
  // May the piece before or after point i cross the view, though its ends lie outside?
  return [i, i + 1].some(j => j > 0 && j < xs.length && Math.min(xs[j - 1], xs[j]) <= x[1] && Math.max(xs[j - 1], xs[j]) >= x[0] &&
    Math.min(ys[j - 1], ys[j]) <= y[1] && Math.max(ys[j - 1], ys[j]) >= y[0])
}

// ---- what is known under the pointer

const few = value => Math.abs(value) >= 1e6 || (value !== 0 && Math.abs(value) < 1e-4) ? value.toExponential(12) : value.toPrecision(13)
const bound = value => Number.isFinite(value) ? value.toExponential(1) : "?"

function known(x, y) {
  // {x, y, verdict, status, values: {name: [value, bar]}} at a point of the map, or at the nearest point of its grid.
  if (model.grid) {
    const {axes, places, variables, status, statuses} = model.grid
    const [i, j] = [x, y].map((value, axis) => nearest(places[axis], TEXT.axes[axis].log ? Math.log(value) : value))
    if (i < 0 || j < 0) return null
    const at = i * axes[1].length + j, values = {}
    let verdict = null
    for (const [name, own] of Object.entries(variables)) {
      if (own.flags) { const word = own.flags[own.values[at]] ?? "?"; if (name === "verdict") verdict = word; values[name] = [word] }
      else values[name] = [own.values[at], own.bars ? own.bars[at] : NaN]
    }
    return {x: axes[0][i], y: axes[1][j], verdict, status: statuses[status[at]], values}
  }
  const found = model.at(x, y)
  if (!found) return {x, y, verdict: null, status: "no series here: no answer", values: {}}
  const {verdict, ...values} = found, proved = provedAt(x, y)
  return {x, y, verdict: {"-1": "undecided", 0: "unstable", 1: "stable"}[verdict], status: null, values, proved}
}

let cells = null
function provedAt(x, y) {
  // "stable" or "unstable" where the cell around the point is proved.
  if (!TEXT.proof) return null
  cells ??= model.about.proof.cells.split(";").map(row => row.split(" ")).filter(cell => cell[4] !== "o")
  const [u, v] = [x, y].map((value, i) => (value - TEXT.axes[i].ends[0]) / (TEXT.axes[i].ends[1] - TEXT.axes[i].ends[0]) * model.about.proof.parts[i])
  const cell = cells.find(([a, b, c, d]) => u >= a && u <= b && v >= c && v <= d)
  return cell ? {s: "stable", u: "unstable"}[cell[4]] ?? null : null
}

function say(text) {
  if ($("readout").textContent !== text) $("readout").textContent = text
}

function tell() {
  const at = state.pointer
  if (!at) { say(TEXT.hint); return }
  const [x, y] = toMap(at.keyboard ? plot.width / 2 : at.px, at.keyboard ? plot.height / 2 : at.py), found = known(real(x, 0), real(y, 1))
  if (!found) { say("outside the map"); return }
  const lines = [`${TEXT.axes[0].name} = ${few(found.x)}, ${TEXT.axes[1].name} = ${few(found.y)}`]
  if (found.verdict) lines.push(`${found.verdict.replaceAll("_", " ")}${found.proved === found.verdict ? ", proved" : ""}`)
  if (found.status && found.status !== "ok") lines.push(found.status.replaceAll("_", " "))
  for (const [name, [value, bar]] of Object.entries(found.values)) {
    if (name === "verdict") continue
    if (typeof value === "string") lines.push(`${name}: ${value.replaceAll("_", " ")}`)
    else if (Number.isFinite(value)) lines.push(Number.isFinite(bar) ? `${name} = ${few(value)} ± ${bound(bar)}` : `${name} = ${Number.isInteger(value) ? value : few(value)}`)
  }
  say(lines.join("\n"))
}

// ---- link

function keepLink() {
  const {x, y} = state.view, text = `#x=${x.join(",")}&y=${y.join(",")}&show=${encodeURIComponent(state.show)}${state.lines ? "" : "&lines=0"}`
  if (location.hash !== text) {
    try { history.replaceState(null, "", text) } catch { /* too many a second: the next one */ }
  }
}

function fromLink() {
  const given = new URLSearchParams(location.hash.slice(1)), own = home()
  for (const axis of ["x", "y"]) {
    const ends = (given.get(axis) ?? "").split(",").map(Number)
    if (ends.length === 2 && ends.every(Number.isFinite) && ends[0] < ends[1]) own[axis] = ends
  }
  if (TEXT.shown.some(one => one.name === given.get("show"))) state.show = given.get("show")
  state.lines = given.get("lines") !== "0"
  $("show").value = state.show
  legend()
  setView(own.x, own.y)
}

// ---- pictures

function save(name, blob) {
  const link = document.createElement("a")
  link.href = URL.createObjectURL(blob)
  link.download = `${TEXT.file}.${name}`
  link.click()
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000)
}

function picture() {
  // The figure as it is shown, in one canvas.
  const out = document.createElement("canvas"), context = out.getContext("2d", {alpha: false}), {all, box} = plot
  out.width = all[0]; out.height = all[1]
  context.fillStyle = "#fff"
  context.fillRect(0, 0, ...all)
  context.drawImage(flat(), box.left, box.top)
  annotate(brush(context, [0, 0]))
  return out
}

function flat() {
  // The map alone.
  const out = document.createElement("canvas")
  out.width = plot.box.width; out.height = plot.box.height
  paint(out.getContext("2d", {alpha: false}))
  return out
}

function svg() {
  const {left, top, width, height, all, ratio} = plot, parts = []
  annotate(svgBrush(parts))
  parts.push(`<g clip-path="url(#plot)">`)
  curves(svgBrush(parts))
  parts.push("</g>")
  return `<svg xmlns="http://www.w3.org/2000/svg" width="${all[0] / ratio}" height="${all[1] / ratio}" font-family="sans-serif" font-size="13">` +
    `<clipPath id="plot"><rect x="${left}" y="${top}" width="${width}" height="${height}"/></clipPath><rect width="100%" height="100%" fill="#fff"/>` +
    `<image x="${left}" y="${top}" width="${width}" height="${height}" href="${flat().toDataURL("image/png")}"/>${parts.join("")}</svg>`
}

// ---- legend and controls

function legend() {
  const box = $("legend"), shown = TEXT.shown.find(own => own.name === state.show), entry = (style, text) => {
    const item = document.createElement("span"), swatch = document.createElement("i")
    Object.assign(swatch.style, style)
    item.append(swatch, text)
    box.append(item)
  }
  const rgb = colour => `rgb(${colour.join(",")})`
  box.replaceChildren()
  if (shown.kinds) for (const {text, colour} of shown.kinds) entry({background: rgb(colour)}, text)
  else {
    const stops = Array.from({length: 17}, (_, i) => rgb(shown.table.slice(3 * Math.min(255, 16 * i), 3 * Math.min(255, 16 * i) + 3)))
    entry({background: `linear-gradient(90deg, ${stops.join(",")})`, width: "160px"}, `${shown.range[0].toPrecision(3)} to ${shown.range[1].toPrecision(3)}`)
  }
  for (const [code, grey] of Object.entries(TEXT.grid?.greys ?? {})) entry({background: rgb(grey)}, TEXT.grid.statuses[code].replaceAll("_", " "))
  entry({background: "repeating-linear-gradient(45deg,#777 0 1px,#fff 1px 4px)"}, TEXT.hatched)
  for (const {text, colour, dash} of state.lines && (EDGED.includes(shown.name) || TEXT.curves.length) ? TEXT.edges : []) {
    const pale = /^(#fff(fff)?|white|w)$/i.test(colour)
    entry({background: pale ? "#777" : "none", border: "0", borderTop: `2px ${dash ? "dashed" : "solid"} ${colour}`, height: pale ? "6px" : "0", width: "22px", verticalAlign: "4px"}, text)
  }
}

function controls() {
  for (const {name, text} of TEXT.shown) $("show").append(new Option(text, name))
  $("show").onchange = () => { state.show = $("show").value; front = coarse = null; legend(); changed() }
  $("home").onclick = () => setView(home().x, home().y)
  $("nearer").onclick = () => zoom(2)
  $("farther").onclick = () => zoom(0.5)
  $("lines").onclick = () => { state.lines = !state.lines; front = null; legend(); changed() }
  $("png").onclick = () => picture().toBlob(blob => save("png", blob))
  $("svg").onclick = () => save("svg", new Blob([svg()], {type: "image/svg+xml"}))
  $("copy").onclick = () => navigator.clipboard?.writeText(location.href)
  const fingers = new Map(), place = event => {
    const box = figure.getBoundingClientRect()
    return [event.clientX - box.left - plot.left, event.clientY - box.top - plot.top]
  }
  figure.addEventListener("wheel", event => { event.preventDefault(); zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), ...place(event)) }, {passive: false})
  figure.addEventListener("dblclick", event => zoom(event.shiftKey ? 0.25 : 4, ...place(event)))
  figure.addEventListener("pointerdown", event => {
    const now = place(event)
    figure.setPointerCapture(event.pointerId)
    fingers.set(event.pointerId, now)
    state.pointer = {px: now[0], py: now[1]}
    frame ||= requestAnimationFrame(redraw)
  })
  const lift = event => fingers.delete(event.pointerId)
  figure.addEventListener("pointerup", lift)
  figure.addEventListener("pointercancel", lift)
  figure.addEventListener("pointerleave", event => { if (event.pointerType === "mouse") { state.pointer = null; frame ||= requestAnimationFrame(redraw) } })
  figure.addEventListener("pointermove", event => {
    const now = place(event), before = fingers.get(event.pointerId)
    state.pointer = {px: now[0], py: now[1]}
    if (before) {
      const others = [...fingers].filter(([id]) => id !== event.pointerId).map(([, at]) => at)
      if (others.length) {
        const [other] = others, size = at => Math.hypot(at[0] - other[0], at[1] - other[1])
        zoom(Math.max(0.2, size(now)) / Math.max(0.2, size(before)), ...other)
      } else pan(now[0] - before[0], now[1] - before[1])
      fingers.set(event.pointerId, now)
    }
    frame ||= requestAnimationFrame(redraw)
  })
  figure.addEventListener("keydown", event => {
    const step = event.shiftKey ? 200 : 40, moves = {ArrowLeft: [step, 0], ArrowRight: [-step, 0], ArrowUp: [0, step], ArrowDown: [0, -step]}
    if (moves[event.key]) pan(...moves[event.key])
    else if (event.key === "+" || event.key === "=") zoom(1.5)
    else if (event.key === "-") zoom(1 / 1.5)
    else if (event.key === "0" || event.key === "Home") setView(home().x, home().y)
    else return
    state.pointer = {keyboard: true}
    event.preventDefault()
  })
  addEventListener("resize", resize)
  addEventListener("hashchange", fromLink)
}

async function start() {
  model = await loadedModel()
  for (const curve of TEXT.curves) {
    const [x, y] = await Promise.all([arrayOf(curve.x), arrayOf(curve.y)])
    Object.assign(curve, {x: TEXT.axes[0].log ? x.map(Math.log) : x, y: TEXT.axes[1].log ? y.map(Math.log) : y})
  }
  hire()
  controls()
  state.view = home()
  resize()
  fromLink()
}

start().catch(error => { $("readout").textContent = `this page cannot be shown: ${error.message}` })
