// Tune: sliders for what a species or a preset says, with the ranges of the schema; the tree follows, and what is good is
// written back to the text, which keeps its comments and order.

import { choice, el, latest, number, post, project, say } from './kit.js';

const chosen = { preset: null, file: null, show: null };
/** What is not saved yet, by preset and file: it stays while other views and files are looked at. */
const unsaved = new Map();
const drafted = (preset, file) => {
  const key = JSON.stringify([preset, file]);
  if (!unsaved.has(key)) unsaved.set(key, { preset, file, base: null, changes: new Map(), history: [] });
  return unsaved.get(key);
};
const pending = (of = () => true) => [...unsaved.values()].filter(draft => draft.changes.size && project.state.sets.some(set => set.preset === draft.preset) && of(draft));
const changesOf = drafts => drafts.reduce((sum, draft) => sum + draft.changes.size, 0);
const many = n => `${n} ${n === 1 ? 'change' : 'changes'}`;
// The browser asks before the page itself is left with them.
window.addEventListener('beforeunload', event => { if (pending().length) event.preventDefault(); });

const words = path => path.replace(/\["([^"]+)"\]/g, ' $1').replaceAll('_', ' ').replaceAll('.', ' · ');
const whole = knob => knob.kind === 'number' && knob.whole;

/** Wide ranges are better turned by ratios than by steps. */
function ruler(knob) {
  const { low, high } = knob;
  const wide = low >= 0 && high / Math.max(low, 1e-9) > 100 && high > 10;
  const floor = wide ? Math.max(low, high / 1e5, 1e-4) : low;
  const to = value => (wide ? Math.log(Math.max(value, floor) / floor) / Math.log(high / floor) : (value - low) / (high - low)) * 1000;
  const from = place => {
    const t = place / 1000;
    const value = wide ? (t <= 0 ? low : floor * (high / floor) ** t) : low + (high - low) * t;
    if (knob.whole) return Math.round(value);
    const digits = Math.max(0, 2 - Math.floor(Math.log10(Math.max(Math.abs(value), (high - low) / 1000, 1e-6))));
    return Number(value.toFixed(Math.min(digits, 6)));
  };
  return { to, from };
}
const ron = (knob, value) => (whole(knob) ? String(Math.round(value)) : Number.isInteger(value) ? value.toFixed(1) : String(value));

export function open(main) {
  const presets = project.state.sets.map(set => set.preset);
  if (!presets.length) { main.append(el('div.empty', {}, el('h2', {}, 'No preset yet'))); return null; }
  if (!presets.includes(chosen.preset)) { chosen.preset = presets[0]; chosen.file = null; chosen.show = null; }
  const bar = el('div.bar');
  const list = el('div.knobs');
  const filter = el('input', { type: 'search', placeholder: 'Find a parameter', 'aria-label': 'Find a parameter', size: 16, oninput: fill });
  const saveButton = el('button.strong', { onclick: keep, disabled: true }, 'Save');
  const backButton = el('button', { onclick: back, disabled: true }, 'Undo all');
  const told = el('p.soft', { role: 'status' });
  const notes = el('ul.soft.told', { 'aria-label': 'Notes', hidden: true });
  const canvas = el('div.canvas');
  const image = el('img', { alt: '' });
  const busy = el('span.busy', { hidden: true }, 'growing…');
  canvas.append(image, busy);
  main.append(bar, el('div.two', {},
    el('div.left', {}, el('div.panel.tuning', {}, el('div.top', {}, el('div.bar', {}, filter, saveButton, backButton), told, notes), list)), canvas));

  let text = null, mine = drafted(null, null), turn = 26, closed = false;
  async function load() {
    const query = new URLSearchParams({ preset: chosen.preset });
    if (chosen.file) query.set('file', chosen.file);
    let answer = await fetch(`/api/knobs?${query}`);
    if (answer.status === 403 && chosen.file) { unsaved.delete(JSON.stringify([chosen.preset, chosen.file])); chosen.file = null; return load(); }
    if (!answer.ok) { told.textContent = (await answer.json().catch(() => ({}))).message ?? 'The preset is wrong'; return; }
    text = await answer.json();
    if (!chosen.file) {
      const species = text.sources.find(source => source.species)?.species;
      chosen.file = species && text.files.includes(species) ? species : text.file;
      if (chosen.file !== text.file) return load();
    }
    mine = drafted(chosen.preset, chosen.file);
    if (mine.changes.size && mine.base && mine.base !== text.base) say('The file was changed meanwhile: your changes are kept here, look at them again');
    mine.base = text.base;
    for (const knob of text.knobs) if (mine.changes.get(knob.path) === knob.value) mine.changes.delete(knob.path);
    const names = text.sources.map(source => source.name);
    const own = text.sources.filter(source => source.species === chosen.file).map(source => source.name);
    const shows = [...(chosen.file === chosen.preset ? names : own.length ? own : names).map(name => [`source:${name}`, `source ${name}`]),
      ...(chosen.file === chosen.preset ? (project.state.sets.find(s => s.preset === chosen.preset)?.variants ?? []).slice(0, 60).map(v => [`variant:${v.index}`, v.name]) : [])];
    if (!shows.some(([key]) => key === chosen.show)) chosen.show = shows[0]?.[0] ?? null;
    bar.replaceChildren(
      choice('Preset', presets.map(name => [name, name]), chosen.preset, value => { Object.assign(chosen, { preset: value, file: null, show: null }); load(); }),
      choice('File', text.files.map(name => [name, name]), chosen.file, value => { chosen.file = value; chosen.show = null; load(); }),
      choice('Shown', shows, chosen.show, value => { chosen.show = value; ask(); }));
    fill();
    ask();
  }
  function reset() { mine.changes.clear(); mine.history = []; }
  function changed() {
    saveButton.disabled = backButton.disabled = !mine.changes.size;
    const others = pending(draft => draft.preset === chosen.preset && draft !== mine).map(draft => `${draft.changes.size} in ${draft.file}`);
    const own = mine.changes.size ? [`${many(mine.changes.size)} not saved yet`] : [];
    told.textContent = [...own, ...(others.length ? [`not saved either: ${others.join(', ')}`] : [])].join(' · ');
  }
  function set(knob, value, card) {
    mine.history.push([knob.path, mine.changes.get(knob.path)]);
    if (value === knob.value) mine.changes.delete(knob.path); else mine.changes.set(knob.path, value);
    card?.classList.toggle('changed', mine.changes.has(knob.path));
    changed();
    ask();
  }
  function control(knob) {
    const value = mine.changes.get(knob.path) ?? knob.value;
    const id = `knob-${knob.path.replace(/[^a-z0-9]/gi, '-')}`;
    const card = el(`div.knob${mine.changes.has(knob.path) ? '.changed' : ''}`, { 'data-path': knob.path });
    const label = el('label', { htmlFor: id }, knob.name.replaceAll('_', ' '));
    let input, top;
    if (knob.kind === 'number') {
      const scale = ruler(knob);
      const exact = el('input', { type: 'number', min: knob.low, max: knob.high, step: knob.whole ? 1 : 'any', value: value === '' ? '' : Number(value), 'aria-label': `${knob.name}, exact` });
      input = el('input', { type: 'range', id, min: 0, max: 1000, step: 1 });
      input.value = scale.to(Number(value === '' ? knob.low : value));
      if (knob.high > 1e6) input = null;
      input?.setAttribute('aria-valuetext', `${value} ${knob.unit}`);
      const take = number => {
        const clamped = Math.min(knob.high, Math.max(knob.low, number));
        if (Number.isNaN(clamped)) return;
        exact.value = clamped;
        input?.setAttribute('aria-valuetext', `${clamped} ${knob.unit}`);
        set(knob, ron(knob, clamped), card);
      };
      input?.addEventListener('input', () => take(scale.from(Number(input.value))));
      exact.addEventListener('change', () => { if (input) input.value = scale.to(Number(exact.value)); take(Number(exact.value)); });
      if (!input) exact.id = id;
      top = exact;
    } else if (knob.kind === 'word') {
      input = el('select', { id, onchange: () => set(knob, input.value, card) },
        knob.words.map(word => el('option', { value: word, selected: word === value }, word.replaceAll('"', ''))));
    } else {
      const plain = value.replaceAll('"', '');
      input = el('input', { type: 'color', id, value: /^#[0-9a-f]{6}$/i.test(plain) ? plain : '#808080', oninput: () => set(knob, `"${input.value}"`, card) });
    }
    card.append(el('div.top', {}, label, top ?? null), ...(input ? [input] : []));
    if (knob.kind === 'number' && input) card.append(el('div.range', {}, el('span', {}, String(knob.low)), el('span', {}, knob.unit), el('span', {}, String(knob.high))));
    card.append(el('p.about', {}, knob.about, knob.given ? '' : ' (not in the file yet)'));
    // What the preset says of its trees stands above what the species says of all of its kind.
    const taller = knob.path === 'height' ? text.sources.filter(source => source.species === chosen.file && source.height) : [];
    if (taller.length) {
      const heights = taller.map(source => `${source.name} ${source.height} m`).join(', ');
      card.append(el('p.about.above', {}, `${taller.length === 1 ? 'A source has a height of its own' : 'Sources have heights of their own'}, which stands in place of this one: ${heights}`));
    }
    return card;
  }
  function fill() {
    if (!text) return;
    const wanted = filter.value.trim().toLowerCase();
    const groups = new Map();
    for (const knob of text.knobs) {
      if (wanted && !`${knob.path} ${knob.about}`.toLowerCase().includes(wanted)) continue;
      groups.set(knob.group, [...(groups.get(knob.group) ?? []), knob]);
    }
    const open = new Set([...list.querySelectorAll('details[open]')].map(d => d.dataset.group));
    const first = !list.childElementCount;
    list.replaceChildren(...[...groups].map(([group, knobs], i) => {
      const details = el('details', { 'data-group': group, open: wanted ? true : open.has(group) || (first && i === 0) },
        el('summary', {}, group ? words(group) : 'Whole plant'));
      // Controls are made when they are looked at.
      const show = () => { if (details.open && details.childElementCount === 1) details.append(...knobs.map(control)); };
      details.addEventListener('toggle', show);
      show();
      return details;
    }));
    if (!groups.size) list.replaceChildren(el('p.soft', {}, 'Nothing of that name.'));
    changed();
  }
  const edits = (draft = mine) => [...draft.changes].map(([path, value]) => ({ path, value }));
  const ask = latest(async () => {
    if (closed || !chosen.show || !text) return;
    const [kind, ...rest] = chosen.show.split(':');
    const show = kind === 'source' ? { source: rest.join(':') } : { variant: Number(rest[0]) };
    const height = Math.min(900, Math.max(240, Math.round(canvas.clientHeight)));
    const width = Math.max(240, Math.min(1024, Math.round(canvas.clientWidth)));
    busy.hidden = false;
    try {
      const answer = await post('/api/draft', { preset: chosen.preset, edits: Object.fromEntries(pending(draft => draft.preset === chosen.preset).map(draft => [draft.file, edits(draft)])), show, turn, width, height });
      const facts = JSON.parse(answer.headers.get('x-treewright'));
      const url = URL.createObjectURL(await answer.blob());
      await Object.assign(new Image(), { src: url }).decode();
      if (image.src.startsWith('blob:')) URL.revokeObjectURL(image.src);
      image.src = url;
      image.alt = `${chosen.show} with ${mine.changes.size} changes`;
      canvas.dataset.drawn = JSON.stringify([chosen.show, edits()]);
      changed();
      notes.replaceChildren(...(facts.notes ?? []).map(note => el('li', {}, note)));
      notes.hidden = !facts.notes?.length;
      if (told.textContent) told.textContent += ` · ${facts.chains} branches, ${number.format(facts.height)} m`;
      else told.textContent = `${facts.chains} branches, ${facts.leaves} leaves, ${number.format(facts.height)} m`;
    } catch (error) { notes.hidden = true; told.textContent = error.message; canvas.dataset.drawn = `error ${error.message}`; } finally { busy.hidden = true; }
  });
  let from = null;
  canvas.addEventListener('pointerdown', event => { from = [event.clientX, turn]; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener('pointermove', event => { if (from) { turn = from[1] - (event.clientX - from[0]) * .6; ask(); } });
  canvas.addEventListener('pointerup', () => { from = null; });
  async function keep() {
    const saving = mine, sent = edits();
    try {
      await post('/api/save', { preset: saving.preset, file: saving.file, base: saving.base, edits: sent });
      say(`Saved in ${saving.file}; the set is built anew`);
      // What was turned meanwhile is not saved yet.
      for (const { path, value } of sent) if (saving.changes.get(path) === value) saving.changes.delete(path);
      Object.assign(saving, { base: null, history: [] });
      load();
    } catch (error) {
      // A file that was changed meanwhile is read again, which says so.
      if (error.status === 409) load(); else say(error.message);
    }
  }
  function back() { reset(); list.replaceChildren(); fill(); ask(); }
  const undo = event => {
    if (!(event.ctrlKey || event.metaKey) || event.key !== 'z' || !mine.history.length || event.target.closest('input[type=search]')) return;
    event.preventDefault();
    const [path, value] = mine.history.pop();
    if (value === undefined) mine.changes.delete(path); else mine.changes.set(path, value);
    const open = [...list.querySelectorAll('details')];
    open.forEach(d => { while (d.childElementCount > 1) d.lastChild.remove(); });
    fill();
    ask();
  };
  window.addEventListener('keydown', undo);
  const follow = ({ detail }) => { if (detail.what === 'built' && detail.preset === chosen.preset && !mine.changes.size) load(); };
  window.addEventListener('treewright', follow);
  load();
  return { close() {
    closed = true;
    if (pending().length) say(`${many(changesOf(pending()))} kept in Tune, not saved yet`);
    window.removeEventListener('keydown', undo); window.removeEventListener('treewright', follow);
  } };
}
