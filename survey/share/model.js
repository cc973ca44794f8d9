// Reads a model of a map (`survey model`; the format: workflows/docs/model.md). No other file is needed.
//   const model = await readModel(bytes)          // bytes: Uint8Array of the file
//   model.at(0.5, 1.2)                            // {verdict: 1, discriminant: [value, bar], ...}; null: no answer

async function unpacked(bytes) {
  // The members of a zip file, by name.
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength), members = {}
  let end = bytes.length - 22
  while (view.getUint32(end, true) !== 0x06054b50) end--
  for (let n = view.getUint16(end + 10, true), at = view.getUint32(end + 16, true); n > 0; n--) {
    const size = view.getUint32(at + 20, true), name = view.getUint16(at + 28, true), own = view.getUint32(at + 42, true)
    const first = own + 30 + view.getUint16(own + 26, true) + view.getUint16(own + 28, true)
    const packed = new Blob([bytes.subarray(first, first + size)])
    const stream = view.getUint16(at + 10, true) ? packed.stream().pipeThrough(new DecompressionStream("deflate-raw")) : packed.stream()
    members[new TextDecoder().decode(bytes.subarray(at + 46, at + 46 + name))] = await new Response(stream).arrayBuffer()
    at += 46 + name + view.getUint16(at + 30, true) + view.getUint16(at + 32, true)
  }
  return members
}

async function readModel(bytes) {
  const members = await unpacked(bytes), about = JSON.parse(new TextDecoder().decode(members["model.json"]))
  if (about.format !== "survey-model 1") throw new Error(`the format is ${about.format}, not survey-model 1`)
  return new Model(about, new DataView(members["series.f64"]))
}

class Model {
  constructor(about, series) {
    this.about = about
    for (const panel of about.panels) {
      let at = panel.first * 8
      panel.series = panel.terms.map(terms => terms.map(count => {
        const row = new Float64Array(count)
        for (let k = 0; k < count; k++, at += 8) row[k] = series.getFloat64(at, true)
        return row
      }))
    }
  }
  panel(x, y) {
    return this.about.panels.find(({low, high}) => x >= low[0] && x <= high[0] && y >= low[1] && y <= high[1])
  }
  at(x, y) {
    const panel = this.panel(x, y)
    if (!panel) return null
    const [X, Y] = [x, y].map((v, i) => ((v - panel.low[i]) + (v - panel.high[i])) / (panel.high[i] - panel.low[i]))
    const values = panel.series.map(rows => clenshaw(rows.map(row => clenshaw(row, Y)), X))
    const out = answer(this.about.rule, values, panel.bars)
    this.about.functions.forEach(({name}, f) => { out[name] ??= [values[f], panel.bars[f]] })
    return out
  }
}

function clenshaw(c, x) {
  let last = 0, before = 0
  for (let k = c.length - 1; k > 0; k--) [last, before] = [c[k] + 2 * x * last - before, last]
  return c.length ? c[0] + x * last - before : 0
}

const product = (a, b, e, f) => [a * b, e * Math.abs(b) + f * Math.abs(a) + e * f + 2 ** -52 * Math.abs(a * b)]

function exponent([square, bar], verdict) {
  if (verdict === 1) return [0, 0]
  const of = s => 2 * Math.asinh(Math.sqrt(Math.max(s, 0))), value = of(square)
  return [value, Math.max(of(square + bar) - value, value - of(square - bar)) + 2 ** -50 * value]
}

function judged(tests) {
  // Stable where every test [value, bar] is certainly positive, unstable where one is certainly negative.
  return tests.some(([v, e]) => v < -e) ? 0 : tests.every(([v, e]) => v > e) ? 1 : -1
}

function answer(rule, v, e) {
  if (rule === "hill") {
    const sine = product(v[1], v[2], e[1], e[2]), cosine = product(v[0], v[3], e[0], e[3])
    const known = v.map((value, f) => Math.abs(value) > e[f]), both = known[0] && known[3], others = known[1] && known[2]
    const up = v[0] > 0 === v[3] > 0, down = v[1] > 0 !== v[2] > 0
    const verdict = (both && !up) || (others && !down) ? 0 : both && others ? 1 : -1
    const d = sine[1] <= cosine[1] ? 2 + 4 * sine[0] : 4 * cosine[0] - 2
    const bar = 4 * Math.min(sine[1], cosine[1]) + 2 ** -52 * (2 + Math.abs(d))
    const growth = sine[0] > -cosine[0] ? sine : [-cosine[0], cosine[1]]
    return {verdict, discriminant: [d, bar], exponent: exponent(growth, verdict)}
  }
  if (rule === "trace") {
    const verdict = judged([[2 - Math.abs(v[0]), e[0]]])
    return {verdict, discriminant: [v[0], e[0]], exponent: exponent([(Math.abs(v[0]) - 2) / 4, e[0] / 4 + 2 ** -52], verdict)}
  }
  if (rule === "danby") {
    const t = v[4], bar = e[4], ab = product(v[0], v[1], e[0], e[1]), cd = product(v[2], v[3], e[2], e[3])
    const near = 2 * Math.abs(t) * bar + 4 * ab[1], far = 2 * Math.abs(t - 2) * bar + 4 * cd[1]
    const [root, other] = near <= far ? [t, ab[0]] : [t - 2, cd[0]]
    const rounding = 2 ** -52 * (2 * root * root + 4 * Math.abs(other) + 4 * Math.abs(root))
    const k = [root * root - 4 * other, Math.min(near, far) + bar * bar + rounding]
    const b = ab[1] <= cd[1] ? 6 - 8 * t + 16 * ab[0] : 8 * t - 10 + 16 * cd[0]
    const less = 2 ** -52 * (16 * Math.abs(ab[1] <= cd[1] ? ab[0] : cd[0]) + 16 * Math.abs(t) + 20)
    return {verdict: judged([ab, cd, k, [t, bar], [2 - t, bar]]), a: [4 * t - 4, 4 * bar + 2 ** -52 * (4 * Math.abs(t) + 4)],
      b: [b, 16 * Math.min(ab[1], cd[1]) + 8 * bar + less]}
  }
  if (rule === "reciprocal") {
    if (v.length === 1) return {verdict: judged([[2 - Math.abs(v[0]), e[0]]])}
    const c = Math.abs(v[0]), square = c * c
    return {verdict: judged([
      [square - 4 * v[1], 2 * c * e[0] + e[0] ** 2 + 4 * e[1] + 2 ** -52 * (2 * square + 8 * Math.abs(v[1]))],
      [4 - 2 * c + v[1], 2 * e[0] + e[1] + 2 ** -52 * (8 + 4 * c + 2 * Math.abs(v[1]))],
      [4 - c, e[0] + 2 ** -52 * (4 + c)]])}
  }
  let p = [1, ...v], q = [0, ...e]  // Schur's recursion: inside the circle while the last is less than the first
  for (let n = v.length; n > 0; n--) {
    const lead = Math.abs(p[0]), last = Math.abs(p[n])
    if (last - q[n] > lead + q[0]) return {verdict: 0}
    if (!(last + q[n] < lead - q[0])) return {verdict: -1}
    const next = p.slice(0, n).map((_, i) => p[0] * p[i] - p[n] * p[n - i]), scale = Math.abs(next[0]) + 1e-300
    const bars = next.map((value, i) => product(p[0], p[i], q[0], q[i])[1] + product(p[n], p[n - i], q[n], q[n - i])[1] + 2 ** -52 * Math.abs(value))
    p = next.map(value => value / scale)
    q = bars.map(bar => bar / scale * (1 + 2 ** -50) + 2 ** -52)
  }
  return {verdict: 1}
}
