// The turntable: pictures drawn by the program, turned by dragging. It needs neither WebGL nor a library.

import { el, picture } from './kit.js';

const STEP = 15;

export function turntable(box) {
  const image = el('img', { alt: '', draggable: false });
  box.append(image);
  let shown = null, turn = 30, from = null;
  const near = new Map();

  function source(at) {
    const height = Math.min(1024, Math.max(240, Math.round(box.clientHeight)));
    const width = Math.min(1024, Math.max(240, Math.round(box.clientWidth)));
    return picture(shown.set, shown.index, { level: shown.level, turn: at, width, height });
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
    close() { resized.disconnect(); },
  };
}
