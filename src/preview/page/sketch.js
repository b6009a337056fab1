// Sketch: a crown drawn over the silhouette of a source; the tree follows while the line is drawn.

import { choice, el, latest, number, post, project, say, svg } from './kit.js';

const chosen = { preset: null, source: null };

/** A drawn line, evened out: close points dropped, corners eased, a few hundred points at most. */
function eased(points) {
  if (points.length < 3) return points;
  const span = Math.max(...points.map(p => p[1])) - Math.min(...points.map(p => p[1]));
  const least = Math.max(span / 160, 0.005);
  const kept = [points[0]];
  for (const p of points) if (Math.hypot(p[0] - kept.at(-1)[0], p[1] - kept.at(-1)[1]) >= least) kept.push(p);
  return kept.map((p, i) => {
    const [a, b] = [kept[(i + kept.length - 1) % kept.length], kept[(i + 1) % kept.length]];
    return [(a[0] + 2 * p[0] + b[0]) / 4, Math.max(0, (a[1] + 2 * p[1] + b[1]) / 4)];
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
  const clear = el('button', { onclick: () => { points = []; show(); first(); }, disabled: true }, 'Clear');
  const told = el('p.soft', { role: 'status' });
  const side = el('div.side', {}, el('div.panel', {}, el('h3', {}, 'Draw a crown'),
    el('p', {}, 'Draw around the tree with mouse, pen or finger; the line closes by itself, and the tree follows.'),
    el('p.soft', {}, 'Without a pointer: a shape to start from, then the arrow keys make it wider, narrower, taller and lower.'),
    el('div.bar', {}, ...Object.entries({ Ball: 40, Spindle: 1, Umbrella: 2 }).map(([label, kind]) => el('button', { onclick: () => start(kind) }, label))),
    told), el('div.panel', {}, el('h3', {}, 'Keep it'), el('p', {}, el('label.field', {}, 'Name', name)), el('p', {}, keep, ' ', clear)));
  main.append(bar, el('div.stage', {}, canvas, side));

  let frame = null, points = [], drawing = null, source = [], closed = false;
  const place = ([x, y]) => [(x / frame.metres) + frame.width / 2, frame.height / 2 - (y - frame.middle) / frame.metres];
  const metres = event => {
    const box = canvas.getBoundingClientRect();
    // The picture is fitted into the box, whole.
    const fit = Math.min(box.width / frame.width, box.height / frame.height);
    const x = (event.clientX - box.left - box.width / 2) / fit, y = (event.clientY - box.top - box.height / 2) / fit;
    return [round(x * frame.metres), round(Math.max(0, frame.middle - y * frame.metres))];
  };
  const path = ring => (ring.length ? `M${ring.map(p => place(p).map(v => v.toFixed(1)).join(' ')).join('L')}Z` : '');
  function show() {
    if (!frame) return;
    lines.setAttribute('viewBox', `0 0 ${frame.width} ${frame.height}`);
    outline.setAttribute('d', path(source));
    drawn.setAttribute('d', path(drawing ?? points));
    keep.disabled = clear.disabled = points.length < 3;
  }
  async function picture(what, care) {
    const height = Math.min(care === 'fine' ? 900 : 520, Math.max(240, Math.round(canvas.clientHeight)));
    const width = Math.max(240, Math.min(1024, Math.round(height * canvas.clientWidth / Math.max(1, canvas.clientHeight))));
    const late = setTimeout(() => { busy.hidden = false; }, 400);
    try {
      const answer = await post('/api/draft', { preset: chosen.preset, show: what, width, height, care });
      const facts = JSON.parse(answer.headers.get('x-treewright'));
      const url = URL.createObjectURL(await answer.blob());
      await Object.assign(new Image(), { src: url }).decode();
      if (image.src.startsWith('blob:')) URL.revokeObjectURL(image.src);
      image.src = url;
      frame = { width, height, metres: facts.metres, middle: facts.middle };
      if (facts.outline?.length) source = facts.outline;
      told.textContent = `${facts.chains} branches, ${facts.leaves} leaves, ${number.format(facts.height)} m; ${Math.round(facts.milliseconds)} ms`;
      canvas.dataset.drawn = `${care} ${what.sketch ? 'sketch' : 'source'} ${points.length}`;
      show();
    } catch (error) { told.textContent = error.message; } finally { clearTimeout(late); busy.hidden = true; }
  }
  const first = () => picture({ source: chosen.source }, 'fine');
  const follow = latest(async (ring, care) => { if (!closed && ring.length > 2) await picture({ sketch: { of: chosen.source, points: ring } }, care); });

  canvas.addEventListener('pointerdown', event => {
    if (!frame) return;
    canvas.setPointerCapture(event.pointerId);
    drawing = [metres(event)];
  });
  canvas.addEventListener('pointermove', event => {
    if (!drawing) return;
    for (const e of event.getCoalescedEvents?.() ?? [event]) drawing.push(metres(e));
    show();
    if (drawing.length > 12) { const ring = eased(drawing); if (spread(ring)) follow(ring, 'quick'); }
  });
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, () => {
    if (!drawing) return;
    const ring = eased(drawing);
    drawing = null;
    if (spread(ring)) { points = ring; follow(points, 'fine'); }
    show();
  });
  /** Whether a ring holds an area worth following. */
  function spread(ring) {
    if (ring.length < 6) return false;
    const area = Math.abs(ring.reduce((sum, p, i) => { const q = ring[(i + 1) % ring.length]; return sum + p[0] * q[1] - q[0] * p[1]; }, 0) / 2);
    const tall = Math.max(...ring.map(p => p[1])) - Math.min(...ring.map(p => p[1]));
    return tall > 0.2 && area > tall * tall * 0.03;
  }
  function start(kind) {
    if (!source.length) return;
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
    points = points.map(([x, y]) => [round(x * by[0]), round(low + (y - low) * by[1])]);
    show();
    follow(points, 'quick');
  });

  async function save(event, replace = false) {
    try {
      const answer = await post('/api/sketch', { preset: chosen.preset, of: chosen.source, name: name.value.trim(), points, replace });
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
      choice('Preset', presets.map(p => [p, p]), chosen.preset, value => { Object.assign(chosen, { preset: value, source: null }); points = []; source = []; load(); }),
      choice('Source', names.map(n => [n, n]), chosen.source, value => { chosen.source = value; points = []; source = []; first(); }));
    if (points.length > 2) follow(points, 'fine'); else first();
  }
  load();
  return { close() { closed = true; } };
}
