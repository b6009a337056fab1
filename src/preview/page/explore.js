// Explore: a point in a pad between the sources; the mix at that point is made and drawn while it is dragged.

import { el, latest, number, post, project, save, say, svg } from './kit.js';

const chosen = { preset: null, sources: null, point: [0, 0] };

/** Corners of the pad for so many sources: a line for two, else a polygon with a corner on top. */
function corners(n) {
  if (n === 2) return [[-1, 0], [1, 0]];
  return Array.from({ length: n }, (_, i) => {
    const angle = -Math.PI / 2 + i * 2 * Math.PI / n;
    return [Math.cos(angle), Math.sin(angle)];
  });
}

/** Weights of a point by its corners: on the line by distance, in the polygon by Wachspress's coordinates. */
export function weights(point, ring) {
  const n = ring.length;
  if (n === 2) { const t = Math.min(1, Math.max(0, (point[0] + 1) / 2)); return [1 - t, t]; }
  const area = (a, b, c) => Math.max(0, ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2);
  const raw = ring.map((corner, i) => {
    const before = ring[(i + n - 1) % n], after = ring[(i + 1) % n];
    // Multiplied out, so that the edges, where areas vanish, need no division.
    let product = area(before, corner, after);
    for (let k = 0; k < n; k++) if (k !== i && (k + 1) % n !== i) product *= area(point, ring[k], ring[(k + 1) % n]);
    return product;
  });
  const sum = raw.reduce((a, b) => a + b, 0);
  if (sum > 0) return raw.map(w => w / sum);
  const near = ring.map(c => Math.hypot(c[0] - point[0], c[1] - point[1]));
  return near.map(d => (d === Math.min(...near) ? 1 : 0));
}

/** The nearest point inside. */
function inside(point, ring) {
  if (ring.length === 2) return [Math.min(1, Math.max(-1, point[0])), 0];
  let best = null;
  let out = false;
  for (let i = 0; i < ring.length; i++) {
    const [a, b] = [ring[i], ring[(i + 1) % ring.length]];
    const way = [b[0] - a[0], b[1] - a[1]];
    if (way[0] * (point[1] - a[1]) - way[1] * (point[0] - a[0]) < 0) out = true;
    const t = Math.min(1, Math.max(0, ((point[0] - a[0]) * way[0] + (point[1] - a[1]) * way[1]) / (way[0] ** 2 + way[1] ** 2)));
    const on = [a[0] + way[0] * t, a[1] + way[1] * t];
    const far = Math.hypot(on[0] - point[0], on[1] - point[1]);
    if (!best || far < best[1]) best = [on, far];
  }
  return out ? best[0] : point;
}

export function open(main) {
  const presets = project.state.sets.map(set => set.preset);
  if (!presets.length) { main.append(el('div.empty', {}, el('h2', {}, 'No preset yet'))); return null; }
  if (!presets.includes(chosen.preset)) chosen.preset = presets[0];
  const preset = el('select', { onchange: () => { chosen.preset = preset.value; chosen.sources = null; load(); } },
    presets.map(name => el('option', { selected: name === chosen.preset }, name)));
  const picks = el('div.bar', { role: 'group', 'aria-label': 'Sources in the pad' });
  const pad = el('div.pad', { tabIndex: 0, role: 'application', 'aria-label': 'Pad between the sources: drag the point, or move it with the arrow keys' });
  const facts = el('p.soft', { role: 'status' });
  const keep = el('button.strong', { onclick: add }, 'Add this mix to the preset');
  const canvas = el('div.canvas');
  const image = el('img', { alt: '' });
  const busy = el('span.busy', { hidden: true }, 'drawing…');
  canvas.append(image, busy);
  main.append(
    el('div.bar', {}, el('label.field', {}, 'Preset', preset), picks),
    el('div.two', {}, el('div.left', {}, pad, el('div.panel', {}, el('h3', {}, 'Here'), facts, el('p', {}, keep))), canvas));

  let told = null, ring = [], turn = 26, times = [], closed = false;
  async function load() {
    try {
      const answer = await fetch(`/api/knobs?preset=${encodeURIComponent(chosen.preset)}`);
      if (!answer.ok) throw new Error((await answer.json()).message);
      told = await answer.json();
    } catch (error) { facts.textContent = error.message; pad.replaceChildren(); return; }
    const names = told.sources.map(source => source.name);
    if (!chosen.sources || chosen.sources.some(name => !names.includes(name))) { chosen.sources = names.slice(0, 5); chosen.point = [0, 0]; }
    picks.replaceChildren(...(names.length > 2 ? [el('span.soft', {}, 'Sources'), ...names.map(name => el('button', {
      'aria-pressed': String(chosen.sources.includes(name)),
      onclick: () => {
        const on = chosen.sources.includes(name);
        if (on && chosen.sources.length <= 2) { say('A mix needs two sources'); return; }
        chosen.sources = on ? chosen.sources.filter(n => n !== name) : names.filter(n => n === name || chosen.sources.includes(n)).slice(0, 8);
        chosen.point = [0, 0];
        load();
      },
    }, name))] : []));
    if (chosen.sources.length < 2) {
      pad.replaceChildren(el('p.empty', {}, 'This preset has one source. A pad needs two: add another to sources.'));
      facts.textContent = '';
      return;
    }
    ring = corners(chosen.sources.length);
    draw();
    ask('fine');
  }

  const scale = 116;
  // In the middle of the pad, whatever shape the corners make.
  const middle = () => [170, 170 - scale * (Math.min(...ring.map(c => c[1])) + Math.max(...ring.map(c => c[1]))) / 2];
  const at = p => [middle()[0] + p[0] * scale, middle()[1] + p[1] * scale];
  function draw() {
    const shares = weights(chosen.point, ring);
    const made = svg('svg', { viewBox: '0 0 340 340', 'aria-hidden': 'true' });
    if (ring.length > 2) made.append(svg('polygon', { class: 'shape', points: ring.map(c => at(c).join(',')).join(' ') }));
    else made.append(svg('line', { class: 'ray', x1: at(ring[0])[0], y1: at(ring[0])[1], x2: at(ring[1])[0], y2: at(ring[1])[1], 'stroke-width': 3 }));
    const [px, py] = at(chosen.point);
    ring.forEach((corner, i) => {
      const [x, y] = at(corner);
      if (ring.length > 2 && shares[i] > 0.005) made.append(svg('line', { class: 'ray', x1: x, y1: y, x2: px, y2: py, 'stroke-width': 1 + shares[i] * 9 }));
      made.append(svg('circle', { class: 'corner', cx: x, cy: y, r: 6 + shares[i] * 12 }));
      const below = corner[1] > 0.3 || ring.length === 2;
      const name = chosen.sources[i];
      made.append(
        svg('text', { x: Math.min(290, Math.max(50, x)), y: below ? y + 36 : y - 40 }, name.length > 14 ? `${name.slice(0, 13)}…` : name),
        svg('text', { class: 'share', x: Math.min(290, Math.max(50, x)), y: below ? y + 53 : y - 23 }, `${Math.round(shares[i] * 100)} %`));
    });
    made.append(svg('circle', { class: 'point', cx: px, cy: py, r: 11 }));
    pad.replaceChildren(made);
  }
  function mix() {
    return chosen.sources.map((name, i) => [name, Math.round(weights(chosen.point, ring)[i] * 1000) / 1000]).filter(([, w]) => w > 0);
  }
  const ask = latest(async care => {
    const of = mix();
    if (closed || !of.length) return;
    const start = performance.now();
    const show = of.length === 1 ? { source: of[0][0] } : { mix: of };
    const height = Math.min(care === 'fine' ? 900 : 560, Math.max(240, Math.round(canvas.clientHeight)));
    const width = Math.max(240, Math.min(1024, Math.round(height * canvas.clientWidth / Math.max(1, canvas.clientHeight))));
    const late = setTimeout(() => { busy.hidden = false; }, 400);
    try {
      const answer = await post('/api/draft', { preset: chosen.preset, show, turn, width, height, care });
      const drawn = JSON.parse(answer.headers.get('x-treewright'));
      const url = URL.createObjectURL(await answer.blob());
      await Object.assign(new Image(), { src: url }).decode();
      const old = image.src;
      image.src = url;
      if (old.startsWith('blob:')) URL.revokeObjectURL(old);
      image.alt = of.map(([name, share]) => `${Math.round(share * 100)} % ${name}`).join(', ');
      const took = performance.now() - start;
      if (care === 'quick') times.push(took);
      pad.dataset.times = JSON.stringify(times.slice(-200));
      canvas.dataset.drawn = `${care} ${JSON.stringify(of)}`;
      facts.textContent = `${drawn.chains} branches, ${drawn.leaves} leaves, ${number.format(drawn.height)} m; drawn in ${Math.round(took)} ms`;
    } catch (error) { facts.textContent = error.message; } finally { clearTimeout(late); busy.hidden = true; }
  });
  let settle;
  function moved(to) {
    chosen.point = inside(to, ring);
    draw();
    ask('quick');
    clearTimeout(settle);
    settle = setTimeout(() => ask('fine'), 250);
  }
  function place(event) {
    const box = pad.getBoundingClientRect();
    const side = Math.min(box.width, box.height);
    const unit = 340 / side;
    const x = (event.clientX - box.left - (box.width - side) / 2) * unit, y = (event.clientY - box.top - (box.height - side) / 2) * unit;
    return [(x - middle()[0]) / scale, (y - middle()[1]) / scale];
  }
  let dragging = false;
  pad.addEventListener('pointerdown', event => { if (ring.length) { dragging = true; pad.setPointerCapture(event.pointerId); moved(place(event)); } });
  pad.addEventListener('pointermove', event => { if (dragging) moved(place(event)); });
  for (const end of ['pointerup', 'pointercancel']) pad.addEventListener(end, () => { dragging = false; });
  pad.addEventListener('keydown', event => {
    const by = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (!by || !ring.length) return;
    event.preventDefault();
    event.stopPropagation();
    const far = event.shiftKey ? .2 : .05;
    moved([chosen.point[0] + by[0] * far, chosen.point[1] + by[1] * far]);
  });
  let from = null;
  canvas.addEventListener('pointerdown', event => { from = [event.clientX, turn]; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener('pointermove', event => { if (from) { turn = from[1] - (event.clientX - from[0]) * .6; ask('quick'); } });
  canvas.addEventListener('pointerup', () => { if (from) { from = null; ask('fine'); } });

  async function add() {
    const of = mix();
    if (!of.length) return;
    const value = of.length === 1 ? `Source("${of[0][0]}")` : `Mix(of: {${of.map(([name, w]) => `"${name}": ${w}`).join(', ')}})`;
    try {
      const answer = await post('/api/save', { preset: chosen.preset, file: told.file, base: told.base, append: [['variants', value]] });
      told.base = (await answer.json()).base;
      say(`Added to ${chosen.preset}: ${value}`);
    } catch (error) { say(error.status === 409 ? 'The preset was changed meanwhile; look again' : error.message); if (error.status === 409) load(); }
  }
  const follow = ({ detail }) => { if (detail.what === 'built' && detail.preset === chosen.preset) load(); };
  window.addEventListener('treewright', follow);
  load();
  return { close() { closed = true; clearTimeout(settle); window.removeEventListener('treewright', follow); } };
}
