// Draws a rectangle of the map: colours of pixels from the model's series, or of a grid from its points. No pixel is
// taken from another scale. Runs in the page and in its workers; `model.js` stands before it.

const BLOCK = 32  // pixels across a block, on which series are shortened once more
const FACTORS = [[1, 0], [0, 0], [0, 1], [1, 1]]  // of y1, y1', y2, y2' at T/2: dashed (antiperiodic)?, grey (odd)?

// ---- series on a part of a panel

function polynomials(n, x) {
  const out = new Float64Array(n * x.length)
  for (let i = 0; i < x.length; i++) {
    let before = 1, last = x[i]
    for (let k = 0; k < n; k++) {
      out[k * x.length + i] = before;
      [before, last] = [last, 2 * x[i] * last - before]
    }
  }
  return out
}

const restrictions = new Map()
function nodesOf(q) {
  if (!restrictions.has(q)) {
    const x = Float64Array.from({length: q}, (_, i) => Math.cos(Math.PI * (i + 0.5) / q)), matrix = new Float64Array(q * q)
    for (let k = 0; k < q; k++) for (let i = 0; i < q; i++) matrix[k * q + i] = (k ? 2 : 1) / q * Math.cos(k * Math.PI * (i + 0.5) / q)
    restrictions.set(q, {x, matrix})
  }
  return restrictions.get(q)
}

function restriction(n, low, high) {
  // The matrix (n, n) from the series on [-1, 1] to that on [low, high].
  const {x, matrix} = nodesOf(n), values = polynomials(n, x.map(t => 0.5 * (low + high) + 0.5 * (high - low) * t))
  const out = new Float64Array(n * n)
  for (let p = 0; p < n; p++) for (let k = p; k < n; k++) {
    let sum = 0
    for (let i = 0; i < n; i++) sum += matrix[p * n + i] * values[k * n + i]
    out[p * n + k] = sum
  }
  return out
}

function restricted({n, m, c, off = 0}, across, along) {
  // The series on the part of its square between `across` in x and `along` in y, each given by its matrix for (n, m).
  const left = across(n), right = along(m)
  const half = new Float64Array(n * m), out = new Float64Array(n * m)
  for (let p = 0; p < n; p++) for (let k = p; k < n; k++) {
    const weight = left[p * n + k]
    for (let j = 0; j < m; j++) half[p * m + j] += weight * c[k * m + j]
  }
  for (let p = 0; p < n; p++) for (let q = 0; q < m; q++) {
    let sum = 0
    for (let k = q; k < m; k++) sum += right[q * m + k] * half[p * m + k]
    out[p * m + q] = sum
  }
  return {n, m, c: out, off}
}

function partOf(low, high) {
  // The matrices to a part of [-1, 1], made once each.
  const made = new Map()
  return n => {
    if (!made.has(n)) made.set(n, restriction(n, low, high))
    return made.get(n)
  }
}

function shortened(s, most) {
  // Without the highest degrees, as long as they add up to less than `most`; `off`: what has been left out in all.
  let {n, m, c} = s, left = most
  const layer = (axis, last) => {
    let sum = 0
    if (axis) for (let p = 0; p < n; p++) sum += Math.abs(c[p * s.m + last])
    else for (let q = 0; q < m; q++) sum += Math.abs(c[last * s.m + q])
    return sum
  }
  for (;;) {
    const one = n > 1 ? layer(0, n - 1) : Infinity, other = m > 1 ? layer(1, m - 1) : Infinity, least = Math.min(one, other)
    if (!(least <= left)) break
    left -= least
    if (one <= other) n--
    else m--
  }
  const out = new Float64Array(n * m)
  for (let p = 0; p < n; p++) for (let q = 0; q < m; q++) out[p * m + q] = c[p * s.m + q]
  return {n, m, c: out, off: (s.off ?? 0) + most - left}
}

function bounds({c}) {
  let rest = 0
  for (let i = 1; i < c.length; i++) rest += Math.abs(c[i])
  return [c[0], rest]
}

function seriesOf(panel) {
  panel.square ??= panel.series.map(rows => {
    const n = Math.max(1, rows.length), m = Math.max(1, ...rows.map(row => row.length)), c = new Float64Array(n * m)
    rows.forEach((row, j) => row.forEach((value, k) => { c[j * m + k] = value }))
    return {n, m, c}
  })
  return panel.square
}

// ---- what a pixel shows

function verdictOf(rule, v, e) {
  return rule === "hill" ? judgedByFactors(v[0], v[1], v[2], v[3], e) : answer(rule, v, e).verdict
}

function judgedByFactors(a, b, c, d, e) {
  const both = (a > e[0] || a < -e[0]) && (d > e[3] || d < -e[3]), others = (b > e[1] || b < -e[1]) && (c > e[2] || c < -e[2])
  if ((both && a > 0 !== d > 0) || (others && b > 0 === c > 0)) return 0
  return both && others ? 1 : -1
}

function valueOf(model, name, v) {
  if (model.rule === "hill") {
    const sine = v[1] * v[2], cosine = v[0] * v[3]
    if (name === "discriminant") return Math.abs(sine) < Math.abs(cosine) ? 2 + 4 * sine : 4 * cosine - 2
    if (name === "exponent") return 2 * Math.asinh(Math.sqrt(Math.max(sine, -cosine, 0)))
  } else if (model.rule === "trace" && name === "exponent") return 2 * Math.asinh(Math.sqrt(Math.max((Math.abs(v[0]) - 2) / 4, 0)))
  else if (model.rule === "danby" && name === "a") return 4 * v[4] - 4
  else if (model.rule === "danby" && name === "b") return 6 - 8 * v[4] + 16 * v[0] * v[1]
  return v[model.functions.indexOf(name)]
}

function edgesOf(rule, v) {
  // Functions whose zeros are edges, where they are simple.
  if (rule === "hill") return v
  if (rule === "trace") return [v[0] - 2, v[0] + 2]
  if (rule === "danby") return [v[0] * v[1], v[2] * v[3], (v[4] - 2) ** 2 - 4 * v[2] * v[3]]
  if (rule === "reciprocal") return v.length === 1 ? [v[0] - 2, v[0] + 2] : [v[0] * v[0] - 4 * v[1], 4 + 2 * v[0] + v[1], 4 - 2 * v[0] + v[1]]
  let p = [1, ...v]
  const out = []  // Schur's: the first that fails is the edge; it is reported as their least
  for (let n = v.length; n > 0; n--) {
    out.push((p[0] * p[0] - p[n] * p[n]) / (p[0] * p[0] + p[n] * p[n]))
    p = p.slice(0, n).map((_, i) => p[0] * p[i] - p[n] * p[n - i])
  }
  return [Math.min(...out)]
}

const styleOf = (rule, f) => rule === "hill" ? FACTORS[f] : [f === 1, f === 2]

// ---- a rectangle of pixels

// job: {x: [first, step], y: [first, step], width, height} of pixel centres; show; colours {verdict}, table, range, lines
function draw(model, job) {
  return model.grid ? drawGrid(model, job) : drawSeries(model, job)
}

function drawSeries(model, job) {
  const {width, height} = job, out = new Uint8ClampedArray(4 * width * height)
  for (let i = 0; i < width * height; i++) {  // hatched: no answer
    out[4 * i] = out[4 * i + 1] = out[4 * i + 2] = (i % width + Math.floor(i / width)) % 8 ? 255 : 130
    out[4 * i + 3] = 255
  }
  for (const panel of model.about.panels) {
    const [first, last] = span(job, panel)
    if (first[0] <= last[0] && first[1] <= last[1]) drawPanel(model, panel, job, first, last, out)
  }
  return out
}

function span(job, {low, high}) {
  // The first and the last pixels whose centres lie in the panel.
  const ends = ["x", "y"].map((axis, i) => [low[i], high[i]].map(end => (end - job[axis][0]) / job[axis][1]).sort((a, b) => a - b))
  const sizes = [job.width, job.height]
  return [ends.map(([a]) => Math.max(0, Math.ceil(a))), ends.map(([, b], i) => Math.min(sizes[i] - 1, Math.floor(b)))]
}

function drawPanel(model, panel, job, [left, top], [right, bottom], out) {
  // One pixel more on every side, for slopes.
  const X = i => place(job.x[0] + i * job.x[1], panel.low[0], panel.high[0])
  const Y = j => place(job.y[0] + j * job.y[1], panel.low[1], panel.high[1])
  const ends = [X(left - 1), X(right + 1), Y(bottom + 1), Y(top - 1)]
  const sides = [partOf(ends[0], ends[1]), partOf(ends[2], ends[3])]
  const own = seriesOf(panel).map((s, f) => {
    const part = restricted(s, ...sides)
    return shortened(part, Math.max(0.02 * panel.bars[f], 2e-5 * bounds(part)[1] / Math.max(job.width, job.height)))
  })
  if (decided(model, panel, job, own, left, top, right - left + 1, bottom - top + 1, out)) return
  const columns = [], rows = []
  for (let i = left; i <= right; i += BLOCK) {
    const to = Math.min(i + BLOCK - 1, right)
    columns.push([i, to, partOf(place(X(i - 1), ends[0], ends[1]), place(X(to + 1), ends[0], ends[1]))])
  }
  for (let j = top; j <= bottom; j += BLOCK) {
    const to = Math.min(j + BLOCK - 1, bottom)
    rows.push([j, to, partOf(place(Y(to + 1), ends[2], ends[3]), place(Y(j - 1), ends[2], ends[3]))])
  }
  for (const [j, low, along] of rows) for (const [i, high, across] of columns) {
    drawBlock(model, panel, job, own.map(s => restricted(s, across, along)), i, j, high - i + 1, low - j + 1, out)
  }
}

function decided(model, panel, job, own, left, top, width, height, out) {
  // Where all factors have one sign, the pixels have one colour.
  if (job.show !== "verdict" || model.rule !== "hill") return false
  const limits = own.map(bounds)
  if (!limits.every(([c, rest], f) => Math.abs(c) > rest + panel.bars[f] + own[f].off)) return false
  const [a, b, c, d] = limits
  fill(out, job.width, left, top, width, height, job.colours[judgedByFactors(a[0], b[0], c[0], d[0], panel.bars)])
  return true
}

function exactly(model, panel, x, y) {
  // The verdict from the panel's whole series: where the shortened ones leave it open.
  const X = place(x, panel.low[0], panel.high[0]), Y = place(y, panel.low[1], panel.high[1])
  return answer(model.rule, panel.series.map(rows => clenshaw(rows.map(row => clenshaw(row, Y)), X)), panel.bars).verdict
}

function drawBlock(model, panel, job, series, left, top, width, height, out) {
  if (decided(model, panel, job, series, left, top, width, height, out)) return
  const {bars} = panel, verdicts = job.show === "verdict", wide = width + 2, tall = height + 2, F = series.length
  const short = series.map((s, f) => shortened(s, Math.max(0.05 * bars[f], 1e-4 * bounds(s)[1] / BLOCK)))
  const values = short.map(s => onPixels(s, wide, tall)), wider = bars.map((bar, f) => bar + 1.01 * short[f].off + 1e-15)
  const v = new Array(F), lines = job.lines ? edgeAlphas(model.rule, values, wide, tall, job.thick) : null
  for (let j = 0; j < height; j++) for (let i = 0; i < width; i++) {
    const from = (j + 1) * wide + i + 1, to = 4 * ((top + j) * job.width + left + i)
    for (let f = 0; f < F; f++) v[f] = values[f][from]
    let verdict = verdicts ? verdictOf(model.rule, v, wider) : 1
    if (verdict === -1) verdict = exactly(model, panel, job.x[0] + (left + i) * job.x[1], job.y[0] + (top + j) * job.y[1])
    const colour = verdicts ? job.colours[verdict] : coloured(valueOf(model, job.show, v), job)
    let r = colour[0], g = colour[1], b = colour[2]
    if (lines && verdict >= 0) for (let f = 0; f < lines.length; f++) {
      const alpha = lines[f][from]
      if (!alpha) continue
      const [dashed, grey] = styleOf(model.rule, f), step = job.phase[0] + left + i + 2 * (job.phase[1] + top + j)
      if (dashed && step % (9 * job.thick) > 5.5 * job.thick) continue
      const shade = grey ? 112 : 0
      r += alpha * (shade - r); g += alpha * (shade - g); b += alpha * (shade - b)
    }
    out[to] = r; out[to + 1] = g; out[to + 2] = b; out[to + 3] = 255
  }
}

const place = (value, low, high) => ((value - low) + (value - high)) / (high - low)

function onPixels({n, m, c}, wide, tall) {
  // Values at the points of a lattice that spans the series' square, corners included; y downwards.
  const spread = size => Float64Array.from({length: size}, (_, i) => 2 * i / (size - 1) - 1)
  const X = polynomials(n, spread(wide)), Y = polynomials(m, spread(tall).map(y => -y)), out = new Float64Array(wide * tall)
  for (let j = 0; j < tall; j++) for (let p = 0; p < n; p++) {
    let sum = 0
    for (let q = 0; q < m; q++) sum += c[p * m + q] * Y[q * tall + j]
    for (let i = 0, at = j * wide; i < wide; i++) out[at + i] += sum * X[p * wide + i]
  }
  return out
}

function edgeAlphas(rule, values, wide, tall, thick) {
  // How much of a pixel an edge covers, by its distance |f| / |slope of f|.
  let functions = values
  if (rule !== "hill") {
    const v = new Array(values.length), number = edgesOf(rule, values.map(value => value[0])).length
    functions = Array.from({length: number}, () => new Float64Array(wide * tall))
    for (let i = 0; i < wide * tall; i++) {
      for (let f = 0; f < values.length; f++) v[f] = values[f][i]
      edgesOf(rule, v).forEach((value, f) => { functions[f][i] = value })
    }
  }
  return functions.map(own => {
    const out = new Float32Array(wide * tall)
    for (let j = 1; j < tall - 1; j++) for (let i = 1; i < wide - 1; i++) {
      const at = j * wide + i, slope = 0.5 * Math.hypot(own[at + 1] - own[at - 1], own[at + wide] - own[at - wide])
      const distance = Math.abs(own[at]) / slope
      if (distance < 0.5 * thick + 0.5 && (rule === "hill" || changes(own, at, i, j, wide, tall))) out[at] = Math.min(1, 0.5 * thick + 0.5 - distance)
    }
    return out
  })
}

function changes(own, at, i, j, wide, tall) {
  // Does it change its sign nearby? Where it only touches 0 nothing is lost.
  const reach = 3, a = at - Math.min(i, reach), b = at + Math.min(wide - 1 - i, reach), c = at - wide * Math.min(j, reach), d = at + wide * Math.min(tall - 1 - j, reach)
  return own[a] < 0 !== own[b] < 0 || own[c] < 0 !== own[d] < 0
}

function coloured(value, {table, range: [low, high]}) {
  if (!(value === value)) return [255, 255, 255]
  const i = 3 * Math.max(0, Math.min(255, Math.floor(256 * (value - low) / (high - low))))
  return [table[i], table[i + 1], table[i + 2]]
}

function fill(out, wide, left, top, width, height, [r, g, b]) {
  for (let j = top; j < top + height; j++) for (let i = left, at = 4 * (j * wide + left); i < left + width; i++, at += 4) {
    out[at] = r; out[at + 1] = g; out[at + 2] = b; out[at + 3] = 255
  }
}

// ---- a map of points: every pixel shows the nearest one

function nearest(values, x) {
  // The number of the ascending value nearest to x; -1 beyond the ends. Along a logarithmic axis: of logarithms.
  let low = 0, high = values.length - 1
  if (high === 0) return 0
  const half = [values[1] - values[0], values[high] - values[high - 1]]
  if (x < values[0] - half[0] / 2 || x > values[high] + half[1] / 2) return -1
  while (high - low > 1) {
    const middle = (low + high) >> 1
    if (values[middle] <= x) low = middle
    else high = middle
  }
  return x - values[low] <= values[high] - x ? low : high
}

function drawGrid(model, job) {
  const {width, height} = job, out = new Uint8ClampedArray(4 * width * height), {axes, places, variables, status} = model.grid
  const indices = ([first, step], size, values) => Int32Array.from({length: size}, (_, i) => nearest(values, first + i * step))
  const columns = indices(job.x, width, places[0]), rows = indices(job.y, height, places[1]), {values, flags} = variables[job.show]
  for (let j = 0; j < height; j++) for (let i = 0; i < width; i++) {
    const to = 4 * (j * width + i)
    let colour = [238, 238, 238]
    if (columns[i] >= 0 && rows[j] >= 0) {
      const at = columns[i] * axes[1].length + rows[j], code = status[at]
      if (model.grid.unanswered.includes(code)) {  // hatched: failed, or outside the domain
        const shade = ((i + j) % 8 && (!model.grid.failed.includes(code) || (i - j) % 8)) ? 255 : 110
        colour = [shade, shade, shade]
      } else if (model.grid.greys[code]) colour = model.grid.greys[code]
      else colour = flags ? job.colours[values[at]] ?? [68, 68, 68] : coloured(values[at], job)
    }
    out[to] = colour[0]; out[to + 1] = colour[1]; out[to + 2] = colour[2]; out[to + 3] = 255
  }
  return out
}
