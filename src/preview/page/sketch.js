// Sketch: a crown drawn over the silhouette of a source, or a line over a part of it, from any direction; the tree follows
// while the line is drawn, and can be drawn over again as it then is.

import { choice, el, latest, number, post, project, say, svg } from './kit.js';

const chosen = { preset: null, source: null, open: false };
/** Where the tree is looked at from, degrees: the front, level. */
const look = { view: 0, elevation: 0 };
const lookTo = (view, elevation) => Object.assign(look, { view: ((view % 360) + 360) % 360, elevation });

/** A drawn line, evened out: close points dropped, corners eased, a few hundred points at most. */
function eased(points, open) {
  if (points.length < 3) return points;
  const span = Math.max(...[0, 1].map(k => Math.max(...points.map(p => p[k])) - Math.min(...points.map(p => p[k]))));
  const least = Math.max(span / 160, 0.005);
  const kept = [points[0]];
  for (const p of points) if (Math.hypot(p[0] - kept.at(-1)[0], p[1] - kept.at(-1)[1]) >= least) kept.push(p);
  return kept.map((p, i) => {
    if (open && (i === 0 || i === kept.length - 1)) return p;
    const [a, b] = [kept[(i + kept.length - 1) % kept.length], kept[(i + 1) % kept.length]];
    return [(a[0] + 2 * p[0] + b[0]) / 4, (a[1] + 2 * p[1] + b[1]) / 4];
  });
}
const round = v => Math.round(v * 1000) / 1000;

export function open(main) {
  const presets = project.state.sets.map(set => set.preset);
  if (!presets.length) { main.append(el('div.empty', {}, el('h2', {}, 'No preset yet'))); return null; }
  if (!presets.includes(chosen.preset)) { chosen.preset = presets[0]; chosen.source = null; }
  const bar = el('div.bar');
  const canvas = el('div.canvas.draw', { tabIndex: 0, 'aria-label': 'Draw the crown here, around the tree' });
  const image = el('img', { alt: '' });
  const lines = svg('svg', { 'aria-hidden': 'true' });
  const outline = svg('path', { class: 'outline' }), drawn = svg('path', { class: 'drawn' });
  lines.append(outline, drawn);
  const busy = el('span.busy', { hidden: true }, 'following…');
  canvas.append(image, lines, busy);
  const name = el('input', { type: 'text', value: 'crown', size: 14, 'aria-label': 'Name of the sketch', pattern: '[A-Za-z0-9_\\-]+' });
  const keep = el('button.strong', { onclick: save, disabled: true }, 'Save beside the preset');
  const clear = el('button', { onclick: () => { points = []; strokes = []; show(); first(); }, disabled: true }, 'Clear');
  const over = el('button', { onclick: () => { strokes.push({ points, ...from }); points = []; source = []; show(); first(); }, disabled: true }, 'Draw over it');
  const back = el('button', { onclick: () => { const last = strokes.pop(); ({ points, ...from } = last); lookTo(from.view, from.elevation); mode(from.open); turned('fine'); }, disabled: true }, 'Back to the last');
  const under = el('p.soft', {});
  const kinds = [[false, 'Closed shape'], [true, 'Open line']].map(([open, label]) => el('button', { onclick: () => mode(open), 'data-open': String(open) }, label));
  const how = el('p');
  const shapes = Object.entries({ Ball: 40, Spindle: 1, Umbrella: 2, Bump: 'bump' }).map(([label, kind]) => el('button', { onclick: () => start(kind), 'data-open': String(kind === 'bump') }, label));
  const angle = (label, name, low, high) => {
    const told = el('output'), input = el('input', { type: 'range', min: low, max: high, step: 5, value: look[name], 'aria-label': label,
      oninput: () => { look[name] = Number(input.value); turned('quick'); }, onchange: () => turned('fine') });
    const row = el('label.angle', {}, el('span', {}, label), input, told);
    return Object.assign(row, { tell() { input.value = look[name]; told.textContent = `${look[name]}°`; } });
  };
  const angles = [angle('Azimuth', 'view', 0, 355), angle('Elevation', 'elevation', -90, 90)];
  const sides = Object.entries({ Front: [0, 0], Side: [90, 0], Above: [0, 90] }).map(([label, to]) => el('button', { onclick: () => { lookTo(...to); turned('fine'); } }, label));
  const told = el('p.soft', { role: 'status' });
  const side = el('div.side', {}, el('div.panel', {}, el('h3', {}, 'Draw a crown'),
    el('p', {}, el('span.segments', { role: 'group', 'aria-label': 'What is drawn' }, ...kinds)), how,
    el('p.soft', {}, 'Without a pointer: a shape to start from, then the arrow keys make it wider, narrower, taller and lower, or move a line.'),
    el('div.bar', {}, ...shapes), told),
  el('div.panel', {}, el('h3', {}, 'View'), ...angles, el('div.bar', {}, ...sides),
    el('p.soft', {}, 'Turn before drawing: a drawing acts from where it is drawn. Turn after it to look at the tree from elsewhere; a new line then begins a new drawing.')),
  el('div.panel', {}, el('h3', {}, 'One over another'), el('p.soft', {}, 'The tree as it now is, drawn over again: from the same place or another. Each drawing acts on what the ones before gave.'),
    el('div.bar', {}, over, back), under),
  el('div.panel', {}, el('h3', {}, 'Keep it'), el('p', {}, el('label.field', {}, 'Name', name)), el('p', {}, keep, ' ', clear)));
  main.append(bar, el('div.stage', {}, canvas, side));

  // What is drawn, and from where; and what was drawn before, which it lies over.
  let frame = null, points = [], from = { open: false, view: 0, elevation: 0 }, drawing = null, source = [], closed = false, strokes = [];
  const seen = () => from.view === look.view && from.elevation === look.elevation;
  const begin = () => { from = { open: chosen.open, ...look }; };
  /** In a level view nothing is drawn below the ground. */
  const grounded = y => (look.elevation === 0 ? Math.max(0, y) : y);
  const place = ([x, y]) => [(x / frame.metres) + frame.width / 2, frame.height / 2 - (y - frame.middle) / frame.metres];
  const metres = event => {
    const box = canvas.getBoundingClientRect();
    // The picture is fitted into the box, whole.
    const fit = Math.min(box.width / frame.width, box.height / frame.height);
    const x = (event.clientX - box.left - box.width / 2) / fit, y = (event.clientY - box.top - box.height / 2) / fit;
    return [round(x * frame.metres), round(grounded(frame.middle - y * frame.metres))];
  };
  const path = (ring, open) => (ring.length ? `M${ring.map(p => place(p).map(v => v.toFixed(1)).join(' ')).join('L')}${open ? '' : 'Z'}` : '');
  function show() {
    if (!frame) return;
    lines.setAttribute('viewBox', `0 0 ${frame.width} ${frame.height}`);
    outline.setAttribute('d', path(source));
    drawn.setAttribute('d', drawing || seen() ? path(drawing ?? points, from.open) : '');
    drawn.classList.toggle('open', from.open);
    keep.disabled = clear.disabled = points.length < 3 && !strokes.length;
    over.disabled = points.length < 3 || strokes.length > 15;
    back.disabled = !strokes.length;
    under.textContent = strokes.length ? `${strokes.length === 1 ? 'One drawing lies' : `${strokes.length} drawings lie`} below.` : '';
  }
  async function picture(what, care) {
    const height = Math.min(care === 'fine' ? 900 : 520, Math.max(240, Math.round(canvas.clientHeight)));
    const width = Math.max(240, Math.min(1024, Math.round(height * canvas.clientWidth / Math.max(1, canvas.clientHeight))));
    const to = { ...look };
    const late = setTimeout(() => { busy.hidden = false; }, 400);
    try {
      const answer = await post('/api/draft', { preset: chosen.preset, show: what, turn: to.view, elevation: to.elevation, width, height, care });
      const facts = JSON.parse(answer.headers.get('x-treewright'));
      const url = URL.createObjectURL(await answer.blob());
      await Object.assign(new Image(), { src: url }).decode();
      if (image.src.startsWith('blob:')) URL.revokeObjectURL(image.src);
      image.src = url;
      frame = { width, height, metres: facts.metres, middle: facts.middle, of: to };
      if (facts.outline?.length && to.view === look.view && to.elevation === look.elevation) source = facts.outline;
      told.textContent = `${facts.chains} branches, ${facts.leaves} leaves, ${number.format(facts.height)} m; ${Math.round(facts.milliseconds)} ms`;
      canvas.dataset.from = `${to.view} ${to.elevation}`;
      canvas.dataset.drawn = `${care} ${what.sketch ? 'sketch' : 'source'} ${points.length}`;
      show();
    } catch (error) { told.textContent = error.message; } finally { clearTimeout(late); busy.hidden = true; }
  }
  const first = (care = 'fine') => picture(strokes.length ? { sketch: { of: chosen.source, before: strokes, points: [] } } : { source: chosen.source }, care);
  const follow = latest(async (ring, care) => { if (!closed) await (ring.length > 2 ? picture({ sketch: { of: chosen.source, before: strokes, points: ring, ...from } }, care) : first(care)); });
  function mode(open) {
    chosen.open = open;
    for (const button of kinds) button.setAttribute('aria-pressed', button.dataset.open === String(open));
    for (const button of shapes) button.hidden = button.dataset.open !== String(open);
    how.textContent = open ? 'Draw a line over the dashed silhouette, from one place of it to another: it replaces that part, and the tree follows.'
      : 'Draw around the tree with mouse, pen or finger; the line closes by itself, and the tree follows.';
  }
  function turned(care) {
    for (const row of angles) row.tell();
    source = [];
    show();
    follow(points, care);
  }

  canvas.addEventListener('pointerdown', event => {
    // A picture from elsewhere, about to be replaced, is not drawn on.
    if (!frame || frame.of.view !== look.view || frame.of.elevation !== look.elevation) return;
    canvas.setPointerCapture(event.pointerId);
    begin();
    drawing = [metres(event)];
  });
  canvas.addEventListener('pointermove', event => {
    if (!drawing) return;
    for (const e of event.getCoalescedEvents?.() ?? [event]) drawing.push(metres(e));
    show();
    if (drawing.length > 12) { const ring = eased(drawing, from.open); if (spread(ring)) follow(ring, 'quick'); }
  });
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, () => {
    if (!drawing) return;
    const ring = eased(drawing, from.open);
    drawing = null;
    points = spread(ring) ? ring : [];
    if (!points.length && from.open && ring.length > 5) say('The ends of an open line lie apart: draw a closed shape instead');
    follow(points, 'fine');
    show();
  });
  /** Whether a ring holds an area worth following. */
  function spread(ring) {
    if (ring.length < 6) return false;
    const apart = (p, q) => Math.hypot(p[0] - q[0], p[1] - q[1]);
    const length = ring.slice(1).reduce((sum, p, i) => sum + apart(p, ring[i]), 0);
    if (from.open) return length > 0.2 && apart(ring[0], ring.at(-1)) > length * 0.2;
    const area = Math.abs(ring.reduce((sum, p, i) => { const q = ring[(i + 1) % ring.length]; return sum + p[0] * q[1] - q[0] * p[1]; }, 0) / 2);
    const tall = Math.max(...ring.map(p => p[1])) - Math.min(...ring.map(p => p[1]));
    return tall > 0.2 && area > tall * tall * 0.03;
  }
  function start(kind) {
    if (!source.length) return;
    begin();
    if (kind === 'bump') {
      // The part to the right, pushed out.
      const n = source.length, most = source.reduce((best, p, i) => (p[0] > source[best][0] ? i : best), 0), half = Math.floor(n / 8);
      const middle = source.reduce((sum, p) => [sum[0] + p[0] / n, sum[1] + p[1] / n], [0, 0]);
      points = Array.from({ length: 2 * half + 1 }, (_, k) => {
        const p = source[(most + k - half + n) % n], out = 1 + .3 * Math.sin(k / (2 * half) * Math.PI);
        return [middle[0] + (p[0] - middle[0]) * out, grounded(middle[1] + (p[1] - middle[1]) * out)].map(round);
      });
      show();
      follow(points, 'fine');
      return;
    }
    const [low, high] = [Math.min(...source.map(p => p[1])), Math.max(...source.map(p => p[1]))];
    const reach = Math.max(...source.map(p => Math.abs(p[0])));
    const wide = t => ({ 1: Math.sin(t * Math.PI) ** .8 * .45, 2: Math.sin(t * Math.PI) ** .5 * (t > .5 ? 1.15 : .55 + t) }[kind] ?? Math.sqrt(Math.max(0, 1 - (2 * t - 1) ** 2)));
    const rows = Array.from({ length: 33 }, (_, i) => i / 32);
    points = [...rows.map(t => [reach * wide(t), low + (high - low) * t]), ...rows.slice(1, -1).reverse().map(t => [-reach * wide(t), low + (high - low) * t])]
      .map(p => p.map(round));
    show();
    follow(points, 'fine');
  }
  canvas.addEventListener('keydown', event => {
    const by = { ArrowLeft: [.95, 1], ArrowRight: [1.05, 1], ArrowUp: [1, 1.05], ArrowDown: [1, .95] }[event.key];
    if (!by || points.length < 3) return;
    event.preventDefault();
    event.stopPropagation();
    const low = Math.min(...points.map(p => p[1]));
    const way = Math.max(...points.map(p => p[1])) - low;
    points = points.map(([x, y]) => (from.open ? [round(x + (by[0] - 1) * way), round(grounded(y + (by[1] - 1) * way))] : [round(x * by[0]), round(low + (y - low) * by[1])]));
    show();
    follow(points, 'quick');
  });

  async function save(event, replace = false) {
    try {
      const all = points.length < 3 ? strokes : [...strokes, { points, ...from }];
      const answer = await post('/api/sketch', { preset: chosen.preset, of: chosen.source, name: name.value.trim(), before: all.slice(0, -1), ...all.at(-1), replace });
      const { file, added } = await answer.json();
      say(added ? `Saved as ${file}; the preset has a new entry for it` : `Saved as ${file}`);
    } catch (error) {
      if (/of that name/.test(error.message) && !replace && confirm(`${name.value} is there already. Replace it?`)) return save(event, true);
      say(error.message);
    }
  }
  async function load() {
    const answer = await fetch(`/api/knobs?preset=${encodeURIComponent(chosen.preset)}`);
    if (!answer.ok) { told.textContent = (await answer.json().catch(() => ({}))).message ?? 'The preset is wrong'; return; }
    const names = (await answer.json()).sources.map(source => source.name);
    if (!names.includes(chosen.source)) chosen.source = names[0];
    bar.replaceChildren(
      choice('Preset', presets.map(p => [p, p]), chosen.preset, value => { Object.assign(chosen, { preset: value, source: null }); points = []; strokes = []; source = []; load(); }),
      choice('Source', names.map(n => [n, n]), chosen.source, value => { chosen.source = value; points = []; strokes = []; source = []; first(); }));
    if (points.length > 2) follow(points, 'fine'); else first();
  }
  mode(chosen.open);
  for (const row of angles) row.tell();
  load();
  return { close() { closed = true; } };
}
