// The gallery: every set with its variants; sort, filter, keep and reject.

import { count, el, number, picture, post, project, recipe, say } from './kit.js';

const sorts = {
  order: ['as in the preset', (a, b) => a.index - b.index],
  height: ['tallest first', (a, b) => b.height - a.height],
  triangles: ['fewest triangles', (a, b) => a.triangles - b.triangles],
  leaves: ['most leaves', (a, b) => b.leaves - a.leaves],
  score: ['most unlike its sources', (a, b) => (b.score ?? -1) - (a.score ?? -1)],
};
const kept = { sort: 'order', filter: '', show: 'all' };

function details(variant) {
  const rows = [
    ['Height', `${number.format(variant.height)} m`],
    ['Triangles', count(variant.triangles), variant.levels.map(level => `${level.kind} ${level.triangles}`).join(', ')],
    variant.score === null ? null : ['Unlike', `${number.format(variant.score * 100)} %`, 'How far it is from its sources in all: crown, bare trunk, topology'],
    ['Seed', variant.seed.length > 9 ? `${variant.seed.slice(0, 8)}…` : variant.seed, variant.seed],
  ];
  return el('dl', {}, rows.filter(Boolean).map(([name, value, more]) => el('div', { title: more ?? value }, el('dt', {}, name), el('dd', {}, value))));
}

/** Writes what was decided into the preset. */
async function decide(set, variant, decision) {
  try {
    const answer = await post('/api/decide', { preset: set.preset, index: variant.index, key: set.key, decision });
    const { told } = await answer.json();
    say(told);
  } catch (error) { say(error.message); }
}

function card(set, variant) {
  const acts = variant.number === null || variant.number === undefined ? null : el('div.acts', {},
    el('button', {
      'aria-pressed': String(variant.kept), title: 'Keep: its number goes into the preset (K)',
      onclick: () => decide(set, variant, variant.kept ? 'free' : 'keep'),
    }, variant.kept ? '★ Kept' : '☆ Keep'),
    el('button', { title: 'Reject: another takes its place (X)', onclick: () => decide(set, variant, 'reject') }, '✕ Reject'));
  return el(`article.card${variant.kept ? '.kept' : ''}`, { 'data-set': set.set, 'data-index': variant.index },
    el('a.open', { href: `#/view/${encodeURIComponent(set.set)}/${variant.index}`, 'aria-label': `${variant.name}, ${recipe(variant.recipe)}` },
      el('div.shot', {}, el('img', { src: picture(set, variant.index), alt: '', loading: 'lazy', decoding: 'async', width: 300, height: 360 })),
      el('div.name', {}, variant.name),
      el('div.recipe', { title: recipe(variant.recipe) }, recipe(variant.recipe)),
      details(variant)),
    variant.kept ? el('span.badge', {}, '★ kept') : null,
    acts);
}

function shown(set) {
  const wanted = kept.filter.trim().toLowerCase();
  const words = variant => `${variant.name} ${recipe(variant.recipe)} ${variant.seed} ${set.set}`.toLowerCase();
  return set.variants
    .filter(variant => !wanted || wanted.split(/\s+/).every(word => words(variant).includes(word)))
    .filter(variant => kept.show === 'all' || variant.kept)
    .sort(sorts[kept.sort][1]);
}

function section(set) {
  const variants = shown(set);
  if (!variants.length && (kept.filter || kept.show !== 'all')) return null;
  const facts = [set.preset, `${set.variants.length} variants`];
  if (set.took) facts.push(`built in ${number.format(set.took)} s`);
  if (set.rejected?.length) facts.push(`${set.rejected.length} rejected`);
  const forgive = set.rejected?.length
    ? el('button.quiet', { onclick: () => forget(set) }, 'Forgive the rejected') : null;
  return el(`section.set${set.building ? '.stale' : ''}`, { 'aria-label': set.set, 'data-set': set.set },
    el('h2', {}, set.set, el('small', {}, facts.join(' · ')), forgive),
    set.notes.length ? el('details.notes', {}, el('summary', {}, `${set.notes.length} ${set.notes.length === 1 ? 'note' : 'notes'} on the sources`),
      el('ul', {}, set.notes.map(note => el('li', {}, note)))) : null,
    variants.length
      ? el('div.cards', {}, variants.map(variant => card(set, variant)))
      : el('p.empty', {}, set.building ? 'Growing the first trees…' : 'No tree yet.'));
}

async function forget(set) {
  try {
    await post('/api/decide', { preset: set.preset, index: 0, key: set.key, decision: 'forgive' });
    say(`The rejected of ${set.set} may come back`);
  } catch (error) { say(error.message); }
}

export function open(main) {
  const filter = el('input', {
    type: 'search', placeholder: 'Filter by name, source or seed  ( / )', 'aria-label': 'Filter', value: kept.filter, size: 34,
    oninput: () => { kept.filter = filter.value; fill(); },
  });
  const sort = el('select', { onchange: () => { kept.sort = sort.value; fill(); } },
    Object.entries(sorts).map(([key, [text]]) => el('option', { value: key, selected: key === kept.sort }, text)));
  const onlyKept = el('button', {
    'aria-pressed': String(kept.show !== 'all'),
    onclick: () => { kept.show = kept.show === 'all' ? 'kept' : 'all'; onlyKept.setAttribute('aria-pressed', String(kept.show !== 'all')); fill(); },
  }, '★ Kept only');
  const told = el('span.soft', { role: 'status' });
  const sets = el('div');
  main.append(el('div.bar', {}, filter, el('label.field', {}, 'Order', sort), onlyKept, el('span.grow'), told), sets);

  let seen = '';
  function fill() {
    const state = project.state;
    const all = state.sets.reduce((sum, set) => sum + set.variants.length, 0);
    const some = state.sets.reduce((sum, set) => sum + shown(set).length, 0);
    told.textContent = all === some ? `${all} trees in ${state.sets.length} ${state.sets.length === 1 ? 'set' : 'sets'}` : `${some} of ${all} trees`;
    // What looks the same stays, so that a scrolled page and a focused card stay where they are.
    const look = JSON.stringify([kept, state.sets.map(set => [set.key, set.preset, set.variants.length ? 0 : set.building, set.notes, set.took, set.variants.map(v => v.kept), set.rejected])]);
    for (const set of state.sets) sets.querySelector(`[data-set="${CSS.escape(set.set)}"]`)?.classList.toggle('stale', set.building);
    if (look === seen) return;
    seen = look;
    const focused = document.activeElement?.closest?.('.card');
    const mark = focused ? [focused.dataset.set, focused.dataset.index] : null;
    const made = state.sets.map(section).filter(Boolean);
    sets.replaceChildren(...(made.length ? made : [empty(state)]));
    if (mark) [...sets.querySelectorAll('.card')].find(c => c.dataset.set === mark[0] && c.dataset.index === mark[1])?.querySelector('a').focus({ preventScroll: true });
  }
  project.listeners.add(fill);
  fill();

  // While a set is built anew, drafts of what is in sight: a tree is seen long before its levels and textures are made.
  let drafting = null;
  async function drafts(preset) {
    const set = project.state.sets.find(set => set.preset === preset);
    if (!set?.variants.length) return;
    drafting?.abort();
    const mine = drafting = new AbortController();
    const cards = [...sets.querySelectorAll(`.card[data-set="${CSS.escape(set.set)}"]`)].filter(card => {
      const box = card.getBoundingClientRect();
      return box.bottom > 0 && box.top < innerHeight;
    }).slice(0, 12);
    for (const card of cards) {
      const start = performance.now();
      try {
        const show = { variant: Number(card.dataset.index) };
        const answer = await post('/api/draft', { preset, show, turn: 26, width: 300, height: 360, care: 'quick' }, mine.signal);
        const url = URL.createObjectURL(await answer.blob());
        if (mine.signal.aborted) return;
        const image = card.querySelector('img');
        image.addEventListener('load', () => URL.revokeObjectURL(url), { once: true });
        image.src = url;
        card.classList.add('draft');
      } catch { return; }
      // A set that takes this long is better left to the build.
      if (performance.now() - start > 4000) return;
    }
  }
  const news = ({ detail }) => {
    if (detail.what === 'building') drafts(detail.preset);
    else if (detail.what === 'built' || detail.what === 'failed') {
      drafting?.abort();
      const set = project.state.sets.find(set => set.preset === detail.preset);
      // What was only a draft shows the last good set again; a new one comes with its own pictures.
      for (const card of sets.querySelectorAll(`.card.draft[data-set="${CSS.escape(set?.set ?? '')}"]`)) {
        card.classList.remove('draft');
        if (detail.what === 'failed') card.querySelector('img').src = picture(set, Number(card.dataset.index));
      }
      if (detail.what === 'built') seen = '';
    }
  };
  window.addEventListener('treewright', news);

  function step(by) {
    const cards = [...sets.querySelectorAll('.card a.open')];
    const at = cards.indexOf(document.activeElement);
    const wide = cards.filter(c => c.getBoundingClientRect().top === cards[Math.max(at, 0)]?.getBoundingClientRect().top).length || 1;
    const to = at < 0 ? 0 : at + (Math.abs(by) === 1 ? by : Math.sign(by) * wide);
    const next = cards[Math.min(Math.max(to, 0), cards.length - 1)];
    next?.focus();
    next?.scrollIntoView({ block: 'nearest' });
  }
  return {
    close() { project.listeners.delete(fill); window.removeEventListener('treewright', news); drafting?.abort(); },
    key(event) {
      const by = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: -2, ArrowDown: 2 }[event.key];
      const focused = document.activeElement?.closest?.('.card');
      if (event.key === '/') { event.preventDefault(); filter.focus(); }
      else if (by) { event.preventDefault(); step(by); }
      else if (focused && (event.key === 'k' || event.key === 'x')) {
        const set = project.state.sets.find(set => set.set === focused.dataset.set);
        const variant = set?.variants[Number(focused.dataset.index)];
        if (variant && variant.number !== null) decide(set, variant, event.key === 'x' ? 'reject' : variant.kept ? 'free' : 'keep');
      }
    },
  };
}

function empty(state) {
  if (kept.filter || kept.show !== 'all') return el('div.empty', {}, el('h2', {}, 'Nothing fits'), el('p', {}, kept.filter ? 'No tree has these words in its name, its sources or its seed.' : 'No tree is kept yet: press K on one.'));
  if (!state.sets.length) return el('div.empty', {}, el('h2', {}, 'No preset yet'), el('p', {}, `treewright new NAME --folder ${state.folder ?? 'presets'} makes one; it appears here by itself.`));
  return el('div.empty', {}, el('h2', {}, 'No tree yet'), el('p', {}, 'They appear as soon as they are built.'));
}
