// The frame: tabs, what is going on, errors, keys. Each view is a module that is loaded when it is opened.

import { el, errorCards, project, refresh } from './kit.js';

const views = ['gallery', 'view', 'explore', 'tune', 'sketch'];
const modules = {
  gallery: () => import('./gallery.js'), view: () => import('./stage.js'), explore: () => import('./explore.js'),
  tune: () => import('./tune.js'), sketch: () => import('./sketch.js'),
};
const main = document.getElementById('main');
let current = null;

async function route() {
  const [name, ...rest] = location.hash.replace(/^#\/?/, '').split('/').map(decodeURIComponent);
  const view = views.includes(name) ? name : 'gallery';
  for (const tab of document.querySelectorAll('[data-tab]')) {
    if (tab.dataset.tab === view) tab.setAttribute('aria-current', 'page'); else tab.removeAttribute('aria-current');
  }
  const module = await modules[view]();
  current?.close?.();
  main.replaceChildren();
  main.dataset.view = view;
  document.title = `${view[0].toUpperCase()}${view.slice(1)} · Treewright`;
  current = module.open(main, rest) ?? null;
}

function mood(state) {
  const status = document.getElementById('status');
  const text = document.getElementById('status-text');
  const building = state.sets.find(set => set.building);
  const wrong = state.sets.filter(set => set.errors.length).length + state.errors.length;
  if (building) {
    status.dataset.mood = 'busy';
    text.textContent = `Building ${building.set}${building.all ? ` · ${Math.round(building.done / building.all * 100)} %` : ''}`;
  } else if (wrong) {
    status.dataset.mood = 'bad';
    text.textContent = wrong === 1 ? 'A preset is wrong' : `${wrong} presets are wrong`;
  } else {
    status.dataset.mood = 'good';
    text.textContent = state.polling ? 'Up to date, looking every so often' : 'Up to date';
  }
  document.getElementById('folder').textContent = state.folder ?? '';
  const box = document.getElementById('errors');
  const cards = [...errorCards(state.errors), ...state.sets.flatMap(set => errorCards(set.errors, set.variants.length))];
  box.hidden = !cards.length;
  box.replaceChildren(...cards);
  if (!building) document.querySelector('#progress i').style.width = '0';
}

project.listeners.add(mood);

function listen() {
  const events = new EventSource('/api/events');
  events.addEventListener('state', ({ data }) => {
    const news = JSON.parse(data);
    window.dispatchEvent(new CustomEvent('treewright', { detail: news }));
    if (news.what === 'step') {
      const share = Math.round(news.done / news.all * 100);
      document.querySelector('#progress i').style.width = `${share}%`;
      const set = project.state?.sets.find(set => set.preset === news.preset);
      if (set) document.getElementById('status-text').textContent = `Building ${set.set} · ${share} %`;
    } else refresh();
  });
  let lost = false;
  events.onerror = () => {
    lost = true;
    document.getElementById('status').dataset.mood = 'away';
    document.getElementById('status-text').textContent = 'Not connected: is treewright preview running?';
  };
  events.onopen = () => { if (lost) { lost = false; refresh(); } };
}

window.addEventListener('hashchange', route);
window.addEventListener('keydown', event => {
  const typing = event.target.closest?.('input:not([type=range]), select, textarea, dialog');
  if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key >= '1' && event.key <= '5') location.hash = `#/${views[event.key - 1]}`;
  else if (event.key === '?') document.getElementById('help').showModal();
  else current?.key?.(event);
});
document.getElementById('help-button').addEventListener('click', () => document.getElementById('help').showModal());

refresh().then(route).then(() => document.documentElement.dataset.ready = 'yes').catch(error => {
  main.replaceChildren(el('div.empty', {}, el('h2', {}, 'The server does not answer'), el('p', {}, String(error))));
});
listen();
