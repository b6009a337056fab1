// The turntable: pictures drawn by the program, turned by dragging. It needs neither WebGL nor a library.

import { el, picture } from './kit.js';

const STEP = 15;

export function turntable(box) {
  const image = el('img', { alt: '', draggable: false }), second = el('img.flat', { alt: '', draggable: false, hidden: true });
  box.append(image, second);
  let shown = null, turn = 30, from = null;
  const near = new Map();

  function source(at, index = shown.index) {
    const height = Math.min(1024, Math.max(240, Math.round(box.clientHeight)));
    const width = Math.min(1024, Math.max(200, Math.round(box.clientWidth / (shown.beside === undefined ? 1 : 2))));
    return picture(shown.set, index, { level: shown.level, turn: at, width, height });
  }
  function draw() {
    if (!shown) return;
    const snapped = ((Math.round(turn / STEP) * STEP) % 360 + 360) % 360;
    const wanted = source(snapped);
    if (image.dataset.wanted === wanted) return;
    image.dataset.wanted = wanted;
    // Shown when it is there, so that nothing flickers; neighbours are fetched ahead.
    const next = near.get(wanted) ?? Object.assign(new Image(), { src: wanted });
    near.set(wanted, next);
    next.decode().then(() => {
      if (image.dataset.wanted !== wanted) return;
      image.src = wanted;
      second.hidden = shown.beside === undefined;
      box.classList.toggle('halves', !second.hidden);
      if (!second.hidden) second.src = source(snapped, shown.beside);
      image.alt = `${shown.name}, seen from ${snapped} degrees`;
      box.dataset.drawn = wanted;
      for (const by of [STEP, -STEP, 2 * STEP]) {
        const url = source(((snapped + by) % 360 + 360) % 360);
        if (!near.has(url)) near.set(url, Object.assign(new Image(), { src: url }));
      }
    }).catch(() => {});
  }
  box.addEventListener('pointerdown', event => { from = [event.clientX, turn]; box.setPointerCapture(event.pointerId); });
  box.addEventListener('pointermove', event => { if (from) { turn = from[1] - (event.clientX - from[0]) * .6; draw(); } });
  for (const end of ['pointerup', 'pointercancel']) box.addEventListener(end, () => { from = null; });
  const resized = new ResizeObserver(draw);
  resized.observe(box);
  return {
    show(what) { shown = what; near.clear(); draw(); },
    turn(by) { turn += by; draw(); },
    close() { resized.disconnect(); box.classList.remove('halves'); },
  };
}
