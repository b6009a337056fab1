// The view of one tree: in space where three.js is there, as a turntable of pictures where it is not.

import { choice, count, el, number, picture, project, recipe, say } from './kit.js';
import { turntable } from './turntable.js';

const chosen = { set: null, index: 0, level: 'auto', wire: false, wind: false, forest: false, other: null, flat: false };

export function open(main, [setName, index]) {
  const sets = project.state.sets.filter(set => set.variants.length);
  if (!sets.length) {
    main.append(el('div.empty', {}, el('h2', {}, 'No tree yet'), el('p', {}, 'It appears as soon as it is built.')));
    return null;
  }
  if (setName) Object.assign(chosen, { set: setName, index: Number(index ?? 0), other: null });
  const find = () => {
    const all = project.state.sets.filter(set => set.variants.length);
    const set = all.find(set => set.set === chosen.set) ?? all[0];
    chosen.set = set.set;
    chosen.index = Math.min(Math.max(0, chosen.index || 0), set.variants.length - 1);
    return { set, variant: set.variants[chosen.index] };
  };
  const bar = el('div.bar'), canvas = el('div.canvas', { tabIndex: 0, 'aria-label': 'The tree; drag or use the arrow keys to turn it' });
  const side = el('div.side');
  main.append(bar, el('div.stage', {}, canvas, side));
  const three = () => project.state.three && !chosen.flat;
  let stage = null, closed = false, mine = 0;

  async function begin() {
    const run = ++mine;
    stage?.close();
    stage = null;
    canvas.replaceChildren();
    delete canvas.dataset.drawn;
    if (three()) {
      try {
        const { space } = await import('./space.js');
        if (closed || run !== mine) return;
        stage = space(canvas, facts => ruler(facts));
      } catch (error) {
        console.warn(error);
        say(`No view in space here (${error.message}); the turntable works everywhere`);
        chosen.flat = true;
      }
    }
    if (!stage) stage = turntable(canvas);
    show();
  }
  const foot = el('div.foot');
  /** The levels along the distance, and where the tree is now. */
  function ruler({ distance, coverage, level, levels, counts }) {
    if (!foot.isConnected) canvas.append(foot);
    canvas.dataset.level = level;
    for (const row of side.querySelectorAll('tr[data-level]')) {
      if (Number(row.dataset.level) === level && !chosen.forest) row.setAttribute('aria-current', 'true'); else row.removeAttribute('aria-current');
    }
    if (chosen.forest) {
      foot.replaceChildren(el('div.ruler', {}, `${counts.reduce((a, b) => a + b, 0)} trees · ${counts.map((n, i) => `LOD${i} ${n}`).join(' · ')}`));
      canvas.dataset.forest = counts.join(' ');
      return;
    }
    // Distances by their logarithm: near levels are short.
    const ends = levels.map(l => l.distance).filter(Boolean);
    const far = Math.max(...ends, distance) * 1.15, near = Math.min(...ends, distance, far / 8) * .55;
    const place = d => Math.min(100, Math.max(0, Math.log(Math.max(d, near) / near) / Math.log(far / near) * 100));
    let from = 0;
    const parts = levels.map((l, i) => {
      const to = i === levels.length - 1 ? 100 : place(l.distance);
      const part = el(`span${i === level ? '.now' : ''}`, { title: `LOD${i} ${l.kind}, up to ${number.format(l.distance ?? Infinity)} m` }, to - from > 7 ? `LOD${i}` : '');
      part.style.width = `${Math.max(0, to - from)}%`;
      from = Math.max(from, to);
      return part;
    });
    const needle = el('i');
    needle.style.left = `${place(distance)}%`;
    foot.replaceChildren(el('div.ruler', {},
      `${number.format(distance)} m away · ${(coverage * 100).toFixed(coverage < .1 ? 1 : 0)} % of the screen's height · LOD${level} ${levels[level].kind}`,
      el('div.track', {}, parts), el('div.needle', {}, needle)));
  }
  function press(label, key, title) {
    return el('button', { 'aria-pressed': String(chosen[key]), title, onclick: () => { chosen[key] = !chosen[key]; show(); } }, label);
  }
  function show() {
    if (!stage) return;
    const { set, variant } = find();
    chosen.level = chosen.level === 'auto' && three() ? 'auto' : Math.min(chosen.level === 'auto' ? 0 : chosen.level, variant.levels.length - 1);
    const all = project.state.sets.filter(s => s.variants.length);
    const levels = el('span.segments', { role: 'group', 'aria-label': 'Level of detail' },
      three() ? el('button', { 'aria-pressed': String(chosen.level === 'auto'), title: 'By distance, at the measured thresholds', onclick: () => pick('auto') }, 'By distance') : null,
      variant.levels.map((l, i) => el('button', { 'aria-pressed': String(chosen.level === i), title: `${l.kind}, ${l.triangles} triangles (Alt ${i})`, onclick: () => pick(i) }, `LOD${i}`)));
    const others = [['', 'nothing'], ...set.variants.filter(v => v.index !== variant.index).map(v => [v.index, v.name])];
    const walk = by => el('button', { 'aria-label': by < 0 ? 'The tree before' : 'The tree after', onclick: () => step(by) }, by < 0 ? '‹' : '›');
    bar.replaceChildren(...[
      choice('Set', all.map(s => [s.set, s.set]), set.set, value => go(value, 0)),
      el('span.walk', {}, walk(-1), choice('Tree', set.variants.map(v => [v.index, v.name]), variant.index, value => go(set.set, Number(value))), walk(1)),
      levels,
      three() ? [press('Wireframe', 'wire', 'W'), press('Breeze', 'wind', 'B'), press('Forest', 'forest', 'A thousand trees (F)')] : [],
      choice('Beside', others, chosen.other ?? '', value => { chosen.other = value === '' ? null : Number(value); show(); }),
    ].flat().filter(Boolean));
    const rows = variant.levels.map((l, i) => el('tr', { 'data-level': i },
      el('td', {}, `${i} ${l.kind.replace(/(?<=[a-z])[A-Z]/g, c => ` ${c.toLowerCase()}`)}`), el('td', {}, count(l.triangles)),
      el('td', {}, l.distance ? `${l.distance < 100 ? number.format(l.distance) : Math.round(l.distance)} m` : '∞'), el('td', {}, l.iou === null ? '' : `${(l.iou * 100).toFixed(0)} %`)));
    side.replaceChildren(...[
      el('div.panel', {}, el('h3', {}, variant.name), el('p', {}, recipe(variant.recipe)),
        el('p.soft', {}, `${number.format(variant.height)} m high, ${variant.chains} branches, ${variant.leaves} leaves`),
        el('p.soft', {}, `Seed ${variant.seed}`),
        el('p', {}, el('a', { href: `/set/${encodeURIComponent(set.set)}/${encodeURIComponent(variant.file)}`, download: variant.file }, variant.file))),
      el('div.panel', {}, el('h3', {}, 'Levels of detail'), el('table', {},
        el('tr', {}, ['Level', 'Triangles', 'Up to', 'Match'].map(h => el('th', { scope: 'col' }, h))), rows),
        el('p.soft', {}, 'Distances at 60° of view. Match: how much of the silhouette is that of LOD0 where the level takes over, as measured.')),
      project.state.three ? null : el('div.panel', {}, el('h3', {}, 'A view in space'),
        el('p', {}, 'Run ', el('code', {}, 'npm install three'), ' beside the presets, or give its folder with ', el('code', {}, '--three DIR'), ', and start the preview again.'),
        el('p.soft', {}, 'This page asks no other server for anything. The turntable is drawn by Treewright itself and always works.')),
    ].filter(Boolean));
    canvas.querySelectorAll('.caption, .split, .swap').forEach(c => c.remove());
    if (project.state.three) canvas.append(el('button.swap', { onpointerdown: event => event.stopPropagation(), onclick: () => { chosen.flat = !chosen.flat; begin(); } }, chosen.flat ? 'View in space' : 'Turntable'));
    const other = chosen.other === null ? null : set.variants[chosen.other] ?? null;
    if (three()) {
      stage.show({ set, variant, other, level: chosen.level, wire: chosen.wire, wind: chosen.wind, forest: chosen.forest });
      canvas.classList.remove('halves');
    } else {
      stage.show({ set, index: variant.index, name: variant.name, level: chosen.level, beside: other?.index });
    }
    if (other && !chosen.forest) canvas.append(el('span.caption.left', {}, variant.name), el('span.caption.right', {}, other.name), el('span.split'));
  }
  function pick(level) { chosen.level = level; show(); }
  function go(set, index) {
    Object.assign(chosen, { set, index, other: null });
    history.replaceState(null, '', `#/view/${encodeURIComponent(set)}/${index}`);
    show();
  }
  function step(by) {
    const { set } = find();
    go(set.set, (chosen.index + by + set.variants.length) % set.variants.length);
  }
  let seen = '';
  const fresh = () => {
    const { set } = find();
    const look = `${set.key} ${set.variants.length}`;
    if (look !== seen) { seen = look; show(); }
  };
  project.listeners.add(fresh);
  const levelKeys = event => {
    if (event.altKey && event.key >= '0' && event.key <= '7') { const { variant } = find(); if (Number(event.key) < variant.levels.length) { event.preventDefault(); pick(Number(event.key)); } }
  };
  window.addEventListener('keydown', levelKeys);
  begin();
  return {
    close() { closed = true; project.listeners.delete(fresh); window.removeEventListener('keydown', levelKeys); stage?.close(); },
    key(event) {
      const key = event.key.toLowerCase();
      if (key === 'arrowleft' || key === 'arrowright') { event.preventDefault(); stage?.turn(key === 'arrowleft' ? -15 : 15); }
      else if (key === 'arrowup' || key === 'arrowdown') { event.preventDefault(); stage?.near?.(key === 'arrowup' ? .8 : 1.25); }
      else if (key === '[' || key === ']') step(key === '[' ? -1 : 1);
      else if (three() && { w: 1, b: 1, f: 1 }[key]) { const name = { w: 'wire', b: 'wind', f: 'forest' }[key]; chosen[name] = !chosen[name]; show(); }
    },
  };
}
