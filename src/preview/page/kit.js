// What every view uses: elements, the state that the server tells, pictures, and saving.

/** Makes an element: el('button.strong', {onclick}, 'Save'). */
export function el(what, given = {}, ...children) {
  const [tag, ...classes] = what.split('.');
  const made = document.createElement(tag || 'div');
  if (classes.length) made.className = classes.join(' ');
  for (const [name, value] of Object.entries(given)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith('on')) made.addEventListener(name.slice(2), value);
    else if (name in made && !name.includes('-') && name !== 'list' && name !== 'width' && name !== 'height') made[name] = value;
    else made.setAttribute(name, value === true ? '' : value);
  }
  made.append(...children.flat().filter(child => child !== undefined && child !== null && child !== false));
  return made;
}

/** The same in SVG's name space. */
export function svg(tag, given = {}, ...children) {
  const made = document.createElementNS('http://www.w3.org/2000/svg', tag);
  for (const [name, value] of Object.entries(given)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

/** The state, and who wants to know when it changes. */
export const project = { state: null, listeners: new Set() };

let asked = 0;
/** Asks for the whole state; an older answer never replaces a newer one. */
export async function refresh() {
  const mine = ++asked;
  const answer = await fetch('/api/state');
  const state = await answer.json();
  if (mine < asked && project.state) return;
  project.state = state;
  for (const listener of [...project.listeners]) listener(state);
}

/** Sends JSON; gives the answer, or throws what the server says is wrong. */
export async function post(path, body, signal) {
  const answer = await fetch(path, {
    method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify(body), signal,
  });
  if (!answer.ok) {
    const text = await answer.text();
    let told = null;
    try { told = JSON.parse(text); } catch { /* a sentence */ }
    throw Object.assign(new Error(told?.message ?? text), { status: answer.status, errors: told?.errors ?? [] });
  }
  return answer;
}

let fading;
/** Says something for a moment. */
export function say(text) {
  const toast = document.getElementById('toast');
  toast.textContent = text;
  toast.classList.add('shown');
  clearTimeout(fading);
  fading = setTimeout(() => toast.classList.remove('shown'), 3500);
}

/** The address of a variant's picture; its key makes it a new one after each build. */
export function picture(set, index, { level, turn = 26, width = 300, height = 360 } = {}) {
  const wanted = new URLSearchParams({ turn, width, height, key: (set.key ?? '').slice(0, 12) });
  if (level !== undefined) wanted.set('level', level);
  return `/picture/${encodeURIComponent(set.set)}/${index}?${wanted}`;
}

export const number = new Intl.NumberFormat('en', { maximumFractionDigits: 1 });
export const count = n => (n >= 10000 ? `${number.format(n / 1000)} k` : number.format(n));

/** A drawing's name: without its folders, and without what every drawing's file ends with. */
const drawing = path => path.split('/').at(-1).replace(/\.svg$/i, '');

/** What a variant is made of, in a few words. */
export function recipe(told) {
  if (!told) return '';
  if (told.sketch) {
    const { sketch, ...rest } = told;
    const frame = told.frames === undefined ? '' : `, frame ${told.frame + 1} of ${told.frames}`;
    const of = told.of ?? told.source ?? recipe(rest);
    const shape = one => [one.crown, one.side].filter(Boolean).map(drawing).join(' and ');
    return `${of} in the shape of ${[sketch, ...(sketch.then ?? [])].map(shape).join(', then ')}${frame}`;
  }
  const names = told.blend ?? told.mix ?? told.geodesic ?? told.mean;
  if (told.source) return `${told.source} as it is`;
  if (told.weights && names) return names.map((name, i) => `${Math.round(told.weights[i] * 100)} % ${name}`).join(', ');
  if (told.blend && told.progress !== undefined) return `${told.blend.join(' → ')}, ${Math.round(told.progress * 100)} %`;
  return Object.keys(told)[0] ?? '';
}

/** Runs one at a time, the last asked for next; what was asked for in between is left out. */
export function latest(work) {
  let running = false, next = null;
  return async function run(...given) {
    if (running) { next = given; return; }
    running = true;
    try { await work(...given); } finally {
      running = false;
      if (next) { const again = next; next = null; run(...again); }
    }
  };
}

/** Saves edits of a file that still is as `base` says. */
export async function save(preset, file, base, edits) {
  const answer = await post('/api/save', { preset, file, base, edits });
  return answer.json();
}

/** A select with a label. */
export function choice(label, options, value, onchange) {
  const select = el('select', { onchange: () => onchange(select.value) },
    options.map(([key, text]) => el('option', { value: key, selected: String(key) === String(value) }, text)));
  return el('label.field', {}, label, select);
}

/** What the errors of a preset look like. */
export function errorCards(errors, stays) {
  return errors.map(error => el('article.error', {},
    el('h3', {}, el('b', {}, 'Error '), error.field ? `${error.field}: ${error.message}` : error.message),
    el('p.where', {}, error.line ? `${error.file}, line ${error.line}, column ${error.column}` : error.file),
    error.lines.length ? el('pre', { tabIndex: 0 }, error.lines.map(([n, text]) => {
      const letters = [...text];
      const [from, to] = error.mark;
      return el(`span.line${n === error.line ? '.wrong' : ''}`, {}, el('span.n', {}, String(n)),
        ...(n === error.line
          ? [letters.slice(0, from).join(''), el('mark', {}, letters.slice(from, to).join('') || ' '), letters.slice(to).join('')]
          : [text]));
    })) : null,
    error.hint ? el('p.hint', {}, `Help: ${error.hint}`) : null,
    error.asked_by ? el('p.hint', {}, `Asked for by ${error.asked_by}`) : null,
    stays ? el('p.stays', {}, 'The last good set stays.') : null));
}
